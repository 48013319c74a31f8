//! The keys of a file: each at its home, and found by its name.

use mmt_server::slave::SlaveConfig;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::overlay::lay_at;
use crate::world::WorldConfig;

/// Keys at the top of a file that hold for these as well, where the file does not give these.
pub(super) const SHARED: [(&str, &[&str]); 2] = [
    ("seed", &["slave.seed", "operator.seed"]),
    ("stretch_max", &["slave.stretch_max"]),
];

/// The keys of a file, each at its home.
pub(crate) fn configuration(text: &str) -> Result<Spanned<DeTable<'_>>, toml::de::Error> {
    let mut given = DeTable::parse(text)?;
    bring_home(given.get_mut());
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
pub(super) fn bring_home(given: &mut DeTable) {
    let (all, of_slave) = (fields::<WorldConfig>(), fields::<SlaveConfig>());
    let top: Vec<String> = given.keys().map(|key| key.get_ref().to_string()).collect();
    for name in top {
        let Some((key, value)) = given.get_key_value(name.as_str()) else {
            continue;
        };
        let (place, value) = (key.span(), value.clone());
        let shared = SHARED.iter().find(|(shared, _)| *shared == name);
        let own = format!("slave.{name}");
        let moved = shared.is_none() && !all.contains(&name) && of_slave.contains(&name);
        let mut homes = shared.map_or_else(Vec::new, |(_, homes)| homes.to_vec());
        if moved {
            homes.push(&own);
        }
        for home in homes {
            // of a key that is there twice the one at the top is refused as unknown
            if at(given, home).is_none() {
                lay_at(given, home, &place, value.clone());
                if moved {
                    given.remove(name.as_str());
                }
            }
        }
    }
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
