//! Packets of both plugs: whoever is plugged in, or is not, cannot do more than its readings may.

use std::net::SocketAddr;
use std::time::Duration;

use mmt_client::device::link::{DeviceLink, DeviceLinkConfig, HandOutput};
use mmt_client::operator::pointer::HandEvent;
use mmt_server::plant::PlantAnswer;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::{DEVICE_BYTES, PLANT_BYTES, PlugKind, PlugToken, decode, singles};
use mmt_shared::time::Time;

use super::outcome::Outcome;

/// The token that the seeds show.
pub(super) const TOKEN: PlugToken = PlugToken::new([7; 16]);

/// After the button is up the force of the ramp goes out for so long.
const RAMP_OUT: Duration = Duration::from_millis(210);

/// What a hand did so far, and whether it may do what comes.
#[derive(Default)]
pub(super) struct Held {
    now: Time,
    held: bool,
    released: Option<Time>,
}

impl Held {
    /// What comes, comes now.
    pub(super) fn at(&mut self, now: Time) {
        self.now = now;
    }

    /// Whether a force may act: on a hand that holds, or whose ramp goes out.
    pub(super) fn may_feel(&self) -> bool {
        self.held
            || self
                .released
                .is_some_and(|then| self.now.saturating_since(then) < RAMP_OUT)
    }

    pub(super) fn is_held(&self) -> bool {
        self.held
    }

    /// Moves and releases are those of a hand that holds; what is given is finite.
    pub(super) fn judge(&mut self, event: HandEvent) {
        match event {
            HandEvent::Press(sample) => {
                assert!(!self.held, "pressed twice");
                assert!(
                    sample.at.x.is_finite() && sample.at.y.is_finite() && sample.page_s.is_finite()
                );
                self.held = true;
            }
            HandEvent::Move(sample) => {
                assert!(self.held, "moved without a press");
                assert!(
                    sample.at.x.is_finite() && sample.at.y.is_finite() && sample.page_s.is_finite()
                );
            }
            HandEvent::Release => {
                assert!(self.held, "released without a press");
                (self.held, self.released) = (false, Some(self.now));
            }
            HandEvent::Clock(page_s) => assert!(page_s.is_finite()),
            HandEvent::NewPage => assert!(!self.held, "another page while held"),
            HandEvent::Drive(_) | HandEvent::Pause(_) | HandEvent::Finish => {
                panic!("a device does not do this")
            }
        }
    }
}

/// What a tick gives a device: 5 N.
pub(super) fn output(tick: u64) -> HandOutput {
    HandOutput {
        tick,
        force: Vec2::new(3.0, -4.0),
        hip: Vec2::new(0.1, 0.2),
        engaged: true,
        ..HandOutput::default()
    }
}

/// Records of 66 bytes: the ms since the one before, the sender, and a packet; the last packet may be shorter or longer.
pub(super) fn device(input: &[u8]) -> Outcome {
    let mut link = DeviceLink::try_new(DeviceLinkConfig::default(), TOKEN).unwrap();
    let (mut now, mut held, mut packets) = (Time::from_millis(1), Held::default(), 0);
    let mut rest = input;
    while let [wait, from, tail @ ..] = rest {
        let length = if tail.len() < 2 * DEVICE_BYTES {
            tail.len()
        } else {
            DEVICE_BYTES
        };
        let (packet, behind) = tail.split_at(length);
        rest = behind;
        now += Duration::from_millis(u64::from(*wait));
        packets += 1;
        held.at(now);
        let from = SocketAddr::from(([127, 0, 0, 1], 1000 + u16::from(from % 2)));
        let read = decode(PlugKind::Reading, DEVICE_BYTES, &TOKEN, packet).is_ok();
        let answers = link.handle(now, from, packet, |event| held.judge(event));
        assert!(read || !answers, "an answer to what is no packet");
        let counts = link.counts();
        let judged =
            counts.taken + counts.late + counts.malformed + counts.stranger + counts.second;
        assert_eq!(judged, packets, "{counts:?}");
        assert!(counts.nonsense <= counts.taken);
        if answers {
            let answer = link.answer(now, &output(packets));
            let (head, numbers) = decode(PlugKind::Force, DEVICE_BYTES, &TOKEN, &answer).unwrap();
            let [x, y, z, ..] = singles::<6>(numbers);
            let force = (x * x + y * y + z * z).sqrt();
            assert!(force <= 5.001, "{force} N of 5 N");
            assert!(
                held.may_feel() || force == 0.0,
                "{force} N on a hand that does not hold"
            );
            assert!(
                head.flags & 2 == 0 || held.may_feel(),
                "engaged is whoever holds"
            );
            assert!(
                head.flags & 32 == 0 || force == 0.0,
                "{force} N after a reading that was refused"
            );
            assert!(!held.held || force > 4.9, "no force on a hand that holds");
        }
    }
    let counts = link.counts();
    if counts.taken > counts.nonsense {
        return Outcome::taken(
            u64::from(held.held) + 2 * counts.late.min(2) + 8 * counts.second.min(1),
        );
    }
    Outcome::refused(&match (counts.nonsense, counts.malformed) {
        (1.., _) => "nonsense",
        (0, 1..) => "malformed",
        _ => "a stranger",
    })
}

pub(super) fn plant(input: &[u8]) -> Outcome {
    match PlantAnswer::read(&TOKEN, input) {
        Err(why) => Outcome::refused(&format_args!("{why:?}")),
        Ok((_, None)) => Outcome::refused(&"nonsense"),
        Ok((head, Some(answer))) => {
            assert_eq!(input.len(), PLANT_BYTES);
            let within = |of: Vec2, most: f64| of.x.abs() <= most && of.y.abs() <= most;
            assert!(
                within(answer.tool, 5.0)
                    && within(answer.velocity, 20.0)
                    && within(answer.force, 1000.0)
            );
            assert!((0.0..=10.0).contains(&answer.image_age_s));
            if let Some(object) = answer.object {
                assert!(within(object.position, 5.0) && object.angle.abs() <= 1e6);
            }
            let packet = answer.packet(&TOKEN, &head);
            let (again_head, again) = PlantAnswer::read(&TOKEN, &packet).unwrap();
            assert_eq!(again, Some(answer));
            assert_eq!(
                (again_head.sequence, again_head.stamp_ns),
                (head.sequence, head.stamp_ns)
            );
            Outcome::taken(u64::from(answer.object.is_some()))
        }
    }
}
