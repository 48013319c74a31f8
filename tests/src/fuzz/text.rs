//! Texts: what is parsed and printed parses to the same, and no secret is in an error.

use mmt_client::operator::trace::Trace;
use mmt_lab::replay::{ReplayConfig, replay};
use mmt_lab::sweep::Shard;
use mmt_server::repeats::Repeats;
use mmt_server::trigger::Scheme;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::io::identity::Identity;
use mmt_shared::pairing::{Address, Pairing, Pin, Token, Tokens};
use mmt_shared::plug::PlugToken;
use mmt_shared::recording::Recording;

use super::outcome::Outcome;

fn text(input: &[u8]) -> Result<&str, Outcome> {
    std::str::from_utf8(input).map_err(|_| Outcome::refused(&"no text"))
}

/// What is parsed and printed parses to the same.
fn twice<T: std::str::FromStr + ToString + PartialEq + std::fmt::Debug>(text: &str) -> bool {
    let Ok(read) = text.parse::<T>() else {
        return false;
    };
    let printed = read.to_string();
    assert_eq!(printed.parse::<T>().ok(), Some(read), "{printed}");
    true
}

pub(super) fn pairing(input: &[u8]) -> Outcome {
    let text = match text(input) {
        Ok(text) => text,
        Err(outcome) => return outcome,
    };
    let (address, pin) = (twice::<Address>(text), twice::<Pin>(text));
    if let Ok(token) = text.parse::<Token>() {
        assert_eq!(token.reveal().to_string(), text.to_ascii_lowercase());
        assert!(!format!("{token:?}").contains(text));
    }
    if let Ok(token) = text.parse::<PlugToken>() {
        assert_eq!(token.reveal().to_string(), text.to_ascii_lowercase());
    }
    match text.parse::<Pairing>() {
        Ok(pairing) => {
            assert_eq!(pairing.to_string().parse(), Ok(pairing.clone()));
            let token = pairing.token.reveal().to_string();
            // a pin is no secret, and may be the same
            let pin = pairing.pin.to_string();
            let shown = format!("{pairing:?}").replace(&pin, "");
            assert!(!shown.contains(&token), "a secret is shown");
            assert!(pairing.address.port > 0);
            Outcome::taken(4)
        }
        Err(_) if address || pin => Outcome::taken(u64::from(address) + 2 * u64::from(pin)),
        Err(why) => {
            let shown = format!("{why} {why:?}");
            // no eight characters of what may be a token
            let secret = text.split_once("token=").map_or("", |(_, secret)| secret);
            let digits: Vec<char> = secret.chars().take_while(char::is_ascii_hexdigit).collect();
            for part in digits.windows(8) {
                let part: String = part.iter().collect();
                // what was meant as an address is shown, its control characters as escapes
                let address = text.split('?').next().unwrap_or_default();
                let elsewhere = format!("{address}{address:?}").contains(&part);
                assert!(elsewhere || !shown.contains(&part), "{shown} shows {part}");
            }
            Outcome::refused(&why)
        }
    }
}

pub(super) fn words(input: &[u8]) -> Outcome {
    let text = match text(input) {
        Ok(text) => text,
        Err(outcome) => return outcome,
    };
    let scheme = text.parse::<Scheme>();
    if let Ok(scheme) = &scheme {
        // six digits are shown, and those stay
        let printed = scheme.to_string();
        let again: Scheme = printed
            .parse()
            .unwrap_or_else(|why| panic!("{why}: {printed}"));
        assert_eq!(again.to_string(), printed);
        for by in [0.5, 3.0, 8.0, f64::NAN] {
            assert!(scheme.stretched(by).to_string().starts_with(scheme.name()));
        }
    }
    twice::<Repeats>(text);
    if let Ok(repeats) = text.parse::<Repeats>() {
        let after = repeats.after();
        assert!(after.len() <= 4 && after.is_sorted_by(|a, b| a < b));
        let again = Vec::<f64>::from(repeats);
        assert_eq!(Repeats::try_from(again), Ok(repeats));
    }
    let others = [
        twice::<StretchMax>(text),
        twice::<Shard>(text),
        text.parse::<Repeats>().is_ok(),
    ];
    match scheme {
        Ok(scheme) => Outcome::taken(super::outcome::mark(&scheme.name())),
        Err(_) if others.contains(&true) => {
            Outcome::taken(u64::from(others[0]) + 2 * u64::from(others[1]))
        }
        Err(why) => Outcome::refused(&why),
    }
}

pub(super) fn pushes(input: &[u8]) -> Outcome {
    let text = match text(input) {
        Ok(text) => text,
        Err(outcome) => return outcome,
    };
    let recording = match Recording::parse(text) {
        Ok(recording) => recording,
        Err(why) => return Outcome::refused(&why),
    };
    for push in &recording.pushes {
        assert!(push.force.len() >= 2 && push.finger.len() >= 2);
        assert!(
            push.force.is_sorted_by(|a, b| a.t_s < b.t_s),
            "time stands: {:?}",
            push.force
        );
        assert!(
            push.finger.is_sorted_by(|a, b| a.t_s < b.t_s),
            "time stands: {:?}",
            push.finger
        );
        let forces = push.force.iter().map(|sample| (sample.t_s, sample.force));
        let finger = push
            .finger
            .iter()
            .map(|sample| (sample.t_s + sample.pose.angle, sample.pose.position));
        assert!(
            forces
                .chain(finger)
                .all(|(t_s, of)| t_s.is_finite() && of.x.is_finite() && of.y.is_finite())
        );
        let turn = (push.after.angle - push.before.angle).abs();
        assert!(turn <= std::f64::consts::PI + 1e-9 && push.duration_s() > 0.0);
    }
    judge_way(&Trace::from_recording(&recording, None).unwrap());
    // the replay of a recording is a report without a number that is none
    if text.len() < 700 {
        let config = ReplayConfig {
            repeats: 1,
            ..ReplayConfig::default()
        };
        let report = replay(&recording, &config, &mut |_, _| ());
        serde_json::to_string(&report).unwrap();
        assert!(report.duration_s.is_finite() && report.contact_s.is_finite());
    }
    Outcome::taken(recording.pushes.len().min(3) as u64)
}

/// A way over time that a hand could be led along.
fn judge_way(trace: &Trace) {
    let samples = trace.samples();
    assert!(
        samples.is_sorted_by(|(before, _), (after, _)| before < after),
        "time stands: {samples:?}"
    );
    for (t_s, _) in samples {
        let at = std::time::Duration::try_from_secs_f64(*t_s).unwrap();
        let point = trace.at(at);
        assert!(point.x.is_finite() && point.y.is_finite());
    }
    assert!(trace.duration() < std::time::Duration::from_secs(1 << 40));
}

pub(super) fn path(input: &[u8]) -> Outcome {
    let text = match text(input) {
        Ok(text) => text,
        Err(outcome) => return outcome,
    };
    let read = Trace::from_csv(text);
    if let Ok(trace) = &read {
        judge_way(trace);
        assert!(
            trace
                .samples()
                .iter()
                .all(|(_, point)| point.x.abs() <= 100.0 && point.y.abs() <= 100.0)
        );
    }
    Outcome::of(read)
}

pub(super) fn identity(input: &[u8]) -> Outcome {
    let text = match text(input) {
        Ok(text) => text,
        Err(outcome) => return outcome,
    };
    match Identity::parse(text) {
        Ok(identity) => {
            let tokens = identity.tokens();
            let (shown, lower) = (format!("{identity:?}"), text.to_ascii_lowercase());
            for token in tokens.iter() {
                let digits = token.token.reveal().to_string();
                assert!(lower.contains(&digits));
                assert!(!shown.contains(&digits));
            }
            let again = Tokens::read(&tokens.reveal());
            assert_eq!(again.map(|again| again.reveal()), Ok(tokens.reveal()));
            assert_eq!(identity.derive("fuzz"), identity.derive("fuzz"));
            Outcome::taken(1)
        }
        Err(why) => Outcome::refused(&why),
    }
}
