//! What the scripted operator does, in numbers, and the ranges in which a hand can follow them.

use serde::{Deserialize, Serialize};

use crate::operator::hand::HandConfig;
use crate::operator::route::CLOSE_M;

/// What the scripted operator looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Picture {
    /// The local model: where the box is felt.
    #[default]
    Model,
    /// The remote scene as it arrives, a round trip behind the hand. Only a world in virtual time can show
    /// it to a script; contact is felt at the model all the same.
    Delayed,
}

/// What the scripted operator does. The defaults are those of the design study unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScriptedConfig {
    /// Seed of everything that is drawn. Default 1.
    pub seed: u64,
    /// Largest lateral offset of a push from the face's middle, m; drawn uniformly. Default 0.05.
    pub lateral_max_m: f64,
    /// Speed on the way round the box, m/s. Default 0.35.
    pub travel_m_per_s: f64,
    /// Distance in front of the face at which the approach begins, m. Default 0.05.
    pub stand_off_m: f64,
    /// Speed of the approach, m/s. Default 0.06.
    pub approach_m_per_s: f64,
    /// Rest after a nudge, s: a careful operator nudges a face that it has not pushed yet and waits until the answer
    /// must have come; it nudges again if the box turns out not to have moved. Default 0, no nudges.
    pub dwell_s: f64,
    /// Length of a nudge, m, at the speed of the approach. Default 0.04: past a face that is 2 cm further away, and a push.
    pub nudge_m: f64,
    /// Length of a push from contact, m. Default 0.35.
    pub push_m: f64,
    /// Range of a push's mean speed, m/s; drawn uniformly. Default 0.10 to 0.22.
    pub push_speed_m_per_s: (f64, f64),
    /// Slow modulation of the speed, share of the mean. Default 0.30.
    pub slow_share: f64,
    /// Its range of frequency, Hz. Default 0.4 to 1.
    pub slow_hz: (f64, f64),
    /// Fast modulation of the speed, share of the mean. Default 0.12.
    pub fast_share: f64,
    /// Its range of frequency, Hz. Default 1.5 to 3.
    pub fast_hz: (f64, f64),
    /// Rest at the end of a push, s. Default 0.4.
    pub hold_s: f64,
    /// Distance to back off after a push, m. Default 0.12.
    pub retract_m: f64,
    /// Limit of the wish's acceleration, m/s². Default 1.5, an unhurried arm (a choice).
    pub acceleration_m_per_s2: f64,
    /// Force at which the operator presses no harder, N. Default 8, the default device's limit.
    pub press_max_n: f64,
    /// Beyond this distance from where it began the box is pushed back, m. Default 1 (a choice).
    pub home_radius_m: f64,
    /// What it looks at. Default the model.
    pub view: Picture,
    /// The hand.
    pub hand: HandConfig,
}

impl Default for ScriptedConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            lateral_max_m: 0.05,
            travel_m_per_s: 0.35,
            stand_off_m: 0.05,
            approach_m_per_s: 0.06,
            dwell_s: 0.0,
            nudge_m: 0.04,
            push_m: 0.35,
            push_speed_m_per_s: (0.10, 0.22),
            slow_share: 0.30,
            slow_hz: (0.4, 1.0),
            fast_share: 0.12,
            fast_hz: (1.5, 3.0),
            hold_s: 0.4,
            retract_m: 0.12,
            acceleration_m_per_s2: 1.5,
            press_max_n: 8.0,
            home_radius_m: 1.0,
            view: Picture::Model,
            hand: HandConfig::default(),
        }
    }
}

/// A number of the configuration that no hand could follow.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("operator.{name} = {value} is outside the accepted range {min} to {max}; change it")]
pub struct ScriptedError {
    /// Name of the key.
    pub name: &'static str,
    /// What it was.
    pub value: f64,
    /// Least accepted value.
    pub min: f64,
    /// Greatest accepted value.
    pub max: f64,
}

impl ScriptedConfig {
    /// Checks every number; a number that is not finite is outside every range.
    pub(super) fn checked(&self) -> Result<(), ScriptedError> {
        let hand = &self.hand;
        let (slowest, fastest) = self.push_speed_m_per_s;
        let speeds = (0.01, 0.4);
        for (name, value, (min, max)) in [
            ("lateral_max_m", self.lateral_max_m, (0.0, 0.15)),
            ("travel_m_per_s", self.travel_m_per_s, speeds),
            ("stand_off_m", self.stand_off_m, (CLOSE_M, 0.5)),
            ("approach_m_per_s", self.approach_m_per_s, (0.01, 0.1)),
            ("dwell_s", self.dwell_s, (0.0, 60.0)),
            ("nudge_m", self.nudge_m, (0.01, 0.2)),
            ("push_m", self.push_m, (0.01, 1.0)),
            ("push_speed_m_per_s.0", slowest, speeds),
            ("push_speed_m_per_s.1", fastest, (slowest, 0.3)),
            ("slow_share", self.slow_share, (0.0, 0.5)),
            ("slow_hz.0", self.slow_hz.0, (0.0, 5.0)),
            ("slow_hz.1", self.slow_hz.1, (self.slow_hz.0, 5.0)),
            ("fast_share", self.fast_share, (0.0, 0.4)),
            ("fast_hz.0", self.fast_hz.0, (0.0, 5.0)),
            ("fast_hz.1", self.fast_hz.1, (self.fast_hz.0, 5.0)),
            ("hold_s", self.hold_s, (0.0, 60.0)),
            ("retract_m", self.retract_m, (CLOSE_M + 0.02, 0.5)),
            (
                "acceleration_m_per_s2",
                self.acceleration_m_per_s2,
                (0.5, 3.0),
            ),
            ("press_max_n", self.press_max_n, (1.0, 20.0)),
            ("home_radius_m", self.home_radius_m, (0.5, 3.0)),
            ("hand.mass_kg", hand.mass_kg, (0.1, 5.0)),
            (
                "hand.stiffness_n_per_m",
                hand.stiffness_n_per_m,
                (50.0, 2000.0),
            ),
            ("hand.damping_ns_per_m", hand.damping_ns_per_m, (1.0, 100.0)),
            ("hand.tremor_hz", hand.tremor_hz, (0.0, 20.0)),
            ("hand.tremor_m", hand.tremor_m, (0.0, 5e-3)),
        ] {
            if !(min..=max).contains(&value) {
                return Err(ScriptedError {
                    name,
                    value,
                    min,
                    max,
                });
            }
        }
        Ok(())
    }
}
