//! `mmt swarm` as a process: what it counts and prints.

use serde_json::Value;

fn swarm(more: &[&str]) -> String {
    let home = tempfile::tempdir().unwrap();
    let mut command = super::mmt(&home, &["swarm"]);
    let output = command.args(more).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn each_fault_is_counted_by_its_name_and_the_text_shows_what_the_document_has() {
    let extent = ["--seeds", "6", "--duration", "10s"];
    let document: Value =
        serde_json::from_str(&swarm(&[&extent[..], &["--json"]].concat())).unwrap();
    assert_eq!(
        (&document["command"], &document["seeds"]),
        (&"swarm".into(), &6.into())
    );
    assert_eq!(document["holds"], true);
    let faults = document["faults"].as_u64().unwrap();
    let by_fault = document["by_fault"].as_object().unwrap();
    let counts = || by_fault.values().map(|count| count.as_u64().unwrap());
    assert!(
        by_fault.len() > 3 && counts().all(|count| count > 0),
        "{by_fault:?}"
    );
    assert_eq!(counts().sum::<u64>(), faults);
    let text = swarm(&extent);
    let sessions = document["sessions"].as_u64().unwrap();
    let first = format!("6 seeds of 10 s: {sessions} sessions, {faults} faults, 0 seeds run twice");
    assert!(text.starts_with(&first), "{text}");
    for (name, count) in by_fault {
        assert!(text.contains(&format!("{name} {count}")), "{name}: {text}");
    }
    // f_m is judged in most of the ticks that play something
    let rows = document["invariants"].as_array().unwrap();
    let checked = |name: &str| {
        let row = rows.iter().find(|row| row["name"] == name);
        row.and_then(|row| row["checked"].as_u64()).unwrap()
    };
    assert!(
        2 * checked("plays-true") > checked("plays-in-order"),
        "{rows:?}"
    );
}
