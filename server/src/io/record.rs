//! What a record has of the slave: from the entries of its loop to messages.

use mmt_shared::channel::peer::Loss;
use mmt_shared::io::record::{RecordSink, RecordWriter, Recorder, TickAbout, Ticked, Topics, Wall};
use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::record::messages::{Link, Parameters, SlaveTick as TickMessage, Stamp};
use mmt_shared::record::ros::{self, Marker};
use mmt_shared::time::Time;
use mmt_shared::wire::{Hello, Side};

use super::SlaveLive;
use super::context::Context;
use crate::again;
use crate::end::{SlaveEnd, session_config};
use crate::estimator::Estimate;
use crate::slave::{Memory, SlaveTick};

/// Standard messages of every so many ticks: 100 a second.
const STANDARD_TICKS: u64 = 10;

/// What a loop shows its record of the session, besides its ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlaveShown {
    live: SlaveLive,
    estimate: Estimate,
    /// The object's velocity as the slave sees it.
    twist: Twist,
    /// What of the slave's own datagrams arrived, as far as it knows.
    down: Loss,
}

impl SlaveShown {
    /// What an end shows besides the snapshot for screens.
    pub(super) fn new(end: &SlaveEnd, live: SlaveLive) -> Self {
        Self {
            live,
            estimate: *end.slave().estimate(),
            twist: end.slave().observer().twist(),
            down: end.channel().peer().outgoing(),
        }
    }
}

/// Where a slave's loop leaves its record.
pub(super) type SlaveSink = RecordSink<(), Option<SlaveTick>, SlaveShown>;

/// Begins the record of a session that begins at `began` with `hello`, where an `earlier` one ended.
pub(super) fn begin(
    recorder: &Recorder,
    context: &Context,
    began: Time,
    hello: &Hello,
    earlier: Option<&Memory>,
) -> SlaveSink {
    let configuration = context.configuration(&session_config(&context.config, hello));
    let session = again::session(began, &context.config, hello, earlier, &configuration);
    recorder.begin(Wall::now(context.clock), session, SlaveTopics::default())
}

/// The slave's topics.
#[derive(Debug, Default)]
struct SlaveTopics {
    ticks: u64,
}

impl Topics for SlaveTopics {
    const SIDE: Side = Side::Slave;
    type Given = ();
    type Done = Option<SlaveTick>;
    type Shown = SlaveShown;

    fn ticked(
        &mut self,
        about: &TickAbout,
        tick: &Ticked<(), Option<SlaveTick>>,
        out: &mut RecordWriter,
    ) {
        out.put("/slave/ticks", about.stamp, &message(about, tick));
        if let Some(done) = tick
            .done
            .filter(|_| self.ticks.is_multiple_of(STANDARD_TICKS))
        {
            let stamp = about.stamp;
            let tool = Pose::new(done.tool.x, done.tool.y, 0.0);
            out.put_standard("/slave/tool", stamp, ros::POSE, |cdr| {
                ros::pose(cdr, stamp, &tool);
            });
            out.put_standard("/slave/object", stamp, ros::POSE, |cdr| {
                ros::pose(cdr, stamp, &done.truth);
            });
            out.put_standard("/slave/force", stamp, ros::WRENCH, |cdr| {
                ros::force(cdr, stamp, done.f_s);
            });
        }
        self.ticks += 1;
    }

    fn shown(&mut self, stamp: Stamp, session: u32, shown: &SlaveShown, out: &mut RecordWriter) {
        let live = &shown.live;
        let tool = Pose::new(live.tool.x, live.tool.y, 0.0);
        let frames = [("slave/tool", tool), ("slave/object", live.truth)];
        out.put_standard("/tf", stamp, ros::FRAMES, |cdr| {
            ros::frames(cdr, stamp, &frames);
        });
        out.put_standard("/slave/object_twist", stamp, ros::TWIST, |cdr| {
            ros::twist(cdr, stamp, &shown.twist);
        });
        out.put_standard("/slave/markers", stamp, ros::MARKERS, |cdr| {
            ros::markers(cdr, stamp, &markers(live, tool));
        });
        let estimate = &shown.estimate;
        let mut covariance = [f64::NAN; 9];
        // symmetric: columns are rows
        for (into, value) in covariance.iter_mut().zip(estimate.covariance.iter()) {
            *into = *value;
        }
        let parameters = Parameters {
            stamp,
            session,
            m_kg: estimate.m,
            b_ns_per_m: estimate.b,
            c_n: estimate.c,
            covariance,
        };
        out.put("/slave/parameters", stamp, &parameters);
        let link = Link {
            stamp,
            session,
            rtt_ms: live.rtt_ms.unwrap_or(f64::NAN),
            up_expected: live.up.expected,
            up_received: live.up.received,
            down_expected: shown.down.expected,
            down_received: shown.down.received,
        };
        out.put("/slave/link", stamp, &link);
    }
}

fn message(about: &TickAbout, tick: &Ticked<(), Option<SlaveTick>>) -> TickMessage {
    const NONE: Vec2 = Vec2::new(f64::NAN, f64::NAN);
    let done = tick.done.as_ref();
    let vector = |of: fn(&SlaveTick) -> Vec2| done.map_or(NONE, of);
    let (tool, f_s) = (vector(|done| done.tool), vector(|done| done.f_s));
    let truth = vector(|done| done.true_force);
    let shadow = vector(|done| done.f_shadow);
    let f_m = vector(|done| done.f_m.unwrap_or(NONE));
    let object = vector(|done| done.truth.position);
    let update = done.and_then(|done| done.update);
    TickMessage {
        stamp: about.stamp,
        session: about.session,
        index: about.index,
        deadline_ns: tick.tick.deadline.as_nanos(),
        lateness_ns: about.lateness_ns,
        skipped: tick.tick.skipped,
        sent_ns: tick.sent.as_nanos(),
        plays: done.is_some(),
        sample_ns: done.map_or(0, |done| done.stamp.as_nanos()),
        tool_x_m: tool.x,
        tool_y_m: tool.y,
        f_s_x_n: f_s.x,
        f_s_y_n: f_s.y,
        true_x_n: truth.x,
        true_y_n: truth.y,
        f_shadow_x_n: shadow.x,
        f_shadow_y_n: shadow.y,
        f_m_x_n: f_m.x,
        f_m_y_n: f_m.y,
        in_contact: done.is_some_and(|done| done.in_contact),
        object_x_m: object.x,
        object_y_m: object.y,
        object_angle_rad: done.map_or(f64::NAN, |done| done.truth.angle),
        update: update.map_or("", |update| update.cause.name()).to_owned(),
        digest: about.digest,
    }
}

/// The object in vermilion, the tool at it, and what it feels.
fn markers(live: &SlaveLive, tool: Pose) -> Vec<Marker> {
    let vermilion = |opacity| [0.84, 0.37, 0.0, opacity];
    let body = live.footprint.as_ref();
    body.map(|faces| Marker::body("object", live.truth, faces, vermilion(0.5)))
        .into_iter()
        .chain([
            Marker::point("tool", tool),
            Marker::force("f_s", tool, live.f_s, vermilion(1.0)),
        ])
        .collect()
}
