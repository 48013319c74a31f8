//! The fewest updates with which the local model could have stayed within a force error: chosen with hindsight, from the truth.
//!
//! An update of the oracle's sets the model's box to the object's true pose and velocity in the tick in which it is sent, with
//! parameters of its choice. So what comes after it depends on nothing before it, and the fewest updates are the fewest
//! intervals that cover the ticks: an exact minimum. Pure. No slave could do this, and nothing that runs live may use it.
//!
//! Beside it stands a sender that knows the truth as well, but not what is to come: it shows what the hindsight is worth.

use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{BoxFootprint, Vec2};
use mmt_shared::model::local_model::Body;
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::settings::ModelSettings;

/// A tick of what happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// The HIP, m, world.
    pub hip: Vec2,
    /// Its velocity, m/s.
    pub hip_velocity: Vec2,
    /// The object's true pose and velocity when the HIP met it, before it moved on.
    pub truth: Motion,
    /// The true contact force on the object, N.
    pub force: Vec2,
    /// Whether the model's force is judged in this tick.
    pub is_judged: bool,
}

/// What an oracle knows: all that happened, and what it may give a model.
#[derive(Clone, Debug)]
pub struct Oracle<'a> {
    /// How the model is run.
    pub settings: ModelSettings,
    /// The object's true footprint.
    pub footprint: BoxFootprint,
    /// The parameters that an update may carry.
    pub choices: &'a [ModelParams],
    /// What happened.
    pub ticks: &'a [Tick],
    /// An update may be sent in every tick whose number is a multiple of this; at least 1.
    pub gap_ticks: usize,
}

/// How many updates do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needed {
    /// The fewest, chosen with hindsight. None if an update in every tick in which one may be sent would not do.
    pub fewest: Option<usize>,
    /// Those of a sender that knows the truth, but not what is to come: it sends when the model is off, as soon as it may, always with
    /// the same choice. Of all choices the one with which it sends the least; none without a choice.
    pub when_off: Option<usize>,
}

impl Oracle<'_> {
    /// How many updates a model needs that begins as `start` and is to be no more than `epsilon_n` (N) off in a judged tick.
    #[must_use]
    pub fn needed(&self, start: ModelState, epsilon_n: f64) -> Needed {
        let start = self.end(Body::new(start), 0, epsilon_n, &[]);
        let ends = |params| self.ends_of(params, epsilon_n);
        let of_choices: Vec<Vec<usize>> = self.choices.iter().map(ends).collect();
        let mut best: Vec<usize> = (0..self.ticks.len()).collect();
        for ends in &of_choices {
            for (best, end) in best.iter_mut().zip(ends) {
                *best = *end.max(best);
            }
        }
        let sent = of_choices
            .iter()
            .map(|ends| when_off(start, ends, self.gap_ticks));
        Needed {
            fewest: fewest(start, &best),
            when_off: sent.min(),
        }
    }

    /// For each tick the first one in which a model that is set in it is off again, with these parameters; the tick itself where it
    /// is off at once or no update may be sent. Found from the last tick on.
    fn ends_of(&self, params: &ModelParams, epsilon_n: f64) -> Vec<usize> {
        let mut ends: Vec<usize> = (0..self.ticks.len()).collect();
        let allowed = self.ticks.iter().enumerate().rev();
        for (k, tick) in allowed.filter(|(k, _)| self.allows(*k)) {
            let Motion { pose, twist } = tick.truth;
            let coupling = &self.settings.coupling;
            let set = ModelState::try_new(*params, self.footprint, pose, twist, coupling);
            let end = set.map_or(k, |state| self.end(Body::new(state), k, epsilon_n, &ends));
            if let Some(slot) = ends.get_mut(k) {
                *slot = end;
            }
        }
        ends
    }

    fn allows(&self, k: usize) -> bool {
        k.is_multiple_of(self.gap_ticks.max(1))
    }

    /// The first tick from `from` on in which this box is off. `known` are the ends of a box with the same parameters that is set
    /// in a tick later than `from`: one that has come to be the same, untouched, goes the same way.
    fn end(&self, mut body: Body, from: usize, epsilon_n: f64, known: &[usize]) -> usize {
        let ticks = self.ticks.iter().enumerate().skip(from);
        for (k, tick) in ticks {
            let state = body.state();
            if k > from
                && self.allows(k)
                && body.touch(tick.hip).is_none()
                && (state.pose, state.twist) == (tick.truth.pose, tick.truth.twist)
                && let Some(end) = known.get(k)
            {
                return *end;
            }
            let (rendered, _) = body.step(&self.settings, tick.hip, tick.hip_velocity);
            if tick.is_judged && (rendered.force - tick.force).norm() > epsilon_n {
                return k;
            }
        }
        self.ticks.len()
    }
}

/// The fewest updates that leave no tick off: without any the model is off first in tick `start`, after one in tick k first in
/// tick `ends[k]`. None if in some tick it is off whatever was sent.
///
/// An update may come in any tick up to the first that is off, and the one with the farthest end leaves the least to do.
fn fewest(start: usize, ends: &[usize]) -> Option<usize> {
    let (mut off, mut farthest, mut updates) = (start, 0, 0);
    let mut seen = 0;
    while off < ends.len() {
        for end in ends.get(seen..=off)? {
            farthest = farthest.max(*end);
        }
        seen = off + 1;
        if farthest <= off {
            return None;
        }
        off = farthest;
        updates += 1;
    }
    Some(updates)
}

/// The updates of who sends one whenever the model is off, in the first tick that is a multiple of `gap_ticks`. `start` and
/// `ends` as for [`fewest`]; what is off at once again is sent anew after the gap.
fn when_off(start: usize, ends: &[usize], gap_ticks: usize) -> usize {
    let gap_ticks = gap_ticks.max(1);
    let (mut off, mut updates) = (start, 0);
    while let Some(end) = ends.get(off.next_multiple_of(gap_ticks)) {
        updates += 1;
        off = (*end).max(off.next_multiple_of(gap_ticks) + 1);
    }
    updates
}

#[cfg(test)]
mod tests {
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::model::geometry::Twist;
    use mmt_shared::model::settings::Mode;
    use mmt_shared::rng::Substream;

    use super::*;

    /// The fewest of all subsets of the ticks, each judged tick by tick: what was sent last decides.
    fn of_all_subsets(start: usize, ends: &[usize]) -> Option<usize> {
        let n = ends.len();
        let holds = |subset: u32| {
            (0..n).all(|tick| {
                let last = (0..=tick).rev().find(|k| subset >> k & 1 == 1);
                tick < last.map_or(start, |k| ends[k])
            })
        };
        let sizes = (0..1_u32 << n)
            .filter(|subset| holds(*subset))
            .map(u32::count_ones);
        sizes.min().map(|least| least as usize)
    }

    #[test]
    fn the_fewest_is_the_fewest_of_all_subsets() {
        let mut random = Substream::new(1, "oracle", 0);
        let mut draw = |below: usize| (random.uniform() * below as f64) as usize;
        let mut found = Vec::new();
        for _ in 0..2000 {
            let n = 1 + draw(8);
            let ends: Vec<usize> = (0..n).map(|k| k + draw(5).min(n - k)).collect();
            let start = draw(n + 1);
            let least = fewest(start, &ends);
            assert_eq!(least, of_all_subsets(start, &ends), "{start} {ends:?}");
            found.push(least);
        }
        for wanted in [None, Some(0), Some(1), Some(2), Some(3), Some(4)] {
            assert!(found.contains(&wanted), "{wanted:?}");
        }
    }

    #[test]
    fn hand_made_ends_are_covered_as_by_hand() {
        assert_eq!(fewest(3, &[0, 0, 0]), Some(0), "never off");
        assert_eq!(fewest(0, &[3, 3, 3]), Some(1));
        // the update in tick 1 reaches farther than the one in tick 2, where it is off first
        assert_eq!(fewest(2, &[2, 5, 4, 5, 5, 6]), Some(2));
        assert_eq!(fewest(1, &[1, 1, 4, 4]), None, "nothing mends tick 1");
    }

    #[test]
    fn who_waits_until_the_model_is_off_sends_by_hand_made_ends_as_by_hand() {
        assert_eq!(when_off(3, &[0, 0, 0], 1), 0, "never off");
        // where an update of tick 1 would have reached farther
        assert_eq!(when_off(2, &[2, 5, 4, 5, 5, 6], 1), 3);
        assert_eq!(when_off(1, &[1, 1, 4, 4], 1), 2, "tick 1 stays off");
        assert_eq!(when_off(1, &[1, 1, 4, 4], 2), 1, "sent in tick 2");
        assert_eq!(when_off(3, &[4, 4, 4, 4], 2), 0, "too late to send");
    }

    fn params(c: f64) -> ModelParams {
        ModelParams::of_square(0.7, 3.0, c, 0.36, &COUPLING).unwrap()
    }

    fn state(c: f64) -> ModelState {
        let footprint = BoxFootprint::square(0.36);
        let motion = Motion::default();
        ModelState::try_new(
            params(c),
            footprint,
            motion.pose,
            Twist::default(),
            &COUPLING,
        )
        .unwrap()
    }

    /// A box whose friction is 2 N for 400 ticks and 3 N for 400, pushed by a hand at 0.1 m/s.
    fn pushed() -> (ModelSettings, Vec<Tick>) {
        let settings = Mode::Recommended.model_settings(COUPLING);
        let (mut body, mut ticks) = (Body::new(state(2.0)), Vec::new());
        for k in 0..800 {
            if k == 400 {
                let Motion { pose, twist } = motion(&body);
                let footprint = BoxFootprint::square(0.36);
                let state = ModelState::try_new(params(3.0), footprint, pose, twist, &COUPLING);
                body = Body::new(state.unwrap());
            }
            let (hip, hip_velocity) = (
                Vec2::new(-0.185 + 1e-4 * f64::from(k), 0.0),
                Vec2::new(0.1, 0.0),
            );
            let truth = motion(&body);
            let (rendered, _) = body.step(&settings, hip, hip_velocity);
            ticks.push(Tick {
                hip,
                hip_velocity,
                truth,
                force: rendered.force,
                is_judged: k >= 100,
            });
        }
        (settings, ticks)
    }

    fn motion(body: &Body) -> Motion {
        let state = body.state();
        Motion {
            pose: state.pose,
            twist: state.twist,
        }
    }

    #[test]
    fn an_oracle_that_knows_both_frictions_needs_one_update_for_the_step_and_none_before() {
        let (settings, ticks) = pushed();
        let every = |gap_ticks: usize, choices: &[ModelParams], start: f64, epsilon_n: f64| {
            let oracle = Oracle {
                settings,
                footprint: BoxFootprint::square(0.36),
                choices,
                ticks: &ticks,
                gap_ticks,
            };
            oracle.needed(state(start), epsilon_n)
        };
        let fewest =
            |choices: &[ModelParams], start, epsilon_n| every(1, choices, start, epsilon_n).fewest;
        let both = [params(2.0), params(3.0)];
        assert_eq!(fewest(&both, 2.0, 1e-9), Some(1));
        assert_eq!(fewest(&both, 3.0, 1e-9), Some(2));
        assert_eq!(fewest(&both, 3.0, 2.0), Some(0));
        // who knows the second friction only sets the state so often that the first does not show
        let blind = fewest(&both[1..], 3.0, 0.2).unwrap();
        assert!(blind > 2, "{blind}");
        // the step comes in tick 400: an update of tick 399 is of before it
        assert_eq!(every(200, &both, 2.0, 1e-9).fewest, Some(1));
        assert_eq!(every(399, &both, 2.0, 1e-9).fewest, None);
        // who sends when it is off sends the second friction once, in tick 401, and the first again and again from then on
        assert_eq!(every(1, &both[1..], 2.0, 1e-9).when_off, Some(1));
        assert_eq!(every(1, &both[..1], 2.0, 1e-9).when_off, Some(399));
        assert_eq!(every(10, &both[..1], 2.0, 1e-9).when_off, Some(39));
        assert_eq!(every(1, &both, 2.0, 1e-9).when_off, Some(1));
        assert_eq!(every(1, &[], 2.0, 1e-9).when_off, None);
    }
}
