//! What a page sends: JSON, one message a frame of its socket.

use mmt_shared::model::geometry::Vec2;
use serde::Deserialize;

use crate::operator::pointer::{Driver, HandEvent, PointerSample};

/// A message of a page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FromPage {
    /// What its clock shows, ms.
    Clock(f64),
    /// The pointer is pressed: stamp (ms), x and y (m, world).
    Press([f64; 3]),
    /// Where the pressed pointer has been since, oldest first.
    Move(Vec<[f64; 3]>),
    /// The pointer is let go.
    Release,
    /// Who moves the HIP.
    Drive(Driver),
    /// Whether the hand rests.
    Pause(bool),
    /// It asks to operate, if nobody does.
    Take,
    /// It leaves the hand to others.
    Leave,
    /// The master's emergency stop: anybody may.
    Stop,
    /// The master's emergency stop is cleared.
    Clear,
    /// The session ends.
    End,
    /// New networks from now on.
    Network(NetworkWish),
    /// A new session.
    Restart(SessionWish),
    /// The next step of a blind comparison.
    Study(StudyWish),
}

/// A step of a participant in a blind comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StudyWish {
    /// Somebody new agrees to take part.
    Agree,
    /// Whoever was interrupted goes on.
    Resume,
    /// The next part begins.
    Begin,
    /// The answer to a part, 1 to 7.
    Answer(u8),
    /// The next participant.
    Next,
}

/// Both directions in the words of an emulated link.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkWish {
    /// From master to slave; as it is if absent.
    pub up: Option<String>,
    /// From slave to master; as it is if absent.
    pub down: Option<String>,
}

/// What a new session is to be; what is absent stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SessionWish {
    /// `paper` or `recommended`.
    pub mode: Option<String>,
    /// `mmt` or `tdpa`.
    pub architecture: Option<String>,
    /// The update scheme in its words.
    pub scheme: Option<String>,
    /// The object's mass, kg.
    pub mass_kg: Option<f64>,
    /// The ground's friction coefficient.
    pub friction: Option<f64>,
}

/// What whoever runs the session has to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// End the session.
    End,
    /// Change the networks.
    Network(NetworkWish),
    /// Begin a new session.
    Restart(SessionWish),
    /// Go on with a blind comparison.
    Study(StudyWish),
}

fn sample([stamp_ms, x, y]: [f64; 3]) -> PointerSample {
    PointerSample {
        page_s: stamp_ms * 1e-3,
        at: Vec2::new(x, y),
    }
}

impl FromPage {
    /// Reads a frame of a page's socket.
    ///
    /// # Errors
    /// It is nothing that a page of this version sends.
    pub fn read(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }

    /// What it is to the hand, in order.
    pub fn hand_events(&self) -> impl Iterator<Item = HandEvent> {
        let (one, more) = match self {
            Self::Clock(page_ms) => (Some(HandEvent::Clock(page_ms * 1e-3)), &[][..]),
            Self::Press(pressed) => (Some(HandEvent::Press(sample(*pressed))), &[][..]),
            Self::Move(samples) => (None, samples.as_slice()),
            Self::Release | Self::Leave => (Some(HandEvent::Release), &[][..]),
            Self::Drive(driver) => (Some(HandEvent::Drive(*driver)), &[][..]),
            Self::Pause(paused) => (Some(HandEvent::Pause(*paused)), &[][..]),
            Self::Stop
            | Self::Clear
            | Self::End
            | Self::Take
            | Self::Network(_)
            | Self::Restart(_)
            | Self::Study(_) => (None, &[][..]),
        };
        let moves = more.iter().map(|moved| HandEvent::Move(sample(*moved)));
        one.into_iter().chain(moves)
    }

    /// What it is to whoever runs the session.
    pub fn order(self) -> Option<Order> {
        match self {
            Self::End => Some(Order::End),
            Self::Network(wish) => Some(Order::Network(wish)),
            Self::Restart(wish) => Some(Order::Restart(wish)),
            Self::Study(wish) => Some(Order::Study(wish)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<FromPage> {
        FromPage::read(text).ok()
    }

    #[test]
    fn the_pages_words_are_read_and_others_are_not() {
        let press = read(r#"{"press":[1500.5,0.1,-0.2]}"#).unwrap();
        let events: Vec<_> = press.hand_events().collect();
        let at = Vec2::new(0.1, -0.2);
        let sample = PointerSample { page_s: 1.5005, at };
        assert_eq!(events, [HandEvent::Press(sample)]);
        let moves = read(r#"{"move":[[1,0,0],[2,0,0]]}"#).unwrap();
        assert_eq!(moves.hand_events().count(), 2);
        assert_eq!(read(r#""release""#), Some(FromPage::Release));
        assert_eq!(
            read(r#"{"drive":"scripted"}"#),
            Some(FromPage::Drive(Driver::Scripted))
        );
        let order = read(r#"{"network":{"up":"delay 5ms"}}"#).unwrap().order();
        let up = Some("delay 5ms".to_owned());
        assert_eq!(order, Some(Order::Network(NetworkWish { up, down: None })));
        let answer = read(r#"{"study":{"answer":7}}"#).unwrap().order();
        assert_eq!(answer, Some(Order::Study(StudyWish::Answer(7))));
        assert_eq!(
            read(r#"{"study":"agree"}"#),
            Some(FromPage::Study(StudyWish::Agree))
        );
        for bad in [
            "",
            "{}",
            r#"{"press":[1,2]}"#,
            r#"{"restart":{"mas":1}}"#,
            r#"{"force":[1,2,3]}"#,
        ] {
            assert_eq!(read(bad), None, "{bad}");
        }
    }

    #[test]
    fn an_end_is_an_order_and_a_stop_is_not() {
        assert_eq!(FromPage::End.order(), Some(Order::End));
        assert_eq!(FromPage::Stop.order(), None);
    }
}
