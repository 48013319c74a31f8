//! The report of both sides as one: the master's, and from the slave's what the master could not know.

use mmt_client::io::MasterReport;
use mmt_server::io::SlaveReport;
use mmt_shared::report::{Counts, RunReport};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::failure::Failure;

/// The report of a demo; its configuration is that of both sides.
pub(super) type DemoReport = RunReport<Value>;

/// Joins the reports of a session. Where both know a number it is the master's.
///
/// # Errors
/// A report is no JSON: a defect.
pub(super) fn join(
    master: &MasterReport,
    slave: Option<&SlaveReport>,
) -> Result<DemoReport, Failure> {
    let defect =
        |error: serde_json::Error| Failure::failed(format!("the report is no JSON: {error}"));
    let mut joined = as_value(master).map_err(defect)?;
    let mut other = slave
        .map(as_value)
        .transpose()
        .map_err(defect)?
        .unwrap_or_default();
    let configuration = json!({
        "master": joined.get_mut("configuration").map(Value::take),
        "slave": other.get_mut("configuration").map(Value::take),
    });
    fill(&mut joined, other);
    let mut report = DemoReport::deserialize(joined).map_err(defect)?;
    report.command = "demo".to_owned();
    report.configuration = configuration;
    report.drops = drops(
        master.drops.as_ref(),
        slave.and_then(|slave| slave.drops.as_ref()),
    );
    Ok(report)
}

fn as_value(report: &impl Serialize) -> Result<Value, serde_json::Error> {
    serde_json::to_value(report)
}

/// Puts what `other` knows where `joined` has null.
fn fill(joined: &mut Value, other: Value) {
    match (joined, other) {
        (Value::Object(joined), Value::Object(other)) => {
            for (key, value) in other {
                fill(joined.entry(key).or_insert(Value::Null), value);
            }
        }
        (joined @ Value::Null, other) => *joined = other,
        _ => {}
    }
}

/// The drops of both sides, each under the name of its side.
fn drops(master: Option<&Counts>, slave: Option<&Counts>) -> Option<Counts> {
    let named = |side: &'static str, counts: Option<&Counts>| {
        let counts = counts.cloned().unwrap_or_default();
        counts
            .into_iter()
            .map(move |(name, n)| (format!("{side}_{name}"), n))
    };
    let known = master.is_some() || slave.is_some();
    known.then(|| {
        named("master", master)
            .chain(named("slave", slave))
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn null_is_filled_and_what_is_known_stays() {
        let mut joined = json!({"a": 1.5, "b": {"c": null, "d": 2}, "e": null});
        fill(
            &mut joined,
            json!({"a": 9, "b": {"c": 3, "d": 9}, "e": {"f": [1]}, "g": 4}),
        );
        let expected = json!({"a": 1.5, "b": {"c": 3, "d": 2}, "e": {"f": [1]}, "g": 4});
        assert_eq!(joined, expected);
    }

    #[test]
    fn equal_names_of_drops_on_both_sides_stay_apart() {
        let counts = |n| Counts::from([("malformed".to_owned(), n)]);
        let both = drops(Some(&counts(1)), Some(&counts(2))).unwrap();
        let expected = [
            ("master_malformed".to_owned(), 1),
            ("slave_malformed".to_owned(), 2),
        ];
        assert_eq!(both, Counts::from(expected));
        assert_eq!(drops(None, None), None);
    }
}
