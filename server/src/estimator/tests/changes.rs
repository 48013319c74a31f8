//! An object that changes in mid-push, or runs against something.

use super::*;

/// Ticks from a change of the object in mid-push until m, b, c stay within 10 %: medians of ten seeds.
fn following(make: impl Fn() -> Estimator, change: impl Fn(&mut [f64; 3])) -> [f64; 3] {
    let mut last = [vec![], vec![], vec![]];
    for seed in 0..10 {
        let (mut estimator, mut plant) = (make(), Plant::new(seed, Noise::DEFAULT));
        let mut off = [0.0; 3];
        for number in 0..3 {
            let motion = Motion::of_operator(seed, number);
            push(&mut estimator, &mut plant, &motion, |k, plant, estimate| {
                if number < 2 || k < 1000 {
                    return;
                }
                if k == 1000 {
                    change(&mut plant.params);
                }
                let e = errors(values(estimate), plant.params);
                for (off, e) in off.iter_mut().zip(e) {
                    if e > 0.1 {
                        *off = f64::from(k - 999);
                    }
                }
            });
        }
        last.iter_mut()
            .zip(off)
            .for_each(|(last, off)| last.push(off));
    }
    last.map(|ticks| median(&ticks))
}

#[test]
fn a_change_of_mu_in_mid_push_is_followed_in_120_ms() {
    let step = |params: &mut [f64; 3]| params[2] *= 0.45 / 0.30;
    let forgetting_alone = following(
        || {
            recommended(|config| {
                config.recursive.change = None;
                config.recursive.forgetting = 0.995;
            })
        },
        step,
    );
    let found = following(|| recommended(|_| {}), step);
    println!(
        "mu 0.30 to 0.45: m, b, c within 10 % after {found:?} ms, by forgetting 0.995 alone {forgetting_alone:?} ms"
    );
    assert!(forgetting_alone[2] > 400.0);
    assert!(found.iter().all(|ticks| *ticks <= 120.0));
}

#[test]
fn a_change_of_mass_in_mid_push_is_followed() {
    let found = following(
        || recommended(|_| {}),
        |params| {
            params[0] *= 1.5;
            params[2] *= 1.5;
        },
    );
    println!("mass 0.70 to 1.05: m, b, c within 10 % after {found:?} ms");
    assert!(found[0] <= 500.0 && found[1] <= 700.0 && found[2] <= 120.0);
}

#[test]
fn what_an_object_ran_against_is_forgotten_with_the_contact() {
    let (mut estimator, mut plant) = learned(1);
    let before = values(estimator.estimate());
    let motion = Motion::of_operator(1, 2);
    let mut in_contact = 0.0;
    push(&mut estimator, &mut plant, &motion, |k, plant, estimate| {
        if k == 1000 {
            // a wall along which it slides on
            plant.params[2] = 12.0;
        }
        in_contact = estimate.c;
    });
    let after = values(estimator.estimate());
    println!(
        "c {} N, at the wall {in_contact} N, then {} N",
        before[2], after[2]
    );
    assert!(in_contact > 10.0);
    let moved = errors(after, before);
    assert!(
        moved[0] < 0.05 && moved[2] < 0.05,
        "{before:?} to {after:?}"
    );
}
