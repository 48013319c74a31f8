//! The slave's loop under a flood, ticked by hand.

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::io::loop_thread::{self, ARRIVALS_PER_TICK};
use mmt_shared::io::schedule::Tick;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;
use mmt_shared::wire::{DATAGRAM_MAX, Hello, Label, Message, Role, Side};

use super::*;
use crate::end::SlaveEnd;
use crate::io::slave_loop::{SlaveLoop, Snapshot};

fn hello() -> Hello {
    Hello {
        token: Token::new([0; 32]),
        role: Role::Operator,
        claim: Claim::IfFree,
        coupling: Coupling::for_stiffness(1000.0),
        samples_per_command: 10,
        architecture: Architecture::Mmt,
        scene_hz: 0,
        hip: Vec2::new(-0.25, 0.02),
        program: Label::clipped("test"),
    }
}

#[tokio::test]
async fn a_flood_costs_each_tick_of_the_slave_its_share_and_delays_nobody_for_long() {
    let end = SlaveEnd::of_session(Time::ZERO, &SlaveConfig::default(), &hello(), None).unwrap();
    let mut slave = SlaveLoop::new(end, None, EmergencyStop::default());
    let (mut handle, mut side, _done) = loop_thread::pair::<_, ()>(&Snapshot::default()).unwrap();
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let now = Time::from_millis(1);
    for _ in 0..3 * ARRIVALS_PER_TICK {
        let mut out = [0; DATAGRAM_MAX];
        let length = master.encode(now, Message::Heartbeat, &mut out);
        handle.deliver(now, &out[..length.unwrap().unwrap()]);
    }
    for handled in 1..=3 {
        let tick = Tick {
            index: handled,
            deadline: Time::from_millis(handled + 1),
            skipped: 0,
            lateness: Duration::ZERO,
        };
        slave.tick(tick, &mut side, || tick.deadline);
        let received = slave.end.channel().counts().received;
        assert_eq!(received.heartbeats, handled * ARRIVALS_PER_TICK as u64);
    }
}
