//! What delay does to the hand: the table of `docs/model.md`, the shadow's bounds, and passivity over
//! worlds that are drawn at random.

use super::*;
use mmt_client::operator::scripted::VisualFeedback;
use mmt_server::repeats::Repeats;
use mmt_server::shadow::TriggerReference;
use mmt_shared::model::local_model::LocalModel;
use mmt_shared::model::settings::{ModelSettings, PoseCorrection};
use mmt_shared::rng::Substream;
use proptest::prelude::*;

/// Runs of 40 s over one network, put together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    /// Largest of all seeds.
    pub(super) peak_n: f64,
    pub(super) breaks_per_push: f64,
    /// Mean over the seeds, as are the next two.
    pub(super) pose_rms_mm: f64,
    contact_rate_hz: f64,
    relative_error: f64,
    /// Sum over the seeds.
    pushes: u64,
    /// Sum over the seeds.
    pub(super) injected_mj: f64,
    /// Least of all seeds.
    pub(super) observer_min_mj: f64,
}

impl Row {
    pub(super) fn of(
        words: &str,
        seeds: std::ops::RangeInclusive<u64>,
        change: impl Fn(&mut WorldConfig),
    ) -> Self {
        let n = seeds.clone().count() as f64;
        let (mut row, mut breaks, mut pushes) = (Self::default(), 0, 0);
        for seed in seeds {
            let mut config = over(words, seed);
            change(&mut config);
            let world = run(&config, 40);
            let outcome = world.outcome();
            row.peak_n = row.peak_n.max(outcome.on_hand.largest_n().unwrap());
            breaks += outcome.breaks.total();
            pushes += world.operator().pushes_completed().unwrap();
            row.pose_rms_mm += outcome.pose.position_rms_m().unwrap() * 1e3 / n;
            row.contact_rate_hz += outcome.updates.contact_rate_hz().unwrap() / n;
            row.relative_error += relative_error(&world) / n;
            row.injected_mj += outcome.energy_injected_j * 1e3;
            row.observer_min_mj = row.observer_min_mj.min(outcome.observer_min_j * 1e3);
        }
        row.pushes = pushes;
        row.breaks_per_push = breaks as f64 / pushes as f64;
        row
    }
}

fn corrected_by(correction: PoseCorrection) -> impl Fn(&mut WorldConfig) {
    move |config| {
        let coupling = Coupling::for_stiffness(1000.0);
        config.settings = Some(ModelSettings {
            correction,
            ..config.slave.mode.model_settings(coupling)
        });
    }
}

/// The share of the target that jitter and loss may take it over.
pub(super) const FAULTS: f64 = 1.5;

#[test]
fn up_to_half_a_second_each_way_the_hand_feels_no_network() {
    for one_way_ms in [0, 50, 100, 250, 500] {
        for (faults, room) in [("", 1.0), (" 10ms loss 20%", FAULTS)] {
            let words = format!("delay {one_way_ms}ms{faults}");
            let row = Row::of(&words, 1..=5, |_| {});
            println!("{words:28} {row:.3?}");
            assert!(row.peak_n <= 4.0 * room, "{words}: {row:?}");
            assert!(
                (0.9..=1.1).contains(&row.breaks_per_push),
                "{words}: {row:?}"
            );
            assert!(row.pose_rms_mm <= 7.0 * room, "{words}: {row:?}");
            assert!(row.contact_rate_hz <= 12.0 * room, "{words}: {row:?}");
            assert!(row.injected_mj <= 1.0, "{words}: {row:?}");
            assert!(row.observer_min_mj >= -1.0, "{words}: {row:?}");
        }
    }
}

#[test]
fn replay_is_better_than_matched_stamps_and_setting_the_pose_is_not_usable() {
    for words in [WAN, "delay 500ms"] {
        let row = |correction| Row::of(words, 1..=3, corrected_by(correction));
        let (replay, matched, snap) = (
            row(PoseCorrection::Replay),
            row(PoseCorrection::MatchedStamps),
            row(PoseCorrection::Snap),
        );
        for (name, row) in [("replay", replay), ("matched", matched), ("snap", snap)] {
            println!("{words:28} {name:8} {row:.3?}");
        }
        assert!(replay.relative_error < matched.relative_error, "{words}");
        // without much delay both are as good as the pose that the slave sends
        assert!(replay.pose_rms_mm < 1.1 * matched.pose_rms_mm, "{words}");
        assert!(replay.breaks_per_push < matched.breaks_per_push, "{words}");
        assert!(snap.injected_mj > 10.0, "{words}: {snap:?}");
        assert!(snap.peak_n > 2.0 * replay.peak_n, "{words}: {snap:?}");
    }
}

#[test]
fn an_operator_who_looks_at_the_delayed_picture_gets_less_done() {
    for one_way_ms in [500, 2000] {
        let pushes = |view| -> u64 {
            let pushes = |seed| {
                let mut config = over(&format!("delay {one_way_ms}ms"), seed);
                config.operator.view = view;
                let world = run(&config, 40);
                world.operator().pushes_completed().unwrap()
            };
            (1..=3).map(pushes).sum()
        };
        let (model, delayed) = (
            pushes(VisualFeedback::Model),
            pushes(VisualFeedback::Delayed),
        );
        println!("{one_way_ms} ms: {model} pushes on the model, {delayed} on the delayed picture");
        assert!(one_way_ms < 1000 || delayed < model);
    }
}

#[test]
fn without_a_shadow_the_trigger_sends_what_is_already_on_its_way() {
    let rate = |words: &str, reference| {
        let row = Row::of(words, 1..=2, |config| {
            config.slave.trigger.scheme = "deadband 10%".parse().unwrap();
            // what is sent in free space depends on no reference
            config.slave.trigger.free_space_error_m = 0.0;
            config.slave.trigger_reference = reference;
        });
        println!("{words:28} {reference:?} {row:.3?}");
        row.contact_rate_hz
    };
    for words in ["delay 50ms", "delay 250ms"] {
        let [shadow, echo, _] = [
            TriggerReference::Shadow,
            TriggerReference::Echo,
            TriggerReference::None,
        ]
        .map(|reference| rate(words, reference));
        assert!(
            echo > 1.5 * shadow,
            "{words}: {echo} echoed, {shadow} shadowed"
        );
    }
}

/// How far the shadow's copies were from the master's model at the same stamps.
#[derive(Debug, Default)]
struct Apart {
    /// The confirmed copy while both have the same newest update: position, mm, and angle, mrad.
    confirmed: Vec<(f64, f64)>,
    /// Samples at which they have not.
    between: usize,
    /// The copy that is ahead, with nothing on its way for half a second.
    ahead: Vec<(f64, f64)>,
    lost: u64,
}

impl Apart {
    fn of(config: &WorldConfig) -> Self {
        let mut world = World::try_new(config).unwrap();
        let (mut had, mut quiet, mut apart) = (Vec::new(), 0, Self::default());
        for _ in 0..40_000 {
            world.step();
            had.push(world.master.counts().newest_applied);
            let shadow = world.slave().shadow();
            let flying = !shadow.nothing_in_flight();
            quiet = if flying { 0 } else { quiet + 1 };
            let Some(moment) = shadow.confirmed().history().newest() else {
                continue;
            };
            let place = moment.stamp.saturating_since(Time::ZERO + TICK).as_millis();
            let difference = |copy| difference(copy, world.master().model());
            if had[place as usize] == shadow.newest_confirmed() {
                apart.confirmed.push(difference(shadow.confirmed()));
            } else {
                apart.between += 1;
            }
            if quiet > 500 {
                apart.ahead.push(difference(shadow.ahead()));
            }
        }
        apart.lost = world.slave().shadow().lost();
        apart
    }

    fn add(&mut self, other: Self) {
        self.confirmed.extend(other.confirmed);
        self.between += other.between;
        self.ahead.extend(other.ahead);
        self.lost += other.lost;
    }
}

fn difference(copy: &LocalModel, own: &LocalModel) -> (f64, f64) {
    let copy = copy.history().newest().unwrap();
    let own = own.history().at(copy.stamp).unwrap();
    assert_eq!(
        own.stamp, copy.stamp,
        "the shadow takes the master's samples"
    );
    let (copy, own) = (&copy.motion.pose, &own.motion.pose);
    let position = (copy.position - own.position).norm();
    (position * 1e3, (copy.angle - own.angle).abs() * 1e3)
}

/// The share of both numbers that is not exceeded by all but one in `one_in`.
fn quantile(of: &[(f64, f64)], one_in: usize) -> (f64, f64) {
    let nth = |values: Vec<f64>| {
        let mut values = values;
        values.sort_by(f64::total_cmp);
        values[values.len() - 1 - values.len() / one_in]
    };
    (
        nth(of.iter().map(|(a, _)| *a).collect()),
        nth(of.iter().map(|(_, b)| *b).collect()),
    )
}

#[test]
fn under_loss_and_reordering_the_shadow_is_the_masters_model_within_its_bound() {
    for (words, lossy) in [
        ("delay 50ms", false),
        ("delay 50ms 10ms order free loss 20%", true),
        ("delay 500ms 10ms order free loss 20%", true),
    ] {
        for repeat in [false, true] {
            // no seed is chosen: what holds of three together need not hold of each
            let mut apart = Apart::default();
            for seed in 1..=3 {
                let mut config = over(words, seed);
                config.repeat_samples = u8::from(repeat);
                if !repeat {
                    config.slave.repeats_ms = Repeats::NONE;
                }
                apart.add(Apart::of(&config));
            }
            let [typical, most] = [100, usize::MAX].map(|n| quantile(&apart.confirmed, n));
            let ahead = quantile(&apart.ahead, usize::MAX);
            println!(
                "{words:38} repeats {repeat}: confirmed 99 % {typical:.3?}, most {most:.3?} \
                 (mm, mrad), ahead {ahead:.3?} in {} ticks, {} ticks between, {} updates lost",
                apart.ahead.len(),
                apart.between,
                apart.lost
            );
            assert!(repeat || (apart.lost > 15) == lossy);
            assert!(apart.between < 3000, "{words}: {}", apart.between);
            assert!(typical.0 < 0.5 && typical.1 < 2.0, "{words}: {typical:?}");
            assert!(most.0 < 10.0 && most.1 < 20.0, "{words}: {most:?}");
            assert!(apart.ahead.len() > 15_000);
            assert!(ahead.0 < 0.5 && ahead.1 < 0.5, "{words}: {ahead:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn over_any_network_and_with_any_object_updates_give_the_hand_no_energy(
        seed in 1..u64::MAX,
        up_ms in 0..1500_u64,
        down_ms in 0..1500_u64,
        jitter in 0.0..1.0_f64,
        loss in 0..60_u64,
        stiffness in 300.0..3000.0_f64,
        shake_m in 0.0..3e-3_f64,
    ) {
        let words = |delay: u64| {
            let jitter = (jitter * delay.min(60) as f64) as u64;
            format!("delay {delay}ms {jitter}ms order free loss {loss}%")
        };
        let mut config = over("", seed);
        (config.up, config.down) = (link(&words(up_ms)), link(&words(down_ms)));
        config.stiffness_n_per_m = Some(stiffness);
        config.operator.hand.tremor_m = shake_m;
        let mut draw = Substream::new(seed, "test/object", 0);
        let mut world = World::try_new(&config).unwrap();
        let mut applied = 0;
        for tick in 0..10_000 {
            if tick % 500 == 499 {
                let environment = world.environment_mut();
                environment.set_mass(draw.uniform_in(0.3, 3.0)).unwrap();
                environment.set_friction(draw.uniform_in(0.05, 0.8)).unwrap();
            }
            world.step();
            applied = world.master().applied().iter().sum();
        }
        let outcome = world.outcome();
        prop_assert!(applied > 0, "no update was applied");
        prop_assert!(outcome.energy_injected_j < 1e-9, "{} J", outcome.energy_injected_j);
        prop_assert!(outcome.observer_min_j >= -1e-3, "{} J", outcome.observer_min_j);
    }
}
