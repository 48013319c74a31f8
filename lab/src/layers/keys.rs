//! The keys of a file: each at its home, and found by its name.

use mmt_server::slave::SlaveConfig;
use mmt_shared::spelling;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::whole::keys;
use crate::overlay::lay_at;
use crate::text_error::TextError;
use crate::world::WorldConfig;

/// Keys at the top of a file that hold for these as well, where the file does not give these.
pub(super) const SHARED: [(&str, &[&str]); 2] = [
    ("seed", &["slave.seed", "operator.seed"]),
    ("stretch_max", &["slave.stretch_max"]),
];

/// The keys of a file, each at its home.
pub(crate) fn configuration(text: &str) -> Result<Spanned<DeTable<'_>>, TextError> {
    let mut given = DeTable::parse(text).map_err(|error| TextError::of(text, &error))?;
    bring_home(text, given.get_mut())?;
    Ok(given)
}

/// Whether a key is `table` or stands in it.
pub(super) fn within(key: &str, table: &str) -> bool {
    key.strip_prefix(table)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// The value at a key written with dots.
pub(crate) fn at<'t, 'i>(table: &'t DeTable<'i>, key: &str) -> Option<&'t Spanned<DeValue<'i>>> {
    match key.split_once('.') {
        None => table.get(key),
        Some((first, rest)) => at(table.get(first)?.get_ref().as_table()?, rest),
    }
}

/// Every value that is no table, with its key; an empty table is a value.
pub(super) fn leaves_of<'t, 'i>(
    table: &'t DeTable<'i>,
    path: &str,
    leaves: &mut Vec<(String, &'t Spanned<DeValue<'i>>)>,
) {
    for (key, value) in table {
        let key = format!("{path}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) if !inner.is_empty() => {
                leaves_of(inner, &format!("{key}."), leaves);
            }
            _ => leaves.push((key, value)),
        }
    }
}

/// What stands at the top of a file and is the slave's alone belongs into `slave`, so that a file of a slave needs no
/// other word before its keys; and what both sides share is given to each that has none of its own.
///
/// A key that is at both places, or that nobody knows, is an error.
fn bring_home(text: &str, given: &mut DeTable) -> Result<(), TextError> {
    let (all, of_slave) = (fields::<WorldConfig>(), fields::<SlaveConfig>());
    let top: Vec<String> = given.keys().map(|key| key.get_ref().to_string()).collect();
    for name in top {
        let Some((key, value)) = given.get_key_value(name.as_str()) else {
            continue;
        };
        let (place, value) = (key.span(), value.clone());
        let shared = SHARED.iter().find(|(shared, _)| *shared == name);
        let own = format!("slave.{name}");
        let moved = shared.is_none() && !all.contains(&name);
        if moved && !of_slave.contains(&name) {
            let more = of_slave.into_iter().filter(|name| !all.contains(name));
            let known: Vec<String> = all.iter().cloned().chain(more).collect();
            return Err(TextError::at(text, Some(place), unknown(&name, &known)));
        }
        let mut homes = shared.map_or_else(Vec::new, |(_, homes)| homes.to_vec());
        if moved {
            homes.push(&own);
        }
        for home in homes {
            match at(given, home) {
                None => {
                    lay_at(given, home, &place, value.clone());
                    if moved {
                        given.remove(name.as_str());
                    }
                }
                Some(_) if moved => {
                    let slave = given.get("slave").and_then(|of| of.get_ref().as_table());
                    let other = slave.and_then(|slave| slave.get_key_value(name.as_str()));
                    let line = other.map_or(1, |(key, _)| line_of(text, key.span().start));
                    let what = format!(
                        "`{name}` is given twice: here, and as `{own}` in line {line}; leave one of them out"
                    );
                    return Err(TextError::at(text, Some(place), what));
                }
                // what both sides share
                Some(_) => {}
            }
        }
    }
    Ok(())
}

/// The line, from 1, of a place in a text.
pub(super) fn line_of(text: &str, place: usize) -> usize {
    let before = text.get(..place).unwrap_or(text);
    before.matches('\n').count() + 1
}

/// What is wrong with a name at the top of a file that none of the known ones is, with the key that was meant.
fn unknown(name: &str, known: &[String]) -> String {
    let quoted = |names: &[String], between: &str| {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        names.join(between)
    };
    let what = format!(
        "unknown field `{name}`, expected one of {}",
        quoted(known, ", ")
    );
    let near = |names: &[String]| {
        let ends = names.iter().map(|key| end_of(key));
        let end = spelling::meant(name, ends)?;
        let meant = names.iter().filter(|key| end_of(key) == end);
        Some(meant.cloned().collect::<Vec<_>>())
    };
    match near(known).or_else(|| near(&keys())) {
        Some(meant) => format!("{what}; did you mean {}?", quoted(&meant, " or ")),
        None => what,
    }
}

/// A key without the tables that it stands in.
fn end_of(key: &str) -> &str {
    key.rsplit_once('.').map_or(key, |(_, end)| end)
}

/// The names of a configuration's fields, as its reader lists them to who gives it another one.
pub(super) fn fields<T: DeserializeOwned>() -> Vec<String> {
    let unknown = DeTable::parse("\"?\" = 0").map(|text| T::deserialize(Deserializer::from(text)));
    let refused = unknown.map(|read| read.err());
    refused.map_or_else(
        |_| Vec::new(),
        |error| error.map_or_else(Vec::new, |error| named(error.message())),
    )
}

/// The fields that a message on an unknown one names.
pub(super) fn named(message: &str) -> Vec<String> {
    let Some(message) = message.strip_prefix("unknown field ") else {
        return Vec::new();
    };
    let words = message.split('`').skip(1).step_by(2);
    words.skip(1).map(str::to_owned).collect()
}
