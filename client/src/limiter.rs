//! The one function through which force leaves for the hand.
//!
//! It must never let out more than F_max, a change of more than S_max a tick, a number that is not
//! finite, or, once released, a force that grows.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::range::{OutOfRange, in_range};
use serde::{Deserialize, Serialize};

/// Ticks of the ramp in after engaging and out after releasing: 200 ms. Long enough not to startle,
/// short against a push.
pub const RAMP_TICKS: u32 = 200;
/// Default S_max, N per tick: four ticks from the default F_max to nothing.
pub const STEP_MAX_N: f64 = 2.0;

/// Accepted F_max, N: beyond, no device of this project can follow.
const FORCE_MAX_N: (f64, f64) = (0.1, 50.0);
/// S_max in messages, with the reason for its range.
const STEP_MAX_NAME: &str = "step_max_n (least: the ramp to force_max_n; most: twice force_max_n)";
/// A limited vector is made this much shorter than its limit, so that rounding cannot lift it above.
const INSIDE: f64 = 1.0 - 32.0 * f64::EPSILON;

/// What the limiter guards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// F_max: largest |f|, N. Default 8, what common desktop devices give.
    pub force_max_n: f64,
    /// S_max: largest |f(n) − f(n−1)|, N per tick. Default 2.
    pub step_max_n: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            force_max_n: 8.0,
            step_max_n: STEP_MAX_N,
        }
    }
}

/// Limits the force on the hand, tick by tick. Starts released.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceLimiter {
    limits: Limits,
    engaged: bool,
    /// How far the ramp is in, 0 to [`RAMP_TICKS`].
    ramp: u32,
    last: Vec2,
    rejected: u64,
    limited: u64,
}

impl ForceLimiter {
    /// A released limiter.
    ///
    /// # Errors
    /// Names the limit that is not accepted.
    pub fn try_new(limits: Limits) -> Result<Self, OutOfRange> {
        let force = limits.force_max_n;
        in_range("force_max_n", "N", force, FORCE_MAX_N)?;
        // the 200 ms ramp up to F_max, and a jump from end to end
        let steps = (force / f64::from(RAMP_TICKS), 2.0 * force);
        in_range(STEP_MAX_NAME, "N per tick", limits.step_max_n, steps)?;
        Ok(Self {
            limits,
            engaged: false,
            ramp: 0,
            last: Vec2::zeros(),
            rejected: 0,
            limited: 0,
        })
    }

    /// Begins to ramp the force in.
    pub fn engage(&mut self) {
        self.engaged = true;
    }

    /// Begins to ramp the force out; from now on it never grows.
    pub fn release(&mut self) {
        self.engaged = false;
    }

    /// Whether force may grow.
    pub fn engaged(&self) -> bool {
        self.engaged
    }

    /// Whether it is released and the ramp has ended: no force leaves.
    pub fn at_rest(&self) -> bool {
        !self.engaged && self.ramp == 0
    }

    /// Ticks on which the wanted force was not finite.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Ticks on which F_max or S_max made the force another than the ramped one.
    pub fn limited(&self) -> u64 {
        self.limited
    }

    /// Takes the force wanted on the hand in this tick and returns the one that may leave, N.
    ///
    /// A force that is not finite counts as none: what still leaves falls to zero by S_max a tick.
    pub fn limit(&mut self, wanted: Vec2) -> Vec2 {
        let finite = wanted.x.is_finite() && wanted.y.is_finite();
        self.rejected += u64::from(!finite);
        let wanted = if finite { wanted } else { Vec2::zeros() };
        self.ramp = if self.engaged {
            (self.ramp + 1).min(RAMP_TICKS)
        } else {
            self.ramp.saturating_sub(1)
        };
        let gain = f64::from(self.ramp) / f64::from(RAMP_TICKS);
        let ramped = wanted * gain;
        let mut most = self.limits.force_max_n * gain;
        if !self.engaged {
            most = most.min(self.last.norm());
        }
        let target = shortened(ramped, most);
        // The limit itself may have come down on the last force: that way counts towards the step too.
        let base = shortened(self.last, most);
        let left = (self.limits.step_max_n - (base - self.last).norm()).max(0.0);
        let next = if (target - self.last).norm() <= self.limits.step_max_n {
            target
        } else {
            shortened(base + shortened(target - base, left), most)
        };
        self.limited += u64::from(next != ramped);
        self.last = next;
        next
    }
}

/// `v`, made no longer than `most`.
fn shortened(v: Vec2, most: f64) -> Vec2 {
    // scaled by the largest component first, which cannot overflow
    let size = v.x.abs().max(v.y.abs());
    if size == 0.0 {
        return v;
    }
    let unit = v / size;
    let length = unit.norm();
    if size * length <= most {
        return v;
    }
    unit * (most * INSIDE / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn engaged() -> ForceLimiter {
        let mut limiter = ForceLimiter::try_new(Limits::default()).unwrap();
        limiter.engage();
        for _ in 0..RAMP_TICKS {
            limiter.limit(Vec2::zeros());
        }
        limiter
    }

    fn settle(limiter: &mut ForceLimiter, f: Vec2) -> Vec2 {
        (0..10).map(|_| limiter.limit(f)).last().unwrap()
    }

    #[test]
    fn a_force_at_f_max_passes_untouched_and_one_above_is_cut_to_it() {
        let mut limiter = engaged();
        assert_eq!(
            settle(&mut limiter, Vec2::new(0.0, 8.0)),
            Vec2::new(0.0, 8.0)
        );
        let before = limiter.limited();
        limiter.limit(Vec2::new(0.0, 8.0));
        assert_eq!(limiter.limited(), before);
        let above = limiter.limit(Vec2::new(0.0, 8.0_f64.next_up()));
        assert!(above.norm() <= 8.0 && above.norm() > 8.0 - 1e-12);
        assert_eq!(limiter.limited(), before + 1);
    }

    #[test]
    fn a_step_of_s_max_passes_untouched_and_one_above_is_cut_to_it() {
        let mut limiter = engaged();
        assert_eq!(limiter.limit(Vec2::new(2.0, 0.0)), Vec2::new(2.0, 0.0));
        assert_eq!(limiter.limit(Vec2::zeros()), Vec2::zeros());
        assert_eq!(limiter.limited(), 0);
        let above = limiter.limit(Vec2::new(2.0_f64.next_up(), 0.0));
        assert!(above.norm() <= 2.0 && above.norm() > 2.0 - 1e-12);
        assert_eq!(limiter.limited(), 1);
    }

    #[test]
    fn a_reversal_from_end_to_end_takes_eight_ticks() {
        let mut limiter = engaged();
        settle(&mut limiter, Vec2::new(8.0, 0.0));
        let ticks = (1..)
            .find(|_| limiter.limit(Vec2::new(-8.0, 0.0)).x < -7.999_999)
            .unwrap();
        assert_eq!(ticks, 8);
    }

    #[test]
    fn force_ramps_in_over_200_ticks_after_engaging() {
        let mut limiter = ForceLimiter::try_new(Limits::default()).unwrap();
        let f = Vec2::new(4.0, 0.0);
        assert_eq!(limiter.limit(f), Vec2::zeros());
        limiter.engage();
        assert_eq!(limiter.limit(f), f / 200.0);
        let at = (2..=199).map(|_| limiter.limit(f)).last().unwrap();
        assert_eq!(at, f * (199.0 / 200.0));
        assert_eq!(limiter.limit(f), f);
        assert_eq!(limiter.limit(f), f);
    }

    #[test]
    fn force_is_zero_200_ticks_after_release_and_one_tick_before_it_is_not() {
        let mut limiter = engaged();
        let f = Vec2::new(0.0, -6.0);
        settle(&mut limiter, f);
        limiter.release();
        let before = (1..=199).map(|_| limiter.limit(f)).last().unwrap();
        assert!(before.y < 0.0 && !limiter.at_rest());
        assert_eq!(limiter.limit(f), Vec2::zeros());
        assert!(limiter.at_rest());
        assert_eq!(limiter.limit(f), Vec2::zeros());
    }

    #[test]
    fn nonsense_is_counted_and_brings_the_force_to_zero_within_s_max() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut limiter = engaged();
            settle(&mut limiter, Vec2::new(3.0, 0.0));
            assert!((limiter.limit(Vec2::new(bad, 0.0)).x - 1.0).abs() < 1e-12);
            assert_eq!(limiter.limit(Vec2::new(0.0, bad)), Vec2::zeros());
            assert_eq!(limiter.rejected(), 2);
        }
    }

    #[test]
    fn limits_that_contradict_each_other_are_refused() {
        let with = |force_max_n, step_max_n| {
            ForceLimiter::try_new(Limits {
                force_max_n,
                step_max_n,
            })
            .map(|_| ())
        };
        assert_eq!(with(8.0, 0.04), Ok(()));
        assert!(matches!(
            with(8.0, 0.039),
            Err(OutOfRange { value: 0.039, .. })
        ));
        assert!(with(8.0, 16.1).is_err());
        for bad in [f64::NAN, 0.0, -8.0, f64::INFINITY] {
            assert!(with(bad, 2.0).is_err());
            assert!(with(8.0, bad).is_err());
        }
    }

    fn any_force() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => -20.0..20.0,
            1 => proptest::num::f64::ANY,
            1 => Just(8.0),
            1 => Just(-2.0),
        ]
    }

    proptest! {
        #[test]
        fn no_input_lifts_the_force_above_its_limits_and_none_grows_after_release(
            inputs in proptest::collection::vec((any_force(), any_force(), 0..60u32), 1..600)
        ) {
            let mut limiter = engaged();
            let mut last = Vec2::zeros();
            for (x, y, switch) in inputs {
                match switch {
                    0 => limiter.release(),
                    1 => limiter.engage(),
                    _ => {}
                }
                let f = limiter.limit(Vec2::new(x, y));
                prop_assert!(f.norm() <= 8.0);
                prop_assert!((f - last).norm() <= 2.0);
                prop_assert!(limiter.engaged() || f.norm() <= last.norm());
                last = f;
            }
        }
    }
}
