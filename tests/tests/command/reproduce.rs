//! `mmt reproduce` as a process: what it writes, that it writes the same again, and that the samples say the same.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn mmt(arguments: &[&str], out: &Path) -> Output {
    Command::new(super::PROGRAM)
        .args(["reproduce"])
        .args(arguments)
        .args(["--out", out.to_str().unwrap()])
        .output()
        .unwrap()
}

/// Every file of a folder by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let whole = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, fs::read(path).unwrap())
    };
    entries.filter(|path| path.is_file()).map(whole).collect()
}

#[test]
fn fig5_is_the_same_bytes_again_and_its_samples_say_what_its_rows_say() {
    let place = tempfile::tempdir().unwrap();
    let small = ["fig5", "--seeds", "1", "--duration", "4s"];
    let (once, again) = (place.path().join("once"), place.path().join("again"));
    let with_samples = [&small[..], &["--samples", "--jobs", "2"]].concat();
    let first = mmt(&with_samples, &once);
    assert!(first.status.success(), "{first:?}");
    assert!(
        mmt(&[&small[..], &["--jobs", "1"]].concat(), &again)
            .status
            .success()
    );

    let (first, second) = (files(&once), files(&again));
    for name in ["fig5.csv", "fig5.svg"] {
        assert_eq!(first[name], second[name], "{name}");
    }
    let csv = String::from_utf8(first["fig5.csv"].clone()).unwrap();
    assert_eq!(csv.lines().count(), 1 + 11 * 7);
    let contract = "mode,scheme,t_update_ms,deadband,seed,duration_s,packet_rate_hz,contact_packet_rate_hz,pmse,\
                    pmse_x,pmse_y,pmse_magnitude,relative_error,jnd7_share";
    assert!(csv.starts_with(contract), "{csv}");
    let manifest: Value = serde_json::from_slice(&first["manifest.json"]).unwrap();
    assert_eq!(manifest["experiments"][0]["experiment"], "fig5");
    assert_eq!(manifest["experiments"][0]["extent"]["seeds"], 1);
    assert_eq!(manifest["files"]["fig5.csv"].as_str().unwrap().len(), 64);

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/pmse/recompute.py");
    let recomputed = Command::new("python3")
        .arg(script)
        .arg(&once)
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&recomputed.stdout).into_owned();
    assert!(recomputed.status.success(), "{recomputed:?}");
    assert!(
        printed.starts_with("77 rows, largest difference"),
        "{printed}"
    );

    // and the check can fail
    let sample = once.join("samples/paper-deadband-0-0.1-5001.csv");
    let text = fs::read_to_string(&sample).unwrap();
    let wrong: Vec<String> = text
        .lines()
        .map(|line| line.replace(",-0.", ",-1.").replace(",0.", ",1."))
        .collect();
    fs::write(&sample, wrong.join("\n")).unwrap();
    let recomputed = Command::new("python3")
        .arg(script)
        .arg(&once)
        .output()
        .unwrap();
    assert_eq!(recomputed.status.code(), Some(1), "{recomputed:?}");
}

#[test]
fn experiments_of_one_folder_are_listed_together_each_as_it_was_run_last() {
    let place = tempfile::tempdir().unwrap();
    for seeds in ["1", "2"] {
        let fig5 = ["fig5", "--seeds", seeds, "--duration", "1s"];
        assert!(mmt(&fig5, place.path()).status.success());
        let fig7 = ["fig7", "--seeds", "1", "--duration", "1s"];
        assert!(mmt(&fig7, place.path()).status.success());
    }
    let written = files(place.path());
    let manifest: Value = serde_json::from_slice(&written["manifest.json"]).unwrap();
    let experiments = manifest["experiments"].as_array().unwrap();
    let shown = |key: &str| {
        experiments
            .iter()
            .map(|of| of[key].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(shown("experiment"), ["fig5", "fig7"]);
    assert_eq!(experiments[0]["extent"]["seeds"], 2);
    for name in written.keys().filter(|name| *name != "manifest.json") {
        assert!(manifest["files"][name].is_string(), "{name}");
    }
}

#[test]
fn physics_takes_any_body_and_refuses_what_is_none() {
    let place = tempfile::tempdir().unwrap();
    let output = mmt(
        &["physics", "--mass", "1.4", "--mu", "0.2", "--damping", "2"],
        place.path(),
    );
    assert!(output.status.success(), "{output:?}");
    let csv = String::from_utf8(files(place.path())["physics.csv"].clone()).unwrap();
    let cases: Vec<&str> = csv
        .lines()
        .map(|line| line.split(',').next().unwrap())
        .collect();
    let expected = [
        "case",
        "push",
        "push-45",
        "stop",
        "spin-down",
        "coast-x",
        "coast-theta",
        "wrench-x",
        "wrench-theta",
        "hold-0.5c",
        "hold-0.9c",
    ];
    assert_eq!(cases, expected);
    assert!(
        csv.starts_with("case,reference,measured,relative_error\n"),
        "{csv}"
    );

    let refused = mmt(&["physics", "--mass", "-2"], place.path());
    assert_eq!(refused.status.code(), Some(2));
    let printed = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        printed.contains("mass") && printed.contains("what to do"),
        "{printed}"
    );
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    fs::write(&file, "").unwrap();
    let refused = mmt(&["fig6", "--duration", "1s"], &file.join("figures"));
    assert_eq!(refused.status.code(), Some(2));
    let printed = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(printed.contains("--out"), "{printed}");
}
