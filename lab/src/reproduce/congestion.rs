//! The deadband as a rate controller at a bottleneck of 64 kbit/s: what congestion does if nobody, the master or both
//! answer it.
//!
//! The live defaults over 50 ms one way. From 10 to 25 s each direction passes a bottleneck with a second of queue.

mod figure;
mod grid;
mod run;
mod tables;

use super::{Extent, Findings, Laboratory, ReproduceError};
use crate::digest::of_runs;
use figure::figure;
use grid::{VARIANTS, world};
use run::{Run, Variant, run};
use tables::{bins, phases};

/// Runs every variant over the seeds and keeps `congestion.csv` (a row a bin) and `congestion.svg` (seed 1).
///
/// # Errors
/// As [`Laboratory::keep`]; when a world is not accepted.
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let mut variants: Vec<Variant> = Vec::new();
    for (name, master, slave) in VARIANTS {
        let config = world(master, slave)?;
        let runs =
            (1..=extent.seeds).map(|seed| run(&config.clone().seeded(seed), extent.duration));
        let runs: Vec<Run> = runs.collect::<Result<_, _>>()?;
        variants.push((name, config, runs));
    }
    laboratory.keep("congestion.csv", &bins(&variants).to_csv())?;
    laboratory.keep_figure("congestion.svg", &figure(&variants))?;
    let phases = phases(&variants);
    let runs = variants.iter().flat_map(|(_, _, runs)| runs);
    let digest = of_runs(runs.map(|run| run.digest.as_str()));
    Ok(Findings {
        experiment: "congestion",
        extent,
        digest,
        configuration: variants.into_iter().map(|(_, config, _)| config).collect(),
        tables: vec![phases],
    })
}

#[cfg(test)]
mod tests {
    use super::grid::{FROM_S, UNTIL_S};
    use super::run::Bin;
    use super::*;
    use crate::statistics::median;
    use mmt_shared::channel::rate_control::StretchMax;
    use std::time::Duration;

    const DURATION: Duration = Duration::from_secs(45);

    fn run_of(master: StretchMax, slave: StretchMax) -> Vec<Bin> {
        let config = world(master, slave).unwrap().seeded(1);
        run(&config, DURATION).unwrap().bins
    }

    fn within(bins: &[Bin], from_s: f64, until_s: f64) -> impl Iterator<Item = &Bin> {
        let of = move |bin: &&Bin| bin.t_s > from_s && bin.t_s <= until_s;
        bins.iter().filter(of)
    }

    fn round_trip(bins: &[Bin]) -> f64 {
        median(within(bins, FROM_S + 3.0, UNTIL_S).filter_map(|bin| bin.round_trip_ms)).unwrap()
    }

    #[test]
    fn who_answers_congestion_has_a_short_queue_and_comes_back_to_what_was_configured() {
        let nobody = run_of(StretchMax::OFF, StretchMax::OFF);
        let both = run_of(StretchMax::RECOMMENDED, StretchMax::RECOMMENDED);
        let dropped = |bins: &[Bin]| bins.iter().map(|bin| bin.dropped).sum::<u64>();
        let (without, with) = (round_trip(&nobody), round_trip(&both));
        println!(
            "round trip {without} ms and {with} ms, dropped {} and {}",
            dropped(&nobody),
            dropped(&both)
        );
        assert!(without > 1000.0 && with < 200.0, "{without} ms, {with} ms");
        assert!(dropped(&nobody) > 500 && dropped(&both) < 50);
        assert!(
            nobody
                .iter()
                .all(|bin| (bin.delta, bin.t_update_ms) == (0.10, 150.0))
        );

        // all three rates give way, to their bounds and no further, and come back
        let most = |of: fn(&Bin) -> f64| both.iter().map(of).fold(0.0, f64::max);
        assert!((most(|bin| bin.delta) - 0.30).abs() < 1e-12);
        assert!((most(|bin| bin.t_update_ms) - 450.0).abs() < 1e-6);
        let least = within(&both, FROM_S + 3.0, UNTIL_S)
            .map(|bin| bin.commands)
            .min();
        assert_eq!(least, Some(8), "a third of 25 in a quarter of a second");
        let last = both.last().unwrap();
        assert_eq!(
            (last.delta, last.t_update_ms, last.commands),
            (0.10, 150.0, 25)
        );
    }

    #[test]
    fn without_a_queue_rate_control_changes_nothing() {
        for words in [
            "delay 50ms",
            "delay 50ms 20ms",
            "delay 50ms loss 20%",
            "delay 400ms loss burst 5% 100ms",
        ] {
            let digest = |stretch_max| {
                let mut config = world(stretch_max, stretch_max).unwrap();
                (config.up, config.down) = (words.parse().unwrap(), words.parse().unwrap());
                run(&config, Duration::from_secs(15)).unwrap().digest
            };
            assert_eq!(
                digest(StretchMax::OFF),
                digest(StretchMax::RECOMMENDED),
                "{words}"
            );
        }
    }
}
