//! What the master's end accepts, acknowledges and sends, datagram by datagram.

mod silence;

use super::*;
use crate::limiter::{ForceLimiter, Limits};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Twist};
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::{TOOL_FORCE_MAX_N, Tool};
use mmt_shared::model::update::Cause;
use mmt_shared::pairing::Token;
use mmt_shared::time::TICK;
use mmt_shared::wire::{DATAGRAM_MAX, Label, Welcome};

const AT: fn(u64) -> Time = Time::from_millis;

fn state(mass_kg: f64, coupling: &Coupling) -> ModelState {
    let params = ModelParams::of_square(mass_kg, 3.0, 2.06, 0.4, coupling).unwrap();
    let footprint = BoxFootprint::square(0.4);
    ModelState::try_new(
        params,
        footprint,
        Pose::default(),
        Twist::default(),
        coupling,
    )
    .unwrap()
}

fn end(config: CommandConfig, architecture: Architecture) -> MasterEnd {
    let coupling = Coupling::for_stiffness(1000.0);
    let welcome = Welcome {
        settings: Mode::Recommended.model_settings(coupling),
        state: state(0.7, &coupling),
        tool: Vec2::new(-0.45, 0.0),
        tool_force_max_n: TOOL_FORCE_MAX_N,
        resume: Token::new([0; 32]),
        scheme: Label::clipped("timer 150ms"),
        program: Label::clipped("test"),
    };
    let limiter = ForceLimiter::try_new(Limits::default()).unwrap();
    let master = Master::with_architecture(&welcome, limiter, architecture);
    MasterEnd::new(Time::ZERO, master, config.for_architecture(architecture))
}

fn update(sequence: u32, mass_kg: f64) -> Update {
    let soft = Coupling {
        stiffness_n_per_m: 50.0,
        damping_ns_per_m: 0.0,
    };
    Update {
        sequence,
        cause: Cause::Timer,
        answers: AT(1),
        touched_face: Some(Face::West),
        state: state(mass_kg, &soft),
    }
}

/// What a slave's channel sends of `what` at `now`.
fn datagram(slave: &mut DatagramChannel, now: Time, what: Message) -> Vec<u8> {
    let mut out = [0; DATAGRAM_MAX];
    let length = slave.encode(now, what, &mut out).unwrap().unwrap();
    out[..length].to_vec()
}

/// Ticks once and returns what the end sends, as the slave reads it.
fn tick(end: &mut MasterEnd, slave: &mut DatagramChannel, ms: u64) -> Vec<Message> {
    end.tick(AT(ms), &MasterGiven::held_at(Vec2::new(-0.3, 0.0)));
    let mut out = [0; DATAGRAM_MAX];
    let mut all = Vec::new();
    while let Some(length) = end.poll_transmit(AT(ms), &mut out).unwrap() {
        all.push(slave.handle(AT(ms), &out[..length]).unwrap().message);
    }
    all
}

/// The acknowledgement in the next command.
fn acknowledged(end: &mut MasterEnd, slave: &mut DatagramChannel, from_ms: u64) -> u32 {
    (from_ms..from_ms + 10)
        .flat_map(|ms| tick(end, slave, ms))
        .find_map(|matter| match matter {
            Message::Command(command) => Some(command.newest_update),
            _ => None,
        })
        .unwrap()
}

#[test]
fn an_update_is_accepted_before_it_is_acknowledged() {
    let mut end = end(CommandConfig::default(), Architecture::Mmt);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    // stable under a soft coupling, not under the master's
    let light = datagram(
        &mut slave,
        AT(1),
        Message::Update((&update(1, 0.05)).into()),
    );
    end.handle_datagram(AT(1), &light);
    assert_eq!(acknowledged(&mut end, &mut slave, 2), 0);
    let drops = end.update_drops();
    assert_eq!((drops.rejected, drops.duplicate), (1, 0));
    assert_eq!(end.master().applied().iter().sum::<u64>(), 0);
    // the same number with numbers that are accepted is no duplicate
    let good = datagram(
        &mut slave,
        AT(20),
        Message::Update((&update(1, 0.7)).into()),
    );
    end.handle_datagram(AT(20), &good);
    assert_eq!(acknowledged(&mut end, &mut slave, 21), 1);
    assert_eq!(
        (
            end.master().applied().iter().sum::<u64>(),
            end.counts().newest_applied
        ),
        (1, 1)
    );
}

#[test]
fn an_update_that_answers_a_sample_of_long_ago_is_neither_applied_nor_acknowledged() {
    let mut end = end(CommandConfig::default(), Architecture::Mmt);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    let send = |end: &mut MasterEnd, slave: &mut DatagramChannel, update: &Update, at: u64| {
        let bytes = datagram(slave, AT(at), Message::Update(update.into()));
        end.handle_datagram(AT(at), &bytes);
    };
    for ms in 1..2000 {
        tick(&mut end, &mut slave, ms);
        if ms % 50 == 0 {
            let bytes = datagram(&mut slave, AT(ms), Message::Heartbeat);
            end.handle_datagram(AT(ms), &bytes);
        }
    }
    let answering = |sequence, ms| Update {
        answers: AT(ms),
        ..update(sequence, 0.7)
    };
    // the path takes no time here
    send(&mut end, &mut slave, &answering(1, 1999 - 751), 1999);
    assert_eq!(acknowledged(&mut end, &mut slave, 2000), 0);
    let drops = end.update_drops();
    assert_eq!((drops.answer_too_old, drops.link_stale), (1, 0));
    send(&mut end, &mut slave, &answering(1, 2009 - 740), 2009);
    assert_eq!(acknowledged(&mut end, &mut slave, 2010), 1);
    assert_eq!(end.counts().newest_applied, 1);
}

#[test]
fn each_cause_for_which_an_update_is_not_applied_has_a_name_of_its_own() {
    let mut end = end(CommandConfig::default(), Architecture::Mmt);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    for ms in 1..=100 {
        tick(&mut end, &mut slave, ms);
    }
    let send = |end: &mut MasterEnd, slave: &mut DatagramChannel, sequence, ms| {
        let answering = Update {
            answers: AT(ms - 1),
            ..update(sequence, 0.7)
        };
        let bytes = datagram(slave, AT(ms), Message::Update((&answering).into()));
        end.handle_datagram(AT(ms), &bytes);
    };
    send(&mut end, &mut slave, 1, 100);
    assert_eq!(end.update_drops().unapplied, 1, "no tick has come since");
    // nothing reaches the slave any more
    let mut newest = Vec::new();
    let mut lost = |end: &mut MasterEnd, from_ms: u64, to_ms: u64| {
        for ms in from_ms..=to_ms {
            let mut out = [0; DATAGRAM_MAX];
            end.tick(AT(ms), &MasterGiven::held_at(Vec2::new(-0.3, 0.0)));
            while let Some(length) = end.poll_transmit(AT(ms), &mut out).unwrap() {
                newest = out[..length].to_vec();
            }
        }
        newest.clone()
    };
    lost(&mut end, 101, 400);
    send(&mut end, &mut slave, 2, 400);
    let answered = lost(&mut end, 401, 1200);
    slave.handle(AT(1200), &answered).unwrap();
    send(&mut end, &mut slave, 2, 1200);
    tick(&mut end, &mut slave, 1201);
    let drops = end.update_drops();
    let none = UpdateDrops::default();
    let expected = UpdateDrops {
        link_stale: 1,
        hand_released: 1,
        ..none
    };
    assert_eq!(drops, expected);
    assert_eq!(end.master().applied().iter().sum::<u64>(), 1);
    assert_eq!(end.channel().counts().received.updates, 3);
}

#[test]
fn of_the_updates_between_two_ticks_the_newest_is_applied_and_the_others_are_counted() {
    let mut end = end(CommandConfig::default(), Architecture::Mmt);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    let all =
        [1, 2, 3].map(|n| datagram(&mut slave, AT(1), Message::Update((&update(n, 0.7)).into())));
    for n in [0, 2, 1, 2] {
        end.handle_datagram(AT(1), &all[n]);
    }
    tick(&mut end, &mut slave, 2);
    let drops = end.update_drops();
    assert_eq!(
        (
            end.counts().newest_applied,
            end.master().applied().iter().sum::<u64>()
        ),
        (3, 1)
    );
    assert_eq!((drops.superseded, drops.stale, drops.duplicate), (1, 1, 0));
    assert_eq!(end.channel().counts().datagrams_duplicate, 1);
}

#[test]
fn scenes_and_the_tools_state_count_only_if_newer_than_all_before() {
    let scene = |x: f64| Scene {
        answers: Time::ZERO,
        object: Pose::default(),
        tool: Vec2::new(x, 0.0),
        force: Vec2::zeros(),
    };
    let tool = |in_contact| Tool {
        answers: Time::ZERO,
        force: ForceCounts::default(),
        in_contact,
        in_j: 0.0,
    };
    let mut end = end(CommandConfig::default(), Architecture::Tdpa);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    let (old, new) = (scene(0.1), scene(0.2));
    let all = [
        datagram(&mut slave, AT(1), Message::Scene(old)),
        datagram(&mut slave, AT(1), Message::Tool(tool(true))),
        datagram(&mut slave, AT(1), Message::Scene(new)),
        datagram(&mut slave, AT(1), Message::Tool(tool(false))),
    ];
    for n in [2, 0, 3, 1] {
        end.handle_datagram(AT(2), &all[n]);
    }
    assert_eq!(end.scene(), Some(&new));
    assert!(!end.update_model().in_contact);
    let half = end.half(1.0);
    assert_eq!(half.session.drops["messages_overtaken"], 2);
}

#[test]
fn with_tdpa_each_tick_sends_its_sample_with_the_hands_port() {
    let mut end = end(CommandConfig::default(), Architecture::Tdpa);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    for ms in 1..=20 {
        let sent = tick(&mut end, &mut slave, ms);
        let [Message::Command(command)] = &sent[..] else {
            panic!("{sent:?}");
        };
        assert!(command.port.is_some() && command.samples.len() == 1);
    }
}

#[test]
fn a_heartbeat_goes_out_when_nothing_else_did() {
    let config = CommandConfig {
        samples_per_command: 32,
        ..CommandConfig::default()
    };
    let mut end = end(config, Architecture::Mmt);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    assert_eq!(end.poll_timeout(), AT(50));
    // the stamps stand: no command is ever full
    let mut sent = Vec::new();
    for ms in 1..=120 {
        let mut out = [0; DATAGRAM_MAX];
        let now = Time::ZERO + TICK * ms;
        end.tick(AT(1), &MasterGiven::held_at(Vec2::zeros()));
        while let Some(length) = end.poll_transmit(now, &mut out).unwrap() {
            sent.push((ms, slave.handle(now, &out[..length]).unwrap().message));
        }
    }
    assert_eq!(sent, [(50, Message::Heartbeat), (100, Message::Heartbeat)]);
    let unsent = end.commands.drops().map(|(_, samples)| samples);
    assert_eq!(unsent, [119, 0, 1]);
}

/// As the stamp of a broken record may be.
#[test]
fn at_the_end_of_time_what_is_to_be_sent_has_an_end() {
    let mut end = end(CommandConfig::default(), Architecture::Mmt);
    let mut out = [0; DATAGRAM_MAX];
    let sent = std::iter::from_fn(|| end.poll_transmit(Time::MAX, &mut out).unwrap());
    assert!(sent.take(10).count() < 10);
}
