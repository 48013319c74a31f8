//! Whatever state was accepted and wherever the hand goes: the box stays finite and dissipates.

use super::*;
use crate::fixtures;
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Pose, Twist};
use crate::model::params::{
    DAMPING_NS_PER_M, FACE_OFFSET_M, FRICTION_N, FRICTION_TORQUE_NM, INERTIA_KG_M2, MASS_KG,
    least_stable_inertia, least_stable_mass,
};
use crate::model::settings::{CONTACT_DAMPING_NS_PER_M, FrictionLaw, Mode, STIFFNESS_N_PER_M};
use crate::model::tool::TOOL_FORCE_MAX_N;
use crate::rng::Substream;
use proptest::prelude::*;

/// From the least to the greatest, each power of ten alike, now and then exactly an end of the range.
fn anywhere(draw: &mut Substream, least: f64, most: f64) -> f64 {
    let share = draw.uniform_in(-0.2, 1.2).clamp(0.0, 1.0);
    (least * libm::pow(most / least, share)).clamp(least, most)
}

/// Like [`anywhere`] in a range from 0: zero and subnormal numbers are drawn as well.
fn from_zero(draw: &mut Substream, most: f64) -> f64 {
    match draw.uniform_in(0.0, 6.0) as u32 {
        0 => 0.0,
        1 => 5e-324,
        2 => anywhere(draw, 1e-300, most),
        _ => anywhere(draw, 1e-3, most),
    }
}

/// Settings and a state that are accepted with them.
fn any_accepted(draw: &mut Substream) -> (ModelSettings, ModelState) {
    let coupling = Coupling {
        stiffness_n_per_m: anywhere(draw, STIFFNESS_N_PER_M.0, STIFFNESS_N_PER_M.1),
        damping_ns_per_m: from_zero(draw, CONTACT_DAMPING_NS_PER_M.1),
    };
    let footprint = BoxFootprint {
        east: anywhere(draw, FACE_OFFSET_M.0, FACE_OFFSET_M.1),
        north: anywhere(draw, FACE_OFFSET_M.0, FACE_OFFSET_M.1),
        west: anywhere(draw, FACE_OFFSET_M.0, FACE_OFFSET_M.1),
        south: anywhere(draw, FACE_OFFSET_M.0, FACE_OFFSET_M.1),
    };
    let b = from_zero(draw, DAMPING_NS_PER_M.1);
    let m = anywhere(
        draw,
        least_stable_mass(b, &coupling).max(MASS_KG.0),
        MASS_KG.1,
    );
    let least = least_stable_inertia(&footprint, &coupling).max(INERTIA_KG_M2.0);
    let inertia = anywhere(draw, least, INERTIA_KG_M2.1);
    let (c, e) = (
        from_zero(draw, FRICTION_N.1),
        from_zero(draw, FRICTION_TORQUE_NM.1),
    );
    let params = ModelParams::try_new(m, b, c, inertia, e, &coupling).unwrap();
    let state = ModelState::try_new(
        params,
        footprint,
        Pose::default(),
        Twist::default(),
        &coupling,
    );
    let mode = if draw.uniform_in(0.0, 1.0) < 0.5 {
        Mode::Paper
    } else {
        Mode::Recommended
    };
    (mode.model_settings(coupling), state.unwrap())
}

/// A hand that rests, drifts, shakes, jumps about the box and jumps to the end of the world.
fn hostile(draw: &mut Substream, model: &LocalModel, hip: Vec2) -> Vec2 {
    let near = |draw: &mut Substream, most: f64| {
        Vec2::new(draw.uniform_in(-most, most), draw.uniform_in(-most, most))
    };
    match draw.uniform_in(0.0, 200.0) as u32 {
        0 => near(draw, 214.0),
        1..=3 => model.state().pose.position + near(draw, 1.5),
        4..=60 => hip + near(draw, 1e-3),
        61..=80 => hip + near(draw, 0.05),
        _ => hip,
    }
}

fn finite(model: &LocalModel) -> bool {
    let force = model.rendered().force;
    model.body.is_finite() && force.x.is_finite() && force.y.is_finite()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_accepted_state_stays_finite_under_ten_seconds_of_a_hostile_hand(seed in any::<u64>()) {
        let mut draw = Substream::new(seed, "test/hostile", 0);
        let (settings, start) = any_accepted(&mut draw);
        let mut model = LocalModel::new(settings, start, TOOL_FORCE_MAX_N);
        let mut hip = Vec2::new(-start.footprint().west - 0.01, 0.0);
        for n in 1..=10_000 {
            hip = hostile(&mut draw, &model, hip);
            if draw.uniform_in(0.0, 1.0) < 0.01 {
                // another accepted state, whose faces and parameters reach the model at different times
                let (_, other) = any_accepted(&mut draw);
                let params = other.params().to_array();
                let [m, b, c, i, e] = params;
                let coupling = &settings.coupling;
                let state = ModelParams::try_new(m, b, c, i, e, coupling).and_then(|params| {
                    let (pose, twist) = (Pose::default(), Twist::new(0.3, -0.2, 2.0));
                    ModelState::try_new(params, other.footprint(), pose, twist, coupling)
                });
                let causes = Cause::ALL;
                let cause = causes[draw.uniform_in(0.0, causes.len() as f64) as usize];
                if let Ok(state) = state {
                    model.apply(&fixtures::update(1, cause, n - 1, state));
                }
            }
            model.step(Time::from_millis(n), hip);
            prop_assert!(finite(&model) && model.not_finite() == 0, "tick {n}: {:?}", model.state());
        }
    }

    #[test]
    fn any_accepted_box_dissipates_what_a_shaking_hand_puts_in(seed in any::<u64>()) {
        let mut draw = Substream::new(seed, "test/dissipates", 0);
        let (settings, start) = any_accepted(&mut draw);
        let mut model = LocalModel::new(settings, start, TOOL_FORCE_MAX_N);
        let depth = 0.2 * start.footprint().west.min(0.02);
        let lateral = draw.uniform_in(-0.9, 0.9);
        let lateral = lateral * start.footprint().north.min(start.footprint().south);
        let rate = draw.uniform_in(1.0, 12.0);
        let params = start.params();
        // explicit friction leaves a body at rest trembling by one step of its own
        let trembles = |friction: f64, inertia: f64| 0.5 * (friction * 1e-3).powi(2) / inertia;
        let trembling = if settings.friction == FrictionLaw::Sign {
            trembles(params.c(), params.m()) + trembles(params.e(), params.inertia())
        } else {
            0.0
        };
        let hip = |n: u64| {
            let t = n as f64 * 1e-3;
            let x = depth * libm::sin(std::f64::consts::TAU * rate * t);
            Vec2::new(-start.footprint().west + x, lateral)
        };
        let mut put_in = 0.0;
        for n in 1..=10_000 {
            let force = model.step(Time::from_millis(n), hip(n)).force;
            // the work of the hand, and what a spring gives back whose force is held for a tick
            let way = hip(n + 1) - hip(n);
            put_in += force.dot(&way) + settings.coupling.energy(way.norm());
            let has = model.body.energy_j(&settings.coupling, Some(hip(n + 1)));
            let spring = settings.coupling.energy(depth);
            prop_assert!(
                has <= put_in + trembling + 0.2 * spring,
                "tick {n}: {has} J, put in {put_in} J, spring {spring} J, trembling {trembling} J: {:?} {:?}",
                settings, start
            );
        }
        prop_assert!(finite(&model));
    }
}

#[test]
fn a_light_turntable_and_a_friction_next_to_nothing_are_no_danger() {
    let footprint = BoxFootprint::square(0.4);
    let state = |inertia, c| {
        let params = ModelParams::try_new(0.7, 3.0, c, inertia, 0.28, &COUPLING)?;
        ModelState::try_new(
            params,
            footprint,
            Pose::default(),
            Twist::default(),
            &COUPLING,
        )
    };
    let error = state(3e-6, 2.06).unwrap_err().to_string();
    assert!(
        error.starts_with("inertia 0.000003 kg m^2 is below 0.00084"),
        "{error}"
    );
    let settings = Mode::Recommended.model_settings(COUPLING);
    assert_eq!(settings.friction, FrictionLaw::LimitSurface);
    let mut model = LocalModel::new(settings, state(0.0187, 5e-324).unwrap(), TOOL_FORCE_MAX_N);
    push(&mut model, 1..=2000);
    assert!(finite(&model) && model.not_finite() == 0);
}

#[test]
fn a_number_that_is_none_leaves_the_last_good_box_and_no_force() {
    let mut model = model(Mode::Recommended, PoseCorrection::Replay);
    push(&mut model, 1..=500);
    let good = model.state().pose;
    model.settings.coupling.stiffness_n_per_m = f64::INFINITY;
    assert_eq!(push(&mut model, 501..=501), Rendered::default());
    assert_eq!(model.not_finite(), 1);
    assert!((model.state().pose.position - good.position).norm() < 1e-9);
    assert_eq!(model.state().twist, Twist::default());
}
