//! Each judge sees what is wrong, and nothing where nothing is.

use std::time::Duration;

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::failsafe::LinkState;
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::{Master, MasterTick};
use mmt_server::end::{SlaveEnd, SlaveGiven};
use mmt_server::slave::{SlaveConfig, SlaveTick};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::update::Cause;
use mmt_shared::pairing::Token;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{
    Claim, DATAGRAM_MAX, Datagram, Hello, Label, Message, Role, SampleBlock, Side,
};

use super::*;

mod trigger;

/// What is changed between the ends and their judges.
#[derive(Clone, Copy)]
enum Change {
    Nothing,
    Master(fn(&mut MasterTick)),
    Slave(fn(&mut SlaveTick)),
    Up(fn(&mut Datagram)),
    Down(fn(&mut Datagram)),
    /// Of those that arrive at the slave.
    Arrives(fn(&mut Datagram)),
    /// Of those that leave the slave this one is not shown.
    Hidden(fn(&Datagram) -> bool),
}

/// A hand that pushes the box for three seconds over a perfect network, and an emergency stop of the slave in the
/// last; what the judges say of it, where from 2.2 s on they are shown something else.
struct Shown {
    checks: SessionChecks,
    master: MasterEnd,
    slave: SlaveEnd,
    change: Change,
}

fn hello() -> Hello {
    Hello {
        token: Token::new([0; 32]),
        role: Role::Operator,
        claim: Claim::IfFree,
        coupling: DeviceProfile::default().coupling(),
        samples_per_command: 1,
        architecture: Architecture::Mmt,
        scene_hz: 0,
        hip: Vec2::new(-0.25, 0.0),
        program: Label::clipped("test"),
    }
}

impl Shown {
    fn new(change: Change) -> Self {
        Self::of(SlaveConfig::default(), change)
    }

    fn of(config: SlaveConfig, change: Change) -> Self {
        let (hello, began) = (hello(), Time::from_millis(10));
        let slave = SlaveEnd::of_session(began, &config, &hello, None).unwrap();
        let welcome = slave.slave().welcome(Token::new([0; 32]), "any", "test");
        let limits = DeviceProfile::default().limits();
        let limiter = ForceLimiter::try_new(limits).unwrap();
        let commands = CommandConfig {
            samples_per_command: 1,
            ..CommandConfig::default()
        };
        let config = mmt_server::end::session_config(&config, &hello);
        Self {
            checks: SessionChecks::new(
                (began, began),
                limits,
                welcome.settings,
                config,
                welcome.tool,
            ),
            master: MasterEnd::new(began, Master::new(&welcome, limiter), commands),
            slave,
            change,
        }
    }

    fn run(mut self) -> Verdict {
        let mut now = Time::from_millis(10);
        let (mut down, mut x) = (Vec::new(), -0.25);
        for tick in 0..3000 {
            now += TICK;
            let shown = tick >= 2200;
            x += 0.1e-3;
            let up = self.master(now, Vec2::new(x, 0.0), std::mem::take(&mut down), shown);
            down = self.slave(now, up, shown, tick > 2500);
        }
        self.checks.verdict()
    }

    fn master(&mut self, now: Time, hip: Vec2, down: Vec<Vec<u8>>, shown: bool) -> Vec<Vec<u8>> {
        for bytes in &down {
            self.master.handle_datagram(now, bytes);
            self.checks.came_down(now, bytes);
        }
        let given = MasterGiven::held_at(hip);
        let mut done = self.master.tick(now, &given);
        if let (Change::Master(change), true) = (self.change, shown) {
            change(&mut done);
        }
        self.checks.master_ticked(now, given, &done, &self.master);
        let mut up = Vec::new();
        let mut out = [0; DATAGRAM_MAX];
        while let Ok(Some(length)) = self.master.poll_transmit(now, &mut out) {
            let bytes = out[..length].to_vec();
            let change = if let Change::Up(change) = self.change {
                Some(change)
            } else {
                None
            };
            self.checks.up(
                now,
                &changed(&bytes, Side::Master, change.filter(|_| shown)),
            );
            up.push(bytes);
        }
        up
    }

    fn slave(&mut self, now: Time, up: Vec<Vec<u8>>, shown: bool, stops: bool) -> Vec<Vec<u8>> {
        for bytes in &up {
            self.slave.handle_datagram(now, bytes);
            let change = if let Change::Arrives(change) = self.change {
                Some(change)
            } else {
                None
            };
            self.checks
                .came_up(now, &changed(bytes, Side::Master, change.filter(|_| shown)));
        }
        let given = SlaveGiven { stops, plant: None };
        let mut done = self.slave.tick(now, &given);
        if let (Change::Slave(change), Some(done), true) = (self.change, &mut done, shown) {
            change(done);
        }
        self.checks
            .slave_ticked(now, given, done.as_ref(), &self.slave);
        let mut down = Vec::new();
        let mut out = [0; DATAGRAM_MAX];
        while let Ok(Some(length)) = self.slave.poll_transmit(now, &mut out) {
            let bytes = out[..length].to_vec();
            let datagram = Datagram::decode(&bytes, Side::Slave).unwrap();
            let hidden = matches!(self.change, Change::Hidden(hides) if shown && hides(&datagram));
            let change = if let Change::Down(change) = self.change {
                Some(change)
            } else {
                None
            };
            if !hidden {
                self.checks
                    .down(now, &changed(&bytes, Side::Slave, change.filter(|_| shown)));
            }
            down.push(bytes);
        }
        down
    }
}

fn changed(bytes: &[u8], from: Side, change: Option<fn(&mut Datagram)>) -> Vec<u8> {
    let mut datagram = Datagram::decode(bytes, from).unwrap();
    change.into_iter().for_each(|change| change(&mut datagram));
    let mut out = [0; DATAGRAM_MAX];
    let length = datagram.encode(&mut out).unwrap();
    out[..length].to_vec()
}

fn command(datagram: &mut Datagram, change: fn(&mut mmt_shared::wire::Command)) {
    if let Message::Command(command) = &mut datagram.message {
        change(command);
    }
}

/// A block with another force.
fn other(samples: &SampleBlock) -> SampleBlock {
    let mut sample = *samples.last().unwrap();
    sample.force.x += 1;
    let mut other = SampleBlock::default();
    other.push(sample).unwrap();
    other
}

#[test]
fn a_session_that_keeps_its_promises_is_found_to_and_each_lie_is_found_out() {
    use Invariant as I;
    let verdict = Shown::new(Change::Nothing).run();
    assert!(verdict.holds(), "{verdict}");
    for needed in [
        I::ForceCap,
        I::ForceStops,
        I::UpdateOrder,
        I::UpdateTrue,
        I::ToolStops,
        I::PlaysTrue,
        I::TriggerFires,
        I::CountersBalance,
    ] {
        let looked = verdict
            .judged()
            .any(|(of, judged)| of == needed && judged.checked > 0);
        assert!(looked, "{needed} was never looked at");
    }
    let lies: [(Invariant, Change); 19] = [
        (I::ForceCap, Change::Master(|done| done.hand_force *= 100.0)),
        (
            I::ForceCap,
            Change::Master(|done| done.hand_force.x = f64::NAN),
        ),
        (
            I::ForceStep,
            Change::Master(|done| done.hand_force *= -10.0),
        ),
        (
            I::ForceStops,
            Change::Master(|done| done.hand_force.y += 1.0),
        ),
        (
            I::ForceFalls,
            Change::Master(|done| {
                done.hand_force.y = (done.sample.stamp.as_nanos() / 1_000_000 % 2) as f64
            }),
        ),
        (
            I::LinkState,
            Change::Master(|done| done.link = LinkState::Late),
        ),
        (
            I::SamplesTrue,
            Change::Master(|done| done.sample.hip.x += 10),
        ),
        (
            I::SamplesTrue,
            Change::Up(|of| command(of, |command| command.samples = other(&command.samples))),
        ),
        (
            I::Acknowledged,
            Change::Up(|of| command(of, |command| command.newest_update += 1)),
        ),
        (I::Numbers, Change::Up(|of| of.envelope.number += 1)),
        (
            I::Numbers,
            Change::Down(|of| of.flags.stopped = !of.flags.stopped),
        ),
        (I::EchoTrue, Change::Down(|of| of.envelope.echo = None)),
        (I::Heartbeat, Change::Hidden(|_| true)),
        (
            I::ToolSpeed,
            Change::Slave(|done| {
                done.tool.y = (done.stamp.as_nanos() / 1_000_000 % 2) as f64 * 1e-3
            }),
        ),
        (
            I::ToolAcceleration,
            // 0.03 m/s to and fro in free space
            Change::Slave(|done| {
                (done.f_s, done.true_force) = (Vec2::zeros(), Vec2::zeros());
                done.tool.y += (done.stamp.as_nanos() / 1_000_000 % 2) as f64 * 3e-5
            }),
        ),
        (I::ToolReach, Change::Slave(|done| done.tool.x += 2.5)),
        (I::ToolForce, Change::Slave(|done| done.true_force *= 20.0)),
        (
            I::ToolStops,
            Change::Slave(|done| done.tool += Vec2::new(0.0, 1e-3) * done.stamp.as_secs_f64()),
        ),
        (
            I::PlaysTrue,
            Change::Slave(|done| done.f_m = done.f_m.map(|f_m| f_m * 1.01)),
        ),
    ];
    let more: [(Invariant, Change); 8] = [
        (
            I::PlaysInOrder,
            Change::Slave(|done| {
                done.stamp =
                    done.stamp - Duration::from_millis(done.stamp.as_nanos() / 1_000_000 % 2 * 5)
            }),
        ),
        (
            I::UpdateCause,
            Change::Slave(|done| {
                done.update = done.update.map(|update| mmt_shared::model::update::Update {
                    answers: Time::ZERO,
                    ..update
                })
            }),
        ),
        (I::UpdateTrue, Change::Slave(|done| done.update = None)),
        (I::CountersBalance, Change::Slave(|done| done.update = None)),
        (I::CountersBalance, Change::Hidden(|_| true)),
        (
            I::TriggerFires,
            Change::Slave(|done| {
                done.in_contact = false;
                if let Some(update) = &mut done.update {
                    update.cause = Cause::Timer;
                }
            }),
        ),
        (
            I::ShadowConfirmed,
            Change::Arrives(|of| command(of, |command| command.newest_update = 0)),
        ),
        (
            I::ArrivedWasSent,
            Change::Arrives(|of| of.envelope.sent += TICK),
        ),
    ];
    for (n, (invariant, change)) in lies.into_iter().chain(more).enumerate() {
        let verdict = Shown::new(change).run();
        let found = verdict.broken().any(|(of, _)| of == invariant);
        assert!(found, "lie {n} about {invariant} was believed: {verdict}");
    }
}

#[test]
fn a_verdict_names_where_an_invariant_was_broken_first_and_sums_up() {
    let mut verdict = Verdict::since(Time::from_millis(1000));
    for (ms, holds) in [(1500, true), (2500, false), (3500, false)] {
        let at = Time::from_millis(ms);
        verdict.judge(Invariant::ForceCap, at, holds, || format!("{ms}"));
    }
    let text = verdict.to_string();
    assert_eq!(text, "force-cap broken at 1.500 s: 2500");
    let mut sum = Verdict::default();
    sum.add(verdict.clone());
    sum.add(verdict);
    let (_, judged) = sum.judged().next().unwrap();
    assert_eq!((judged.checked, judged.broken), (6, 4));
    let names: std::collections::BTreeSet<_> = Invariant::ALL.iter().map(|of| of.name()).collect();
    assert_eq!(names.len(), Invariant::ALL.len());
}
