//! Each experiment at small extent: a law of its result, and that its columns show what their keys name.

mod architectures;
mod columns;
mod random_worlds;

use std::collections::BTreeMap;
use std::time::Duration;

use mmt_shared::model::settings::Mode;

use super::readings::READINGS;
use super::*;
use crate::experiment::description::Request;
use crate::experiment::findings::{Extent, Findings};
use crate::io::{Folder, Runner};
use crate::setting::{Curve, paper_world};

/// What an experiment found with one seed, and the folder with its files.
struct Done {
    findings: Findings,
    folder: tempfile::TempDir,
}

/// A row of a file by key.
type Row = BTreeMap<String, String>;

impl Done {
    fn of(experiment: &Experiment, milliseconds: u64) -> Self {
        Self::of_seeds(experiment, 1, milliseconds)
    }

    fn of_seeds(experiment: &Experiment, seeds: u64, milliseconds: u64) -> Self {
        Self::given(experiment, seeds, milliseconds, BTreeMap::new())
    }

    /// With these arguments of its own.
    fn given(
        experiment: &Experiment,
        seeds: u64,
        milliseconds: u64,
        given: BTreeMap<&'static str, f64>,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let quiet = |_: &str, _: usize, _: usize| {};
        let runner = Runner::new(Folder::open(folder.path()).unwrap(), None, &quiet);
        let request = Request {
            extent: Extent {
                seeds,
                duration: Duration::from_millis(milliseconds),
            },
            given,
        };
        let findings = (experiment.run)(&runner, &request).unwrap();
        Self { findings, folder }
    }

    /// The rows of a file where a column holds a word.
    fn rows(&self, file: &str, wanted: &[(&str, &str)]) -> Vec<Row> {
        let mut csv = csv::Reader::from_path(self.folder.path().join(file)).unwrap();
        let rows = csv.deserialize().map(|row| row.unwrap());
        let holds = |row: &Row| wanted.iter().all(|(key, word)| row[*key] == *word);
        let rows: Vec<Row> = rows.filter(holds).collect();
        assert!(!rows.is_empty(), "{file} has no row with {wanted:?}");
        rows
    }

    /// A number of the one row of a file where columns hold these words.
    fn number(&self, file: &str, wanted: &[(&str, &str)], key: &str) -> f64 {
        let rows = self.rows(file, wanted);
        assert_eq!(rows.len(), 1, "{file} {wanted:?}");
        number(&rows[0], key)
    }
}

fn number(row: &Row, key: &str) -> f64 {
    let text = &row[key];
    text.parse().unwrap_or_else(|_| panic!("{key} is `{text}`"))
}

#[test]
fn physics_meets_its_references() {
    let done = Done::of(&physics::PHYSICS, 1);
    for row in done.rows("physics.csv", &[]) {
        assert!(number(&row, "relative_error") < 0.012, "{row:?}");
    }
}

/// However stiff the coupling and wherever the hand; a contact that is stiffer than the session knows costs more.
#[test]
fn a_first_touch_costs_no_more_than_the_limit_from_any_start() {
    let done = Done::of_seeds(&touch::EXPERIMENT, 200, 1000);
    let most = |times: &str, key: &str| done.number("touch.csv", &[("times_k_p", times)], key);
    for times in ["0.3", "1"] {
        let peak = most(times, "peak_most_n");
        assert!((1.0..15.0).contains(&peak), "{peak} N at {times} k_p");
    }
    assert!(most("10", "peak_most_n") > most("1", "peak_most_n"));
    for times in ["0.3", "1", "2", "5", "10"] {
        let (speed, acceleration) = (
            most(times, "speed_most_m_per_s"),
            most(times, "acceleration_most_m_per_s2"),
        );
        assert!(speed <= 0.6 + 1e-3, "{speed} m/s");
        assert!((1.0..20.01).contains(&acceleration), "{acceleration} m/s²");
    }
}

/// The reading in which nothing is otherwise is the claims' own experiment; every reading judges each claim once.
#[test]
fn the_text_s_own_reading_is_what_the_claims_are_judged_by() {
    let readings = Done::of(&readings::EXPERIMENT, 1000);
    let claims = Done::of(&claims::CLAIMS, 1000);
    let of_text = readings.rows("readings.csv", &[("otherwise", "")]);
    for row in &of_text {
        let claim = &claims.rows("claims.csv", &[("claim", &row["claim"])])[0];
        for key in ["value", "low", "high"] {
            assert_eq!(row[key], claim[key], "{key} of {}", row["claim"]);
        }
        // a check has no verdict in a reading
        assert!(["", &claim["verdict"]].contains(&&row["verdict"][..]));
    }
    assert!(of_text.iter().any(|row| !row["value"].is_empty()));
    let all = readings.rows("readings.csv", &[]);
    assert_eq!(all.len(), 32 * of_text.len());
    for tally in readings.rows("readings-claims.csv", &[]) {
        let verdicts = ["holds", "tie", "undecided", "fails"].map(|key| number(&tally, key));
        assert_eq!(verdicts.iter().sum::<f64>(), 32.0, "{tally:?}");
    }
}

/// Each choice makes the experiment another one.
#[test]
fn every_choice_of_a_reading_changes_the_world() {
    let scheme = Curve::Hybrid(150).at(0.1);
    let as_printed = paper_world(Mode::Paper, scheme);
    let mut worlds = vec![as_printed.clone()];
    for (name, change) in &READINGS {
        let mut world = as_printed.clone();
        change(&mut world);
        assert!(!worlds.contains(&world), "{name}");
        worlds.push(world);
    }
}

#[test]
fn fig5_sends_less_and_errs_more_with_a_wider_deadband() {
    let done = Done::of(&fig5::FIG5, 6000);
    for (mode, sensing) in [
        ("paper", "touch"),
        ("paper", "vision"),
        ("recommended", "vision"),
    ] {
        let at = |delta: &str, key: &str| {
            let wanted = [
                ("mode", mode),
                ("sensing", sensing),
                ("scheme", "deadband"),
                ("deadband", delta),
            ];
            done.number("fig5.csv", &wanted, key)
        };
        let (fine, coarse) = ("0.025", "0.3");
        assert!(at(fine, "packet_rate_hz") > 1.5 * at(coarse, "packet_rate_hz"));
        assert!(at(fine, "pmse") < at(coarse, "pmse"), "{mode}");
    }
}

/// An oracle that may use what comes later sends less than a scheme that may not, and more where the error must be smaller.
#[test]
fn bound_is_below_every_scheme() {
    let done = Done::of(&bound::EXPERIMENT, 8000);
    let rows = done.rows("bound.csv", &[]);
    assert_eq!(rows.len(), 6);
    for row in rows {
        let [updates, contact, judged, fewest, when_off] = [
            "updates",
            "contact_updates",
            "judged_updates",
            "fewest",
            "when_off",
        ]
        .map(|key| number(&row, key));
        for truth in [fewest, when_off] {
            assert!((1.0..updates).contains(&truth), "{row:?}");
        }
        assert!(contact <= updates && judged <= updates, "{row:?}");
        assert!((number(&row, "ratio") - updates / fewest).abs() < 1e-12);
        assert!((0.001..1.0).contains(&number(&row, "epsilon_n")), "{row:?}");
        assert!((1.0..8.0).contains(&number(&row, "judged_s")), "{row:?}");
    }
}

#[test]
fn fig6_and_fig7_are_of_one_run_sample_by_sample() {
    for (experiment, timed) in [(&traces::FIG6, false), (&traces::FIG7, true)] {
        let done = Done::of(experiment, 5000);
        let rows = done.rows(&format!("{}.csv", experiment.name), &[]);
        assert_eq!(rows.len(), 5000);
        let sent: Vec<&Row> = rows
            .iter()
            .filter(|row| !row["update"].is_empty())
            .collect();
        assert!(sent.len() > 10);
        assert_eq!(sent.iter().any(|row| row["update"] == "timer"), timed);
        let gaps = sent
            .windows(2)
            .map(|pair| number(pair[1], "t_s") - number(pair[0], "t_s"));
        let longest = gaps.fold(0.0, f64::max);
        assert_eq!(longest < 0.1505, timed, "{longest}");
    }
}

#[test]
fn claims_keep_the_lower_bounds_that_the_timer_sets() {
    let done = Done::of(&claims::CLAIMS, 3000);
    for (claim, least) in [
        ("lower bound, hybrid 50 ms", 19.9),
        ("lower bound, hybrid 150 ms", 6.6),
    ] {
        let rows = done.rows("claims.csv", &[("claim", claim)]);
        assert!(number(&rows[0], "value") > least, "{rows:?}");
        assert_eq!(rows[0]["verdict"], "kept");
    }
    assert_eq!(done.rows("claims.csv", &[]).len(), 25);
}

#[test]
fn ablation_without_a_timer_in_free_space_sends_less() {
    let done = Done::of(&ablation::ABLATION, 1500);
    let rate = |variant| {
        let wanted = [("variant", variant), ("scheme", "hybrid 50 ms")];
        done.number("ablation.csv", &wanted, "rate_30")
    };
    assert!(rate("timer in contact only") < 0.8 * rate("as stated"));
    assert_eq!(done.rows("ablation.csv", &[]).len(), 19 * 3);
}

#[test]
fn schemes_that_send_every_sample_send_a_thousand_a_second_and_the_others_less() {
    let done = Done::of(&schemes::SCHEMES, 4000);
    for row in done.rows("schemes.csv", &[]) {
        let rate = number(&row, "packet_rate_hz");
        assert_eq!(rate > 999.0, row["scheme"] == "every-sample", "{row:?}");
    }
}

#[test]
fn scenarios_with_a_wrong_side_place_the_model_worse() {
    let done = Done::of(&scenarios::EXPERIMENT, 6000);
    for mode in ["paper", "recommended"] {
        let error = |scenario| {
            let wanted = [("mode", mode), ("scenario", scenario)];
            done.number("scenarios.csv", &wanted, "position_rms_mm")
        };
        assert!(error("side-0") < error("side-20"), "{mode}");
    }
}

/// The default sensor's forces pass as they are, 0.1 N of noise is no contact where noise is reckoned with, and a gain is found.
#[test]
fn sensing_judges_by_the_true_force_and_conditioning_changes_nothing_that_is_sound() {
    let done = Done::of(&sensing::EXPERIMENT, 8000);
    let with = |find_gain, conditioned, sensor, key| {
        let wanted = [
            ("mode", "recommended"),
            ("conditioned", conditioned),
            ("find_gain", find_gain),
            ("sensor", sensor),
        ];
        done.number("sensing.csv", &wanted, key)
    };
    let of = |conditioned, sensor, key| with("no", conditioned, sensor, key);
    for key in ["packet_rate_hz", "pmse_true", "relative_error_true"] {
        assert_eq!(
            of("yes", "10 mN of noise", key),
            of("no", "10 mN of noise", key)
        );
    }
    for sensor in ["noise 0.1 N", "bias 0.2 N", "noise, bias, drift, lag"] {
        assert!(of("yes", sensor, "relative_error_true") < 0.25, "{sensor}");
        assert!(of("no", sensor, "relative_error_true") > 0.3, "{sensor}");
    }
    for sensor in ["gain 1.1", "gain 0.9", "all, gain 1.1", "all, gain 0.9"] {
        let [without, found] = ["no", "yes"].map(|find| with(find, "yes", sensor, "pmse_true"));
        assert!(found < 0.8 * without, "{sensor}: {found} and {without}");
    }
    assert_eq!(done.rows("sensing.csv", &[]).len(), 44);
}

#[test]
fn stiffness_that_is_the_rendered_one_changes_nothing_a_compliant_tool_mends_a_stiffer_one_and_telling_a_softer_one()
 {
    let done = Done::of(&stiffness::EXPERIMENT, 8000);
    let of = |tool, times, key| {
        done.number(
            "stiffness.csv",
            &[("tool", tool), ("times_k_p", times)],
            key,
        )
    };
    assert_eq!(of("stiff", "1", "pmse_ratio"), 1.0);
    for times in ["5", "10"] {
        let [stiff, compliant] = ["stiff", "compliant"].map(|tool| of(tool, times, "pmse_true"));
        assert!(compliant < 0.8 * stiff, "{times}: {compliant} and {stiff}");
    }
    // a device that is told the stiffness it has changes nothing; one that is told a softer one mends it
    for key in ["pmse_true", "packet_rate_hz", "relative_error_true"] {
        assert_eq!(of("told", "1", key), of("stiff", "1", key), "{key}");
    }
    for times in ["0.3", "0.5"] {
        let [stiff, told] = ["stiff", "told"].map(|tool| of(tool, times, "pmse_true"));
        assert!(told < 0.8 * stiff, "{times}: {told} and {stiff}");
        assert!(of("told", times, "pmse_ratio") <= 2.0, "{times}");
    }
}

#[test]
fn tupdate_sends_less_with_a_longer_period() {
    let done = Done::of(&tupdate::TUPDATE, 2500);
    for scheme in ["hybrid", "useful"] {
        let rate = |ms| {
            let wanted = [
                ("trajectory", "default"),
                ("ground", "plain"),
                ("scheme", scheme),
                ("time_ms", ms),
            ];
            done.number("tupdate.csv", &wanted, "packet_rate_hz")
        };
        assert!(
            rate("10") > rate("100") && rate("100") >= rate("2000"),
            "{scheme}"
        );
    }
    assert_eq!(done.rows("tupdate-adaptive.csv", &[]).len(), 9);
}

#[test]
fn repeats_change_nothing_but_the_traffic_where_nothing_is_lost() {
    let done = Done::of(&repeats::REPEATS, 4000);
    for row in done.rows("repeats.csv", &[("loss", "0")]) {
        assert_eq!(number(&row, "error_ratio"), 1.0, "{row:?}");
        assert_eq!(number(&row, "repeated") > 0.0, row["repeats"] != "none");
    }
}

#[test]
fn congestion_that_is_answered_leaves_the_queue_short() {
    let done = Done::of(&congestion::CONGESTION, 16_000);
    let longest = |answers| {
        let rows = done.rows("congestion.csv", &[("answers", answers)]);
        let trips = rows.iter().filter(|row| number(row, "t_s") > 13.0);
        let trips = trips.map(|row| number(row, "round_trip_ms"));
        trips.fold(0.0, f64::max)
    };
    assert!(longest("nobody") > 2.0 * longest("both"));
    assert_eq!(done.findings.configuration.len(), 3);
}

#[test]
fn netem_does_what_follows_from_the_words_of_its_presets_by_formula() {
    let done = Done::of(&netem::NETEM, 10_000);
    // the others wait in long bursts, of which ten seconds hold too few
    for preset in [
        "lan",
        "4g",
        "5g",
        "5g-up",
        "5g-down",
        "geo",
        "transatlantic",
    ] {
        let of = |key| done.number("netem.csv", &[("preset", preset)], key);
        let (formula, free) = (of("mean_ms"), of("mean_ms_free"));
        assert!((free / formula - 1.0).abs() < 0.05, "{preset}: {free} ms");
        assert!(of("mean_ms_achieved") >= 0.99 * free, "order only adds");
        let step = |key| done.number("netem-steps.csv", &[("preset", preset)], key);
        let (formula, achieved) = (step("step_rms_ms"), step("step_rms_ms_achieved"));
        assert!(
            (achieved / formula - 1.0).abs() < 0.05,
            "{preset}: steps of {achieved} ms, not {formula}"
        );
        assert!((9000.0..=10_000.0).contains(&of("packets")));
    }
}

#[test]
fn transport_of_ours_adds_nothing_at_random_loss() {
    let done = Done::of(&transport::TRANSPORT, 200);
    let plain = [
        ("outage_ms", "0"),
        ("bottleneck_mbit_per_s", ""),
        ("stack", "ours"),
    ];
    for row in done.rows("transport.csv", &plain) {
        assert_eq!(number(&row, "added_max_ms"), 0.0, "{row:?}");
    }
    // 2 stacks × 3 flows × 3 round trips × 4 losses × 3 jitters × 2 × 2
    assert_eq!(done.rows("transport.csv", &[]).len(), 864);
    let rows = done
        .findings
        .tables
        .iter()
        .map(|table| table.rows().count());
    assert_eq!(rows.collect::<Vec<_>>(), [3, 14, 24]);
}
