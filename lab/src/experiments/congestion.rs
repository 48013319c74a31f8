//! The deadband as a rate controller at a bottleneck of 64 kbit/s: what congestion does if nobody, the master or both
//! answer it.
//!
//! The live defaults over 50 ms one way. From 10 to 25 s each direction passes a bottleneck with a second of queue.

mod bins;
mod figure;
mod phases;

use mmt_shared::channel::rate_control::StretchMax;

use super::loss::{Loss, link};
use crate::digest::of_runs;
use crate::experiment::prelude::*;
use bins::{Bin, Variant, per_second};

/// Each direction; the 58 bytes are the headers of IPv4, UDP and QUIC.
const NETWORK: &str = "delay 50ms; at 10s delay 50ms rate 64kbit 58 queue 1s; at 25s delay 50ms";
/// Who answers congestion: nobody, the master with its samples alone, both; greatest stretches of master and slave.
const VARIANTS: [(&str, StretchMax, StretchMax); 3] = [
    ("nobody", StretchMax::OFF, StretchMax::OFF),
    ("master", StretchMax::RECOMMENDED, StretchMax::OFF),
    ("both", StretchMax::RECOMMENDED, StretchMax::RECOMMENDED),
];

/// Rate control at a bottleneck, with time to come back.
pub(super) const CONGESTION: Experiment = Experiment {
    duration: Duration::from_secs(40),
    ..Experiment::new(
        "congestion",
        "The deadband as rate controller at a bottleneck of 64 kbit/s, with and without",
        10,
        run,
    )
};

/// The live defaults over that network, with these greatest stretches of master and slave.
fn world(master: StretchMax, slave: StretchMax) -> Result<WorldConfig, ExperimentError> {
    let link = link(NETWORK, Loss::NONE)?;
    Ok(WorldConfig::over(link).stretched(master, slave))
}

/// Keeps `congestion.csv` (a row a bin) and `congestion.svg` (the first seed).
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let variants = VARIANTS.map(|(name, master, slave)| {
        let world = world(master, slave)?;
        Ok(Variant { name, world })
    });
    let variants: Result<Vec<Variant>, ExperimentError> = variants.into_iter().collect();
    let groups = runner.grid("congestion", extent.seeds, variants?, |variant, seed| {
        bins::run(&variant.world.clone().seeded(seed), extent.duration)
    })?;
    let runs = grid::runs(&groups, runner.first_seed());
    let bins = runs.iter().flat_map(|run| {
        let bins = run.measured.bins.iter();
        bins.map(move |bin| (run.case.name, run.seed, bin))
    });
    let bins: Vec<BinRow> = bins.collect();
    let table = Table::of("Congestion, bin by bin", &bins, &columns());
    runner.keep_table("congestion.csv", &table)?;
    runner.keep_figure("congestion.svg", &figure::figure(&groups))?;
    Ok(Findings {
        digest: of_runs(runs.iter().map(|run| run.measured.digest.as_str())),
        tables: vec![phases::table(&groups)],
        configuration: groups.into_iter().map(|group| group.case.world).collect(),
    })
}

/// Who answered, the seed, and one of the bins.
type BinRow<'a> = (&'static str, u64, &'a Bin);

#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, BinRow<'a>>; 13] {
    [
        column("answers", "", 0, |(name, _, _)| *name),
        column("seed", "", 0, |(_, seed, _)| *seed),
        column("t_s", "s", 2, |(_, _, bin)| bin.t_s),
        column("round_trip_ms", "ms", 1, |(_, _, bin)| bin.round_trip_ms),
        column("delta", "", 3, |(_, _, bin)| bin.delta),
        column("t_update_ms", "ms", 0, |(_, _, bin)| bin.t_update_ms),
        column("commands_hz", "Hz", 0, |(_, _, bin)| per_second(bin.commands)),
        column("updates_hz", "Hz", 0, |(_, _, bin)| per_second(bin.updates)),
        column("messages_hz", "Hz", 0, |(_, _, bin)| per_second(bin.messages)),
        column("kbit_up_per_s", "kbit/s", 1, |(_, _, bin)| bin.kbit_per_s(bin.bits_up)),
        column("kbit_down_per_s", "kbit/s", 1, |(_, _, bin)| bin.kbit_per_s(bin.bits_down)),
        column("dropped", "", 0, |(_, _, bin)| bin.dropped),
        column("relative_error", "", 3, |(_, _, bin)| bin.relative_error()),
    ]
}

#[cfg(test)]
mod tests {
    use super::bins::{FROM_S, UNTIL_S};
    use super::*;
    use mmt_shared::channel::rate_control::StretchMax;
    use mmt_shared::stats::values::median;

    const DURATION: Duration = Duration::from_secs(45);

    fn run_of(master: StretchMax, slave: StretchMax) -> Vec<Bin> {
        let config = world(master, slave).unwrap().seeded(1);
        bins::run(&config, DURATION).unwrap().bins
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
                bins::run(&config, Duration::from_secs(15)).unwrap().digest
            };
            assert_eq!(
                digest(StretchMax::OFF),
                digest(StretchMax::RECOMMENDED),
                "{words}"
            );
        }
    }
}
