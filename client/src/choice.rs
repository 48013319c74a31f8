//! Which architecture the hand should feel: the tool's force across the network, or the local model.
//!
//! Two relative force errors are held against each other: the one that position–force with passivity control (TDPA)
//! has at the measured round trip and the device's stiffness, and the one that the model has had of late, as the slave measures it. Pure: a tick
//! at a time. It must never change its mind on one sample: a choice stands until the other has been better by a
//! margin for a while.

use mmt_shared::time::TICK_S;

/// Relative force error of TDPA by round trip (ms), between which it is interpolated: medians over nine seeds of 20 s at
/// k_p 1000, without jitter and loss. `lab/src/architecture/tests.rs` derives and prints them.
pub const TDPA_ERROR: [(f64, f64); 9] = [
    (0.0, 0.051),
    (2.0, 0.053),
    (4.0, 0.063),
    (10.0, 0.094),
    (20.0, 0.164),
    (28.0, 0.252),
    (40.0, 0.327),
    (100.0, 0.487),
    (200.0, 0.511),
];
/// Stiffness that the errors were measured at, N/m. A contact's period goes with 1/√k_p, so a delay counts √(k_p/1000)
/// times: at 3000 N/m that foretells 0.078, 0.145 and 0.211 at 2, 5 and 7 ms one way, and 0.080, 0.150 and 0.224 were
/// measured.
pub const STIFFNESS_N_PER_M: f64 = 1000.0;
/// Beyond this round trip, so counted, TDPA is not felt whatever the model is like, s. At 1000 N/m a mass is felt as
/// 0.77 of itself there; at 3000 N/m contact holds at 7 ms one way and breaks 7 times a push at 10.
pub const TDPA_ROUND_TRIP_MAX_S: f64 = 0.028;
/// The other one has to be better by this factor: the errors of two pushes differ by less.
pub const MARGIN: f64 = 1.25;
/// For this long without a break, s: longer than a touch, shorter than a push.
pub const INSISTS_S: f64 = 0.5;
/// Time constant of the round trip, s: a single late packet is no path.
const ROUND_TRIP_TAU_S: f64 = 0.2;

/// What the hand feels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Chosen {
    /// The tool's force, with time-domain passivity control.
    Tdpa,
    /// The local model's force.
    #[default]
    Mediated,
}

/// The choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// How many times a delay counts at the device's stiffness.
    weight: f64,
    chosen: Chosen,
    /// The newest round trip, s.
    newest_s: Option<f64>,
    round_trip_s: Option<f64>,
    /// For how long the other one has been better, s.
    better_s: f64,
    switches: u32,
}

/// The relative force error to expect of TDPA at a round trip (s, as counted at 1000 N/m); that of the longest measured beyond it.
#[must_use]
pub fn tdpa_error(round_trip_s: f64) -> f64 {
    let ms = round_trip_s * 1e3;
    let pairs = TDPA_ERROR.iter().zip(TDPA_ERROR.iter().skip(1));
    for ((from_ms, from), (to_ms, to)) in pairs {
        if ms < *to_ms {
            let share = ((ms - from_ms) / (to_ms - from_ms)).max(0.0);
            return from + (to - from) * share;
        }
    }
    TDPA_ERROR.last().map_or(1.0, |(_, error)| *error)
}

impl Choice {
    /// A choice that has seen nothing, for a device of stiffness k_p, N/m: it begins with the model.
    #[must_use]
    pub fn for_stiffness(k_p: f64) -> Self {
        Self {
            weight: (k_p / STIFFNESS_N_PER_M).sqrt(),
            chosen: Chosen::Mediated,
            newest_s: None,
            round_trip_s: None,
            better_s: 0.0,
            switches: 0,
        }
    }

    /// What is chosen now.
    #[must_use]
    pub fn chosen(&self) -> Chosen {
        self.chosen
    }

    /// How often it has changed.
    #[must_use]
    pub fn switches(&self) -> u32 {
        self.switches
    }

    /// The smoothed round trip, s; none before the first was measured.
    #[must_use]
    pub fn round_trip_s(&self) -> Option<f64> {
        self.round_trip_s
    }

    /// One tick: the round trip of the newest answer (s) if there is one, and the model's relative error of late.
    /// Before the first answer nothing but the model can be felt.
    pub fn tick(&mut self, round_trip_s: Option<f64>, model_error: f64) -> Chosen {
        self.newest_s = round_trip_s
            .filter(|seen| seen.is_finite())
            .or(self.newest_s);
        let Some(newest_s) = self.newest_s else {
            return self.chosen;
        };
        // a path is as it was last seen: answers come every tick with TDPA and seldom without
        let known_s = self.round_trip_s.get_or_insert(newest_s);
        *known_s += (newest_s - *known_s) * (TICK_S / ROUND_TRIP_TAU_S);
        let round_trip_s = *known_s * self.weight;
        let tdpa = tdpa_error(round_trip_s);
        let better = match self.chosen {
            Chosen::Mediated => {
                tdpa * MARGIN < model_error && round_trip_s * MARGIN < TDPA_ROUND_TRIP_MAX_S
            }
            Chosen::Tdpa => model_error * MARGIN < tdpa || round_trip_s > TDPA_ROUND_TRIP_MAX_S,
        };
        self.better_s = if better { self.better_s + TICK_S } else { 0.0 };
        if self.better_s >= INSISTS_S {
            self.better_s = 0.0;
            self.switches = self.switches.saturating_add(1);
            self.chosen = match self.chosen {
                Chosen::Mediated => Chosen::Tdpa,
                Chosen::Tdpa => Chosen::Mediated,
            };
        }
        self.chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(choice: &mut Choice, ticks: u32, round_trip_s: f64, model_error: f64) -> Chosen {
        (0..ticks)
            .map(|_| choice.tick(Some(round_trip_s), model_error))
            .last()
            .unwrap()
    }

    #[test]
    fn the_expected_error_goes_through_what_was_measured_and_never_falls() {
        for (ms, error) in TDPA_ERROR {
            assert!((tdpa_error(ms * 1e-3) - error).abs() < 1e-12, "{ms} ms");
        }
        let mut last = 0.0;
        for n in 0..1000 {
            let error = tdpa_error(f64::from(n) * 1e-3);
            assert!(error >= last, "{n} ms");
            last = error;
        }
        assert_eq!(tdpa_error(9.0), 0.511);
    }

    #[test]
    fn a_short_path_and_an_unknown_model_choose_the_tools_force_and_a_long_path_the_model() {
        let mut near = Choice::for_stiffness(1000.0);
        assert_eq!(near.tick(None, 0.4), Chosen::Mediated, "nothing is known");
        assert_eq!(after(&mut near, 1000, 0.002, 0.4), Chosen::Tdpa);
        let mut far = Choice::for_stiffness(1000.0);
        assert_eq!(after(&mut far, 5000, 0.5, 0.4), Chosen::Mediated);
        assert_eq!((near.switches(), far.switches()), (1, 0));
    }

    #[test]
    fn it_crosses_where_the_errors_cross_and_not_on_the_way_back() {
        // the model is 10 % off; TDPA is so at 11 ms: each way the margin lies between
        let at = |choice: &mut Choice, ms: f64| after(choice, 2000, ms * 1e-3, 0.1);
        let mut choice = Choice::for_stiffness(1000.0);
        let out: Vec<f64> = (0..40).map(f64::from).collect();
        assert_eq!(at(&mut choice, 0.0), Chosen::Tdpa);
        let leaves = out
            .iter()
            .find(|ms| at(&mut choice, **ms) == Chosen::Mediated);
        let returns = out
            .iter()
            .rev()
            .find(|ms| at(&mut choice, **ms) == Chosen::Tdpa);
        let (leaves, returns) = (*leaves.unwrap(), *returns.unwrap());
        assert!((15.0..=17.0).contains(&leaves), "{leaves} ms");
        assert!((7.0..=9.0).contains(&returns), "{returns} ms");
        assert_eq!(choice.switches(), 3);
    }

    #[test]
    fn what_alternates_faster_than_it_insists_changes_nothing() {
        let mut choice = Choice::for_stiffness(1000.0);
        for _ in 0..100 {
            after(&mut choice, 499, 0.0, 0.4);
            after(&mut choice, 10, 0.0, 0.05);
        }
        assert_eq!(choice.switches(), 0);
        // one late packet in a hundred is no longer path
        let mut choice = Choice::for_stiffness(1000.0);
        after(&mut choice, 1000, 0.002, 0.2);
        for n in 0..10_000 {
            choice.tick(Some(if n % 100 == 0 { 0.1 } else { 0.002 }), 0.2);
        }
        assert_eq!((choice.chosen(), choice.switches()), (Chosen::Tdpa, 1));
    }

    #[test]
    fn beyond_the_longest_round_trip_no_model_is_too_wrong() {
        let mut choice = Choice::for_stiffness(1000.0);
        assert_eq!(after(&mut choice, 1000, 0.022, 1.0), Chosen::Tdpa);
        assert_eq!(after(&mut choice, 1000, 0.0275, 1.0), Chosen::Tdpa);
        assert_eq!(after(&mut choice, 2000, 0.0285, 1.0), Chosen::Mediated);
        assert_eq!(after(&mut choice, 2000, 0.0275, 1.0), Chosen::Mediated);
        let mut stiff = Choice::for_stiffness(4000.0);
        assert_eq!(
            after(&mut stiff, 2000, 0.015, 1.0),
            Chosen::Mediated,
            "counts twice"
        );
        assert_eq!(after(&mut stiff, 2000, 0.011, 1.0), Chosen::Tdpa);
        // one answer is enough: the path is as it was last seen
        choice.tick(Some(0.002), 1.0);
        let last = (0..2000).map(|_| choice.tick(None, 1.0)).last();
        assert_eq!(last, Some(Chosen::Tdpa));
    }

    #[test]
    fn a_round_trip_that_is_no_number_is_not_believed() {
        let mut choice = Choice::for_stiffness(1000.0);
        assert_eq!(choice.tick(Some(f64::NAN), 0.4), Chosen::Mediated);
        assert_eq!(choice.round_trip_s(), None);
    }
}
