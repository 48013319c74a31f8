//! What a record has of the master: from the entries of its loop to messages.

use mmt_shared::io::clock::Clock;
use mmt_shared::io::record::{
    HandReading, RecordSink, RecordWriter, Recorder, Shown, TickAbout, Ticked, Topics, Wall,
};
use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::record::messages::{MasterTick as TickMessage, Stamp};
use mmt_shared::record::ros::Standard;
use mmt_shared::time::Time;
use mmt_shared::wire::Side;
use serde::Serialize;

use super::MasterLive;
use crate::again::MasterSetting;
use crate::end::MasterGiven;
use crate::master::MasterTick;
use crate::operator::pointer::HandEvent;

/// Where a haptic loop leaves its record.
pub type MasterSink = RecordSink<MasterGiven, MasterTick>;

/// Begins the record of a session whose end is made of `setting`.
pub fn begin(
    recorder: &Recorder,
    clock: Clock,
    setting: &MasterSetting,
    configuration: &impl Serialize,
) -> MasterSink {
    recorder.begin::<MasterTopics>(Wall::now(clock), setting.session(configuration))
}

/// What a record has of the snapshot for screens, and of the velocity of the local model.
pub(super) fn shown(live: &MasterLive, twist: Twist) -> Shown {
    Shown {
        point: live.hip,
        force: live.f_m,
        body: live.model,
        footprint: live.footprint,
        twist,
        params: live.params,
        // it is not sent to the master
        covariance: [f64::NAN; 9],
        rtt_ms: live.rtt_ms,
        up: live.up,
        down: live.down,
    }
}

/// What a record has of what a person does: each reading, and when the hand lets go; none of what steers the run.
pub(super) fn reading(at: Time, event: &HandEvent) -> Option<HandReading> {
    let (own_s, point, held) = match event {
        HandEvent::Press(sample) | HandEvent::Move(sample) => (sample.page_s, sample.at, true),
        HandEvent::Release => (f64::NAN, Vec2::repeat(f64::NAN), false),
        _ => return None,
    };
    Some(HandReading {
        at,
        own_s,
        point,
        held,
    })
}

/// The master's topics.
struct MasterTopics;

impl Topics for MasterTopics {
    const SIDE: Side = Side::Master;
    type Given = MasterGiven;
    type Done = MasterTick;

    fn ticked(about: &TickAbout, tick: &Ticked<MasterGiven, MasterTick>, out: &mut RecordWriter) {
        out.put("/master/ticks", about.stamp, &message(about, tick));
    }

    fn standard(stamp: Stamp, done: &MasterTick, out: &mut RecordWriter) {
        let hip = done.sample.hip.metres();
        let hip = Standard::Pose(Pose::new(hip.x, hip.y, 0.0));
        out.put_standard("/master/hip", stamp, hip);
        out.put_standard("/master/force", stamp, Standard::Force(done.displayed));
        out.put_standard(
            "/master/hand_force",
            stamp,
            Standard::Force(done.hand_force),
        );
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
        stops: given.stops,
        sent_ns: tick.sent.as_nanos(),
        hip_x_m: hip.x,
        hip_y_m: hip.y,
        f_m_x_n: done.displayed.x,
        f_m_y_n: done.displayed.y,
        hand_x_n: done.hand_force.x,
        hand_y_n: done.hand_force.y,
        in_contact: done.rendered.in_contact(),
        link: done.link.name().to_owned(),
        digest: about.digest,
    }
}
