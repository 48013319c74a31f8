//! Plans right and wrong, and rows however they are cut.

use mmt_server::trigger::Scheme;
use mmt_shared::model::settings::{Mode, PoseCorrection, Smoothing};

use super::*;
use crate::setting::{Curve, paper_world};
use crate::world::WorldConfig;

const HEAD: &str = "duration_s = 1\nseeds = { count = 2 }\n";

const GRID: &str = r#"
duration_s = 0.3
seeds = { first = 5, count = 2 }
start = "paper-experiment"

[base]
slave.mode = "paper"
[base.slave.environment]
mass_kg = 0.8

[[axis]]
key = "slave.trigger.scheme"
values = ["deadband 5%", "hybrid 10% 150ms"]

[[axis]]
keys = ["up", "down"]
values = [["none", "none"], ["delay 50ms", "delay 20ms loss 1%"], ["delay 1ms", "none"]]
"#;

fn plan(text: &str) -> Plan {
    Plan::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Checks that a plan is refused with a message that has these parts.
fn refuses(text: &str, parts: &[&str]) {
    let complaint = Plan::parse(text).unwrap_err().to_string();
    for part in parts {
        assert!(
            complaint.contains(part),
            "{part} is missing in: {complaint}"
        );
    }
}

fn points(text: &str) -> Vec<WorldConfig> {
    let plan = plan(text);
    let rows = (1..=plan.rows()).filter_map(|n| plan.row(n));
    rows.map(|row| row.trial.config).collect()
}

#[test]
fn a_key_of_thousands_of_parts_is_no_key() {
    let deep = "a.".repeat(5000);
    let axis = format!("{HEAD}[[axis]]\nkey = \"{deep}a\"\nvalues = [1]\n");
    refuses(&axis, &["line 4", "is no key"]);
}

#[test]
fn rows_are_the_product_of_the_axes_in_their_order_with_seeds_innermost() {
    let plan = plan(GRID);
    assert_eq!(plan.rows(), 12);
    let rows: Vec<Row> = (1..=12).filter_map(|n| plan.row(n)).collect();
    let written: Vec<String> = rows
        .iter()
        .map(|row| format!("{} {} {}", row.number, row.values.join("|"), row.seed))
        .collect();
    assert_eq!(written[0], "1 deadband 5%|none|none 5");
    assert_eq!(written[1], "2 deadband 5%|none|none 6");
    assert_eq!(written[2], "3 deadband 5%|delay 50ms|delay 20ms loss 1% 5");
    assert_eq!(written[6], "7 hybrid 10% 150ms|none|none 5");
    assert_eq!(written[11], "12 hybrid 10% 150ms|delay 1ms|none 6");
    assert!(plan.row(0).is_none() && plan.row(13).is_none());
    assert!(plan.keys().eq(["slave.trigger.scheme", "up", "down"]));
}

#[test]
fn a_row_is_the_start_with_base_and_values_laid_over_it() {
    let mut expected = paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10)).seeded(6);
    expected.slave.environment.mass_kg = 0.8;
    expected.up = "delay 50ms".parse().unwrap();
    expected.down = "delay 20ms loss 1%".parse().unwrap();
    assert_eq!(points(GRID)[9], expected);
    let live = points(HEAD);
    assert_eq!(live[0], WorldConfig::default());
    assert_eq!(live[1], WorldConfig::default().seeded(2));
}

#[test]
fn what_a_start_leaves_to_the_mode_is_the_modes_where_a_key_reaches_into_it() {
    let axis = "[[axis]]\nkey = \"slave.mode\"\nvalues = [\"paper\", \"recommended\"]\n";
    let modes = points(&format!("{HEAD}{axis}"));
    assert_eq!(modes[0].slave.trigger.scheme, paper_scheme());
    assert_eq!(modes[2].slave.mode, Mode::Recommended);
    assert!(modes.iter().all(|world| world.settings.is_none()));
    let snap = "[[axis]]\nkey = \"settings.correction\"\nvalues = [\"snap\"]\n";
    let stiff = "[base]\nstiffness_n_per_m = 500.0\n";
    let settings = points(&format!("{HEAD}{stiff}{axis}{snap}"))[2]
        .settings
        .unwrap();
    assert_eq!(settings.correction, PoseCorrection::Snap);
    assert_eq!(settings.smoothing, Smoothing::InTime { tau_s: 0.020 });
    assert_eq!(settings.coupling.stiffness_n_per_m, 500.0);
}

#[test]
fn a_device_of_another_stiffness_reaches_the_model_of_the_paper_s_experiment() {
    let stiff = "[[axis]]\nkey = \"stiffness_n_per_m\"\nvalues = [300.0]\n";
    let points = points(&format!("{HEAD}start = \"paper-experiment\"\n{stiff}"));
    let settings = points[0].settings.unwrap();
    assert_eq!(settings.coupling.stiffness_n_per_m, 300.0);
}

fn paper_scheme() -> Scheme {
    mmt_server::trigger::TriggerConfig::of_mode(Mode::Paper).scheme
}

#[test]
fn a_case_of_a_choice_replaces_another_case() {
    let axis = "[[axis]]\nkey = \"settings.smoothing\"\nvalues = [{ per-packet = { lambda = 0.25 } }, { in-time = { tau_s = 0.5 } }]\n";
    let smoothings: Vec<Smoothing> = points(&format!("{HEAD}{axis}"))
        .iter()
        .map(|world| world.settings.unwrap().smoothing)
        .collect();
    assert_eq!(smoothings[0], Smoothing::PerPacket { lambda: 0.25 });
    assert_eq!(smoothings[2], Smoothing::InTime { tau_s: 0.5 });
}

#[test]
fn a_wrong_key_or_value_is_reported_with_its_line_and_a_caret() {
    let base = |text: &str| format!("{HEAD}[base]\n{text}\n");
    let mistyped = base("slave.enviroment.mass_kg = 1.0");
    refuses(
        &mistyped,
        &[
            "line 4, column 7",
            "      ^^^^^^^^^^",
            "enviroment",
            "environment",
        ],
    );
    refuses(
        &base("slave.environment.mass_kg = \"heavy\""),
        &["line 4", "^^^^^^^", "heavy"],
    );
    refuses(
        &base("slave.environment.mass_kg = -1.0"),
        &["line 3", "^", "mass", "-1"],
    );
    refuses(&base("up = \"delay 50\""), &["line 4", "50"]);
    refuses(
        "duration_s = 1\nsseeds = 1\n",
        &["line 2", "sseeds", "^^^^^^"],
    );
    refuses("duration_s = 1\n", &["seeds"]);
    refuses(
        "duration_s = 0\nseeds = { count = 1 }\n",
        &["line 1", "0.001"],
    );
    refuses(
        "duration_s = 1\nseeds = { count = 0 }\n",
        &["line 2", "at least 1"],
    );
    refuses(
        "duration_s = 1\nseeds = { count = 1000001 }\n",
        &["1000001", "at most"],
    );
    refuses("duration_s = = 1", &["line 1"]);
    refuses(&format!("base = 3\n{HEAD}"), &["line 1", "table"]);
    refuses(
        &base("slave.seed = 3"),
        &["line 4", "slave.seed", "`seeds`"],
    );
}

#[test]
fn a_wrong_axis_is_reported_with_axis_key_and_value() {
    let axis =
        |key: &str, values: &str| format!("{HEAD}[[axis]]\nkey = \"{key}\"\nvalues = {values}\n");
    refuses(
        &axis("slave.trigger.schem", "[\"every-sample\"]"),
        &[
            "line 4",
            "^^^",
            "schem",
            "slave.trigger.schem = \"every-sample\"",
        ],
    );
    refuses(
        &axis("slave.trigger.scheme", "[\"deadband 5%\", \"deadbnd 5%\"]"),
        &[
            "line 5, column 26",
            "^^^^^^^^^^^^",
            "scheme = \"deadbnd 5%\"",
        ],
    );
    refuses(
        &axis("samples_per_command", "[1, \"two\"]"),
        &["line 5, column 14", "two"],
    );
    refuses(&axis("up", "[]"), &["line 5", "at least one value"]);
    refuses(&axis("up", "3"), &["line 5", "^"]);
    refuses(&axis("seed", "[1, 2]"), &["line 4", "`seeds`"]);
    refuses(&axis("slave..mode", "[1]"), &["line 4", "no key"]);
    let mass = axis("slave.environment.mass_kg", "[1.0, -2.0]");
    refuses(
        &mass,
        &[
            "line 5, column 16",
            "^^^^",
            "mass",
            "slave.environment.mass_kg = -2.0",
        ],
    );
    refuses(
        &format!("{HEAD}[[axis]]\nvalues = [1]\n"),
        &["line 3", "`key` or `keys`"],
    );
    let both = format!("{HEAD}[[axis]]\nkey = \"up\"\nkeys = [\"down\"]\nvalues = [1]\n");
    refuses(&both, &["`key` or `keys`"]);
    let short = format!("{HEAD}[[axis]]\nkeys = [\"up\", \"down\"]\nvalues = [[\"none\"]]\n");
    refuses(&short, &["line 5, column 11", "one value per key"]);
}

#[test]
fn a_key_twice_or_within_another_is_refused() {
    for second in ["slave.start", "slave.start.side_m", "slave"] {
        let text = format!(
            "{HEAD}[[axis]]\nkey = \"slave.start\"\nvalues = [{{ mass_kg = 0.5 }}]\n[[axis]]\nkey = \"{second}\"\nvalues = [1]\n"
        );
        refuses(&text, &["line 7", second, "already"]);
    }
}

#[test]
fn a_slip_in_the_last_row_is_found_before_the_first_runs_and_values_wrong_together_are_named() {
    let axes = "[[axis]]\nkey = \"stiffness_n_per_m\"\nvalues = [500.0, 1000.0]\n[[axis]]\nkey = \"slave.start.side_m\"\nvalues = [0.4, -1.0]\n";
    refuses(
        &format!("{HEAD}{axes}"),
        &[
            "line 8, column 16",
            "stiffness_n_per_m = 500.0",
            "side_m = -1.0",
        ],
    );
}

#[test]
fn a_change_is_tried_before_anything_runs() {
    let change = |rest: &str| format!("{HEAD}[change]\nafter_pushes = 1\n{rest}\n");
    let good = plan(&change(
        "contact_s = 1.0\nto = { friction_coefficient = 0.45 }",
    ));
    assert!(good.row(1).unwrap().trial.change.is_some());
    refuses(
        &change("contact_s = 1.0\nto = { friction_coefficient = -3.0 }"),
        &["change", "-3", "line 6, column 31", "^^^^"],
    );
    refuses(
        &change("contact_s = -1.0\nto = { mass_kg = 1.0 }"),
        &["contact_s", "at least 0"],
    );
    refuses(
        &change("contact_s = 1.0\nto = { colour = 1.0 }"),
        &["line 6", "colour"],
    );
}

#[test]
fn the_key_of_a_row_is_of_its_configuration_and_not_its_words() {
    let key = |text: &str, row| plan(text).row(row).unwrap().key();
    assert_eq!(
        key(GRID, 1),
        key(&GRID.replace("deadband 5%", "deadband 5.0%"), 1)
    );
    assert_ne!(key(GRID, 1), key(GRID, 2));
    assert_ne!(key(GRID, 1), key(&GRID.replace("0.3", "0.4"), 1));
    assert_ne!(
        key(GRID, 1),
        key(&GRID.replace("mass_kg = 0.8", "mass_kg = 0.9"), 1)
    );
}

/// The part file of some rows.
fn part(plan: &Plan, rows: impl Iterator<Item = u64>) -> Vec<u8> {
    let line = |row: Row| RowResult::of(&row, &row.trial.run().unwrap()).line();
    let lines = rows.filter_map(|n| plan.row(n)).map(line);
    std::iter::once(part_header())
        .chain(lines)
        .collect::<Vec<_>>()
        .concat()
}

#[test]
fn parts_make_the_same_bytes_however_the_rows_are_cut() {
    let plan = plan(GRID);
    let mut whole = Results::default();
    whole.add_part(&plan, "a", &part(&plan, 1..=12)).unwrap();
    let bytes = whole.to_csv(&plan).unwrap();
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert!(text.starts_with("row,slave.trigger.scheme,up,down,seed,duration_s,"));
    assert_eq!(text.lines().count(), 13);

    let mut shards = Results::default();
    for shard in ["3/3", "1/3", "2/3"] {
        assert_eq!(shards.to_csv(&plan), None, "before {shard}");
        assert_eq!(shards.table(&plan).1.len() as u64, shards.done());
        let shard: Shard = shard.parse().unwrap();
        let rows = (1..=12).rev().filter(|row| shard.has(*row));
        shards.add_part(&plan, "b", &part(&plan, rows)).unwrap();
    }
    assert_eq!(shards.to_csv(&plan), Some(bytes));
}

#[test]
fn a_torn_line_is_not_there_and_the_same_row_twice_is_one() {
    let plan = plan(GRID);
    let text = part(&plan, 1..=3);
    for cut in [1, 10, 64] {
        let mut results = Results::default();
        results
            .add_part(&plan, "a", &text[..text.len() - cut])
            .unwrap();
        assert_eq!(results.done(), 2);
        assert!(results.missing(&plan).eq(3..=12));
        results.add_part(&plan, "b", &text).unwrap();
        assert_eq!(results.done(), 3);
    }
    let mut results = Results::default();
    let header = part_header();
    for torn in [&b""[..], b"row,k", header.trim_ascii_end()] {
        results.add_part(&plan, "a", torn).unwrap();
    }
    assert_eq!(results.done(), 0);
}

#[test]
fn what_is_not_of_this_plan_or_contradicts_it_is_refused() {
    let (one, other) = (plan(GRID), plan(&GRID.replace("0.8", "0.9")));
    let text = String::from_utf8(part(&one, 1..=1)).unwrap();
    let header = String::from_utf8(part_header()).unwrap();
    let add = |plan: &Plan, text: &str| Results::default().add_part(plan, "p.csv", text.as_bytes());
    let part = "p.csv".to_owned();
    assert_eq!(
        add(&other, &text),
        Err(PartError::OtherPlan {
            part: part.clone(),
            row: 1
        })
    );
    let columns = Err(PartError::Columns { part: part.clone() });
    assert_eq!(add(&one, &text.replacen("row", "line", 1)), columns);
    let line = 2;
    let malformed = Err(PartError::Malformed {
        part: part.clone(),
        line,
    });
    assert_eq!(add(&one, &format!("{header}nonsense\n")), malformed);
    let mut results = Results::default();
    results.add_part(&one, "p.csv", text.as_bytes()).unwrap();
    let digest_end = text.len() - 2;
    let last = if text[digest_end..].starts_with('0') {
        "1\n"
    } else {
        "0\n"
    };
    let changed = text[..digest_end].to_owned() + last;
    let disagree = Err(PartError::Disagree { part, row: 1 });
    assert_eq!(
        results.add_part(&one, "p.csv", changed.as_bytes()),
        disagree
    );
}
