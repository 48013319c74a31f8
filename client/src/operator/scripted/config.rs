//! What the scripted operator does, in numbers, and the ranges in which a hand can follow them.

use mmt_shared::range::{OutOfRange, all_in_range};
use serde::{Deserialize, Serialize};

use crate::operator::hand::HandConfig;
use crate::operator::route::CLOSE_M;

/// What the scripted operator sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VisualFeedback {
    /// The local model: where the box is felt.
    #[default]
    Model,
    /// The remote scene as it arrives, a round trip behind the hand. Only a world in virtual time can show
    /// it to a script; contact is felt at the model all the same.
    Delayed,
}

/// What the scripted operator does. The defaults are those of the design study unless another source is named.
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
    /// What it sees. Default the model.
    pub view: VisualFeedback,
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
            view: VisualFeedback::Model,
            hand: HandConfig::default(),
        }
    }
}

impl ScriptedConfig {
    /// Checks every number against what a hand can follow.
    pub(super) fn checked(&self) -> Result<(), OutOfRange> {
        let hand = &self.hand;
        let (slowest, fastest) = self.push_speed_m_per_s;
        let (travel, approach) = (self.travel_m_per_s, self.approach_m_per_s);
        let (slow, fast) = (self.slow_hz, self.fast_hz);
        let (acceleration, home) = (self.acceleration_m_per_s2, self.home_radius_m);
        let speeds = (0.01, 0.4);
        #[rustfmt::skip]
        let checks = [
            ("operator.lateral_max_m", "m", self.lateral_max_m, (0.0, 0.15)),
            ("operator.travel_m_per_s", "m/s", travel, speeds),
            ("operator.stand_off_m", "m", self.stand_off_m, (CLOSE_M, 0.5)),
            ("operator.approach_m_per_s", "m/s", approach, (0.01, 0.1)),
            ("operator.dwell_s", "s", self.dwell_s, (0.0, 60.0)),
            ("operator.nudge_m", "m", self.nudge_m, (0.01, 0.2)),
            ("operator.push_m", "m", self.push_m, (0.01, 1.0)),
            ("operator.push_speed_m_per_s.0", "m/s", slowest, speeds),
            ("operator.push_speed_m_per_s.1", "m/s", fastest, (slowest, 0.3)),
            ("operator.slow_share", "", self.slow_share, (0.0, 0.5)),
            ("operator.slow_hz.0", "Hz", slow.0, (0.0, 5.0)),
            ("operator.slow_hz.1", "Hz", slow.1, (slow.0, 5.0)),
            ("operator.fast_share", "", self.fast_share, (0.0, 0.4)),
            ("operator.fast_hz.0", "Hz", fast.0, (0.0, 5.0)),
            ("operator.fast_hz.1", "Hz", fast.1, (fast.0, 5.0)),
            ("operator.hold_s", "s", self.hold_s, (0.0, 60.0)),
            ("operator.retract_m", "m", self.retract_m, (CLOSE_M + 0.02, 0.5)),
            ("operator.acceleration_m_per_s2", "m/s^2", acceleration, (0.5, 3.0)),
            ("operator.press_max_n", "N", self.press_max_n, (1.0, 20.0)),
            ("operator.home_radius_m", "m", home, (0.5, 3.0)),
            ("operator.hand.mass_kg", "kg", hand.mass_kg, (0.1, 5.0)),
            ("operator.hand.stiffness_n_per_m", "N/m", hand.stiffness_n_per_m, (50.0, 2000.0)),
            ("operator.hand.damping_ns_per_m", "N s/m", hand.damping_ns_per_m, (1.0, 100.0)),
            ("operator.hand.tremor_hz", "Hz", hand.tremor_hz, (0.0, 20.0)),
            ("operator.hand.tremor_m", "m", hand.tremor_m, (0.0, 5e-3)),
        ];
        all_in_range(checks)
    }
}
