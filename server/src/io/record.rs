//! What a record has of the slave: from the entries of its loop to messages.

use mmt_shared::io::record::{
    RecordSink, RecordWriter, Recorder, Shown, TickAbout, Ticked, Topics, Wall,
};
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::record::messages::{SlaveTick as TickMessage, Stamp};
use mmt_shared::record::ros::Standard;
use mmt_shared::time::Time;
use mmt_shared::wire::{Hello, Side};

use super::SlaveLive;
use super::context::Context;
use crate::again;
use crate::end::{SlaveEnd, SlaveGiven, session_config};
use crate::slave::{Memory, SlaveTick};

/// Where a slave's loop leaves its record.
pub(super) type SlaveSink = RecordSink<SlaveGiven, Option<SlaveTick>>;

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
    recorder.begin::<SlaveTopics>(Wall::now(context.clock), session)
}

/// What a record has of the snapshot for screens, and of the end besides.
pub(super) fn shown(live: &SlaveLive, end: &SlaveEnd) -> Shown {
    let slave = end.slave();
    let estimate = slave.estimate();
    let mut covariance = [f64::NAN; 9];
    // symmetric: columns are rows
    for (into, value) in covariance.iter_mut().zip(estimate.covariance.iter()) {
        *into = *value;
    }
    Shown {
        point: live.tool,
        force: live.f_s,
        body: live.truth,
        footprint: live.footprint,
        twist: slave.observer().twist(),
        params: [estimate.m, estimate.b, estimate.c],
        covariance,
        rtt_ms: live.rtt_ms,
        up: live.up,
        down: end.channel().peer().outgoing(),
    }
}

/// The slave's topics.
struct SlaveTopics;

impl Topics for SlaveTopics {
    const SIDE: Side = Side::Slave;
    type Given = SlaveGiven;
    type Done = Option<SlaveTick>;

    fn ticked(
        about: &TickAbout,
        tick: &Ticked<SlaveGiven, Option<SlaveTick>>,
        out: &mut RecordWriter,
    ) {
        out.put("/slave/ticks", about.stamp, &message(about, tick));
    }

    fn standard(stamp: Stamp, done: &Option<SlaveTick>, out: &mut RecordWriter) {
        let Some(done) = done else {
            return;
        };
        let tool = Standard::Pose(Pose::new(done.tool.x, done.tool.y, 0.0));
        out.put_standard("/slave/tool", stamp, tool);
        out.put_standard("/slave/object", stamp, Standard::Pose(done.truth));
        out.put_standard("/slave/force", stamp, Standard::Force(done.f_s));
    }
}

fn message(about: &TickAbout, tick: &Ticked<SlaveGiven, Option<SlaveTick>>) -> TickMessage {
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
        stops: tick.given.stops,
        plant: (tick.given.plant).map_or_else(Vec::new, |answer| again::plant_bytes(&answer)),
        plant_anew: tick.given.plant.is_some_and(|answer| answer.anew),
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
