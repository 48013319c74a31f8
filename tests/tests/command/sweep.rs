//! `mmt sweep` as a process: the same bytes however the rows are cut, and what it says of what is wrong or missing.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;
use std::time::Duration;

use serde_json::Value;

/// Two axes of two values, two seeds: eight rows, each long enough for contact.
const PLAN: &str = r#"
duration_s = 5
seeds = { first = 1, count = 2 }
start = "paper-experiment"

[[axis]]
key = "slave.trigger.scheme"
values = ["deadband 10%", "hybrid 10% 150ms"]

[[axis]]
keys = ["up", "down"]
values = [["none", "none"], ["delay 50ms", "delay 50ms loss 1%"]]
"#;

/// A folder with a plan in it.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new(plan: &str) -> Self {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("plan.toml"), plan).unwrap();
        Self(place)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = super::mmt(&self.0, &["sweep", "plan.toml"]);
        command.args(arguments);
        command
    }

    fn sweep(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn results(&self, folder: &str) -> Vec<u8> {
        fs::read(self.path().join(folder).join("results.csv")).unwrap()
    }
}

/// Checks the exit code and that stderr has these parts.
fn ends(output: &Output, code: i32, parts: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for part in parts {
        assert!(said.contains(part), "{part} is missing in: {said}");
    }
}

fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The fields of a column of the table.
fn column<'a>(csv: &'a str, key: &str) -> Vec<&'a str> {
    let mut lines = csv.lines();
    let at = lines
        .next()
        .unwrap()
        .split(',')
        .position(|name| name == key);
    let field = |line: &'a str| line.split(',').nth(at.unwrap()).unwrap();
    lines.map(field).collect()
}

#[test]
fn one_run_and_three_shards_and_any_threads_make_the_same_bytes() {
    let bench = Bench::new(PLAN);
    let whole = bench.sweep(&["--out", "whole", "--jobs", "1"]);
    ends(&whole, 0, &[]);
    let said = String::from_utf8_lossy(&whole.stdout).into_owned();
    assert_eq!(
        said,
        "8 rows run, 8 of 8 done\nresults: whole/results.csv\n"
    );
    let bytes = bench.results("whole");
    let csv = String::from_utf8(bytes.clone()).unwrap();
    let header = "row,slave.trigger.scheme,up,down,seed,duration_s,";
    assert!(csv.starts_with(header), "{csv}");
    assert_eq!(
        column(&csv, "row"),
        ["1", "2", "3", "4", "5", "6", "7", "8"]
    );
    assert_eq!(column(&csv, "seed"), ["1", "2"].repeat(4));
    // there is something to compare: forces were felt, and no two rows are the same run
    let mut digests = column(&csv, "digest");
    digests.sort_unstable();
    digests.dedup();
    assert_eq!(digests.len(), 8);
    assert!(
        column(&csv, "pmse")
            .iter()
            .all(|pmse| pmse.parse::<f64>().unwrap() > 0.0),
        "{csv}"
    );

    for (shard, jobs) in [("2/3", "2"), ("3/3", "1")] {
        let output = bench.sweep(&["--out", "cut", "--shard", shard, "--jobs", jobs]);
        ends(&output, 0, &[]);
    }
    let early = bench.sweep(&["--out", "cut", "--merge", "--json"]);
    ends(&early, 1, &["3 rows", "missing", "1, 4, 7", "what to do"]);
    let summary = document(&early);
    assert_eq!(
        (&summary["done"], &summary["missing"]),
        (&5.into(), &3.into())
    );
    assert!(summary["results"].is_null());
    assert!(!bench.path().join("cut/results.csv").exists());
    // the last shard ran on another machine; its rows are copied over
    let output = bench.sweep(&["--out", "elsewhere", "--shard", "1/3", "--jobs", "2"]);
    ends(&output, 0, &[]);
    for part in fs::read_dir(bench.path().join("elsewhere/rows")).unwrap() {
        let part = part.unwrap();
        fs::copy(
            part.path(),
            bench.path().join("cut/rows").join(part.file_name()),
        )
        .unwrap();
    }
    ends(&bench.sweep(&["--out", "cut", "--merge"]), 0, &[]);
    assert_eq!(bench.results("cut"), bytes);

    // what is there is not run again, and not taken for another plan's
    let again = bench.sweep(&["--out", "cut", "--json"]);
    ends(&again, 0, &[]);
    assert_eq!(document(&again)["ran"], 0);
    let other = PLAN.replace("loss 1%", "loss 2%");
    fs::write(bench.path().join("plan.toml"), other).unwrap();
    let refused = bench.sweep(&["--out", "cut"]);
    ends(&refused, 2, &["another plan", "rows/", "--out"]);
    let kept = fs::read_to_string(bench.path().join("cut/plan.toml")).unwrap();
    assert_eq!(kept, PLAN);
}

#[test]
fn an_interrupted_sweep_keeps_what_is_done_and_shows_how_to_go_on() {
    // far more than any machine does before the signal comes
    let bench = Bench::new("duration_s = 20\nseeds = { count = 10000 }\n");
    let part = bench.path().join("sweep/rows/1-of-1-1.csv");
    let rows =
        || fs::read_to_string(&part).map_or(0, |text| text.lines().count().saturating_sub(1));
    let mut command = bench.command(&["--jobs", "1", "--json"]);
    let mut running = command.spawn().unwrap();
    while rows() == 0 && running.try_wait().unwrap().is_none() {
        thread::sleep(Duration::from_millis(10));
    }
    let id = running.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let output = running.wait_with_output().unwrap();
    ends(
        &output,
        1,
        &[
            "interrupted",
            "rows of shard 1/1 are missing",
            "more",
            "the same command",
        ],
    );
    let summary = document(&output);
    let done = summary["done"].as_u64().unwrap();
    assert_eq!((done, summary["ran"].as_u64()), (rows() as u64, Some(done)));
    assert_eq!(summary["missing"], 10000 - done);
    assert_eq!(summary["first_missing"][0], done + 1);
    // the next command finds the same rows
    let merged = bench.sweep(&["--merge", "--json"]);
    ends(&merged, 1, &["missing"]);
    assert_eq!(document(&merged)["done"], done);
}

#[test]
fn a_bad_plan_is_reported_with_its_place_before_anything_is_made() {
    let bench = Bench::new(&PLAN.replace("slave.trigger.scheme", "slave.triger.scheme"));
    let refused = bench.sweep(&[]);
    ends(
        &refused,
        2,
        &[
            "plan.toml",
            "line 7, column 7",
            "^^^",
            "triger",
            "what to do",
        ],
    );
    assert!(refused.stdout.is_empty());
    assert!(!bench.path().join("sweep").exists());
    let bench = Bench::new(PLAN);
    ends(
        &bench.sweep(&["--shard", "4/3"]),
        2,
        &["--shard", "4/3", "2/8"],
    );
    ends(
        &bench.sweep(&["--merge", "--shard", "1/3"]),
        2,
        &["--merge", "--shard"],
    );
    ends(&bench.sweep(&["--merge"]), 2, &["no folder sweep", "--out"]);
}

#[test]
fn a_dry_run_shows_the_rows_and_makes_nothing() {
    let bench = Bench::new(PLAN);
    let output = bench.sweep(&["--dry-run", "--shard", "2/3"]);
    ends(&output, 0, &[]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines[0], "8 rows, 3 in shard 2/3");
    assert!(
        lines[1].starts_with("first: row 2:") && lines[1].ends_with("seed = 2"),
        "{said}"
    );
    assert!(
        lines[2].starts_with("last: row 8:") && lines[2].contains("hybrid 10% 150ms"),
        "{said}"
    );
    let json = document(&bench.sweep(&["--dry-run", "--json"]));
    assert_eq!(json["last"]["values"]["down"], "delay 50ms loss 1%");
    assert!(!bench.path().join("sweep").exists());
}

#[test]
fn the_plan_of_the_document_is_one_with_the_rows_that_it_states() {
    let text = include_str!("../../../docs/sweep.md");
    let plans = text
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next());
    let plans: Vec<&str> = plans.collect();
    assert_eq!(plans.len(), 1);
    let output = Bench::new(plans[0]).sweep(&["--dry-run"]);
    ends(&output, 0, &[]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let rows = said.split(',').next().unwrap();
    assert!(
        text.contains(&format!("The plan above has {rows}.")),
        "{said}"
    );
}

#[test]
fn the_documents_tell_every_column() {
    let text = include_str!("../../../docs/sweep.md");
    for key in mmt_lab::sweep::columns().iter().map(|column| column.key) {
        assert!(text.contains(&format!("`{key}`")), "{key} is not told");
    }
}
