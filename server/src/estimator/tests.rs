use super::plant::{COUPLING, Motion, Noise, Plant, TRUTH};
use super::recursive::ChangeTest;
use super::*;

fn errors(estimate: &Estimate, truth: [f64; 3]) -> [f64; 3] {
    [estimate.m, estimate.b, estimate.c]
        .iter()
        .zip(truth)
        .map(|(x, t)| (x / t - 1.0).abs())
        .collect::<Vec<_>>()
        .try_into()
        .unwrap()
}

#[test]
fn explore() {
    for (name, forgetting, change) in [
        ("0.995", 0.995, None),
        ("0.998", 0.998, None),
        ("0.999", 0.999, None),
        ("0.999+", 0.999, Some((0.98, 0.1, 0.03))),
        ("0.998+", 0.998, Some((0.98, 0.1, 0.03))),
        ("0.999+ 6%", 0.999, Some((0.98, 0.06, 0.02))),
        ("0.999+ 5% .99", 0.999, Some((0.99, 0.05, 0.03))),
        ("0.998+ 5%", 0.998, Some((0.985, 0.05, 0.02))),
    ] {
        let mut all = [vec![], vec![], vec![]];
        let (mut first, mut track) = (vec![], vec![]);
        let (mut exc, mut n, mut cond) = (0.0, 0.0, vec![]);
        for seed in 0..20 {
            let mut config = RecommendedConfig::new(COUPLING);
            config.recursive.forgetting = forgetting;
            config.recursive.change = change.map(|(f, e, a)| ChangeTest { error_share: e, after_s: a, forgetting: f });
            let mut est = RecommendedEstimator::new(&config);
            let mut plant = Plant::new(seed, Noise::DEFAULT);
            let mut bad = 0.0; let mut motion_ticks = 0.0;
            let mut worst_after = 0.0_f64;
            for push in 0..6 {
                let motion = Motion::of_operator(seed, push);
                for k in 0..2200 {
                    if push == 5 && k == 1000 { plant.params[2] *= 1.5; }
                    let x = plant.push(&motion);
                    let e = est.step(&x);
                    let er = errors(&e, plant.params);
                    if plant.velocity > 0.02 && push == 0 { motion_ticks += 1.0; if er.iter().any(|e| *e > 0.1) { bad = motion_ticks; } }
                    if push > 0 && push < 5 && e.samples > 0 && plant.velocity > 0.02 && k > 100 {
                        for i in 0..3 { all[i].push(er[i]); }
                        n += 1.0; if e.excited { exc += 1.0; }
                        cond.push(e.condition);
                    }
                    if push == 5 && k >= 1000 && er.iter().any(|e| *e > 0.1) { worst_after = f64::from(k) - 1000.0; }
                }
                plant.retract();
                for _ in 0..200 { est.step(&plant.push(&Motion::steady(0.0))); }
                plant.heading += 1.5;
            }
            first.push(bad); track.push(worst_after);
        }
        let q = |v: &mut Vec<f64>, p: f64| { v.sort_by(f64::total_cmp); v[((v.len() - 1) as f64 * p) as usize] };
        println!("{name:14} med {:.4} {:.4} {:.4} p95 {:.3} {:.3} {:.3} first {:.0}/{:.0} track {:.0}/{:.0} excited {:.2} cond {:.0}/{:.0}",
            q(&mut all[0], 0.5), q(&mut all[1], 0.5), q(&mut all[2], 0.5),
            q(&mut all[0], 0.95), q(&mut all[1], 0.95), q(&mut all[2], 0.95),
            q(&mut first, 0.5), q(&mut first, 0.9), q(&mut track, 0.5), q(&mut track, 0.9), exc / n, q(&mut cond, 0.5), q(&mut cond, 0.95));
    }
}
