//! What a page of the console sends: whatever it is, the HIP stays a place within reach, and the next page can work.

use std::time::Duration;

use mmt_client::io::console::FromPage;
use mmt_client::operator::pointer::{
    Driver, HandEvent, HandTuning, Person, PointerSample, REACH_M,
};
use mmt_client::operator::scripted::{Scripted, ScriptedConfig, View};
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};

use super::outcome::Outcome;

/// A box a metre away, which nobody touches.
fn view() -> View {
    View {
        pose: Pose::new(1.0, 0.0, 0.0),
        footprint: BoxFootprint::square(0.4),
        in_contact: false,
    }
}

/// Lines, each a message; four ticks come after each.
pub(super) fn page(input: &[u8]) -> Outcome {
    let scripted = Scripted::try_new(ScriptedConfig::default(), view()).unwrap();
    let mut person = Person::new(scripted, Driver::Pointer, HandTuning::POINTER);
    let (mut now, mut read, mut sorts) = (Duration::from_secs(1), 0_u64, 0);
    let mut reason = None;
    for line in input.split(|byte| *byte == b'\n') {
        match std::str::from_utf8(line).ok().map(FromPage::read) {
            Some(Ok(message)) => {
                read += 1;
                let name = format!("{message:?}");
                let name = name.split(['(', '{']).next().unwrap_or_default();
                sorts |= 1 << (super::outcome::mark(&name) % 60);
                for event in message.hand_events() {
                    person.handle(now, event);
                }
                // who ends the page's own session is not the hand's business
                drop(message.order());
            }
            Some(Err(why)) => reason = Some(why),
            None => {}
        }
        ticks(&mut person, &mut now, 4);
    }
    // another page finds a hand that works
    let here = person.hip();
    let sample = |ms: f64| PointerSample {
        page_s: 1.0 + ms * 1e-3,
        at: Vec2::new(ms * 1e-4, 0.0),
    };
    person.handle(now, HandEvent::Pause(false));
    person.handle(now, HandEvent::NewPage);
    person.handle(now, HandEvent::Press(sample(0.0)));
    for ms in 1..200 {
        person.handle(now, HandEvent::Move(sample(f64::from(ms))));
        ticks(&mut person, &mut now, 1);
    }
    let way = person.hip() - here;
    let to_the_edge = REACH_M - here.x;
    assert!(
        way.x > 0.005_f64.min(to_the_edge - 1e-6),
        "the hand is dead: {here:?} to {:?}",
        person.hip()
    );
    match reason {
        Some(why) if read == 0 => Outcome::refused(&why),
        _ if read == 0 => Outcome::refused(&"no text"),
        _ => Outcome::taken(sorts),
    }
}

fn ticks(person: &mut Person, now: &mut Duration, ticks: u32) {
    for _ in 0..ticks {
        *now += Duration::from_millis(1);
        let hip = person.step(*now, &view(), Vec2::zeros());
        // a hand that is driven by the script is a hand's breadth beyond at most
        assert!(
            hip.x.abs() <= REACH_M + 1.0 && hip.y.abs() <= REACH_M + 1.0,
            "{hip:?}"
        );
    }
}
