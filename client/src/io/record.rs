//! What a record has of the master: from the entries of its loop to messages.

use mmt_shared::io::clock::Clock;
use mmt_shared::io::record::{RecordSink, RecordWriter, Recorder, TickAbout, Ticked, Topics, Wall};
use mmt_shared::model::geometry::{Pose, Twist};
use mmt_shared::record::messages::{Link, MasterTick as TickMessage, Parameters, Stamp};
use mmt_shared::record::ros::{self, Marker};
use mmt_shared::wire::Side;
use serde::Serialize;

use super::MasterLive;
use super::haptic::MasterGiven;
use crate::again::MasterSetting;
use crate::master::MasterTick;

/// Standard messages of every so many ticks: 100 a second.
const STANDARD_TICKS: u64 = 10;

/// What a loop shows its record of the session, besides its ticks.
#[derive(Clone, Copy, Debug)]
pub struct MasterShown {
    /// The snapshot for screens.
    pub live: MasterLive,
    /// Velocity of the local model.
    pub twist: Twist,
}

/// Where a haptic loop leaves its record.
pub type MasterSink = RecordSink<MasterGiven, MasterTick, MasterShown>;

/// Begins the record of a session whose end is made of `setting`.
pub fn begin(
    recorder: &Recorder,
    clock: Clock,
    setting: &MasterSetting,
    configuration: &impl Serialize,
) -> MasterSink {
    recorder.begin(
        Wall::now(clock),
        setting.session(configuration),
        MasterTopics::default(),
    )
}

/// The master's topics.
#[derive(Debug, Default)]
struct MasterTopics {
    ticks: u64,
}

impl Topics for MasterTopics {
    const SIDE: Side = Side::Master;
    type Given = MasterGiven;
    type Done = MasterTick;
    type Shown = MasterShown;

    fn ticked(
        &mut self,
        about: &TickAbout,
        tick: &Ticked<MasterGiven, MasterTick>,
        out: &mut RecordWriter,
    ) {
        let message = message(about, tick);
        out.put("/master/ticks", about.stamp, &message);
        if self.ticks.is_multiple_of(STANDARD_TICKS) {
            let (stamp, done) = (about.stamp, &tick.done);
            let hip = done.sample.hip.metres();
            let hip = Pose::new(hip.x, hip.y, 0.0);
            out.put_standard("/master/hip", stamp, ros::POSE, |cdr| {
                ros::pose(cdr, stamp, &hip);
            });
            for (topic, force) in [
                ("/master/force", done.felt),
                ("/master/hand_force", done.hand_force),
            ] {
                out.put_standard(topic, stamp, ros::WRENCH, |cdr| {
                    ros::force(cdr, stamp, force);
                });
            }
        }
        self.ticks += 1;
    }

    fn shown(&mut self, stamp: Stamp, session: u32, shown: &MasterShown, out: &mut RecordWriter) {
        let live = &shown.live;
        let hip = Pose::new(live.hip.x, live.hip.y, 0.0);
        let frames = [("master/hip", hip), ("master/model", live.model)];
        out.put_standard("/tf", stamp, ros::FRAMES, |cdr| {
            ros::frames(cdr, stamp, &frames);
        });
        out.put_standard("/master/model_twist", stamp, ros::TWIST, |cdr| {
            ros::twist(cdr, stamp, &shown.twist);
        });
        out.put_standard("/master/markers", stamp, ros::MARKERS, |cdr| {
            ros::markers(cdr, stamp, &markers(live, hip));
        });
        let [m, b, c] = live.params;
        let parameters = Parameters {
            stamp,
            session,
            m_kg: m,
            b_ns_per_m: b,
            c_n: c,
            covariance: [f64::NAN; 9],
        };
        out.put("/master/parameters", stamp, &parameters);
        let link = Link {
            stamp,
            session,
            rtt_ms: live.rtt_ms.unwrap_or(f64::NAN),
            up_expected: live.up.expected,
            up_received: live.up.received,
            down_expected: live.down.expected,
            down_received: live.down.received,
        };
        out.put("/master/link", stamp, &link);
    }
}

fn message(about: &TickAbout, tick: &Ticked<MasterGiven, MasterTick>) -> TickMessage {
    let (given, done) = (&tick.given, &tick.done);
    let hip = done.sample.hip.metres();
    TickMessage {
        stamp: about.stamp,
        session: about.session,
        index: about.index,
        deadline_ns: tick.tick.deadline.as_nanos(),
        lateness_ns: about.lateness_ns,
        skipped: tick.tick.skipped,
        reading_x_m: given.reading.x,
        reading_y_m: given.reading.y,
        engaged: given.engaged,
        releases: given.releases,
        sent_ns: tick.sent.as_nanos(),
        hip_x_m: hip.x,
        hip_y_m: hip.y,
        f_m_x_n: done.felt.x,
        f_m_y_n: done.felt.y,
        hand_x_n: done.hand_force.x,
        hand_y_n: done.hand_force.y,
        in_contact: done.rendered.in_contact(),
        link: done.link.name().to_owned(),
        digest: about.digest,
    }
}

/// The model in blue, the HIP at it, and what is felt.
fn markers(live: &MasterLive, hip: Pose) -> Vec<Marker> {
    let blue = |opacity| [0.0, 0.45, 0.70, opacity];
    let body = live.footprint.as_ref();
    body.map(|faces| Marker::body("model", live.model, faces, blue(0.5)))
        .into_iter()
        .chain([
            Marker::point("hip", hip),
            Marker::force("f_m", hip, live.f_m, blue(1.0)),
        ])
        .collect()
}
