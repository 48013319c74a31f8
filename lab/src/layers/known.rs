//! Every key of a configuration: its value, its unit, what is accepted, and where the value comes from.
//!
//! What is accepted is what the checks answer to a value that cannot be; the unit is the end of the key.

use mmt_client::device::DeviceProfile;
use serde::Serialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::Layers;
use super::idle::{DEVICE_STIFFNESS, idle};
use super::keys::{at, line_of, named, within};
use super::program::SEED_KEYS;
use super::whole::whole;
use crate::overlay::{lay, lay_at};
use crate::text_error::TextError;
use crate::world::{World, WorldConfig};

/// How keys end, and the units that they name; the longest first.
const UNITS: [(&str, &str); 19] = [
    ("_n_per_m", "N/m"),
    ("_n_per_s", "N/s"),
    ("_ns_per_m", "N s/m"),
    ("_m_per_s2", "m/s^2"),
    ("_m_per_s", "m/s"),
    ("_rad_per_s", "rad/s"),
    ("_nms", "N m s"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_ms", "ms"),
    ("_us", "µs"),
    ("_rad", "rad"),
    ("_n2", "N^2"),
    ("_m2", "m^2"),
    ("_n", "N"),
    ("_m", "m"),
    ("_s", "s"),
    ("nanos", "ns"),
    ("secs", "s"),
];
/// Before the range in the message of a number outside it.
const RANGE: &str = "outside the accepted range ";
/// Before the words for what is accepted where a place is outside it.
const PLACES: &str = "outside the accepted places: ";
/// Values that no number may have, of either sign: one of them is refused wherever there is a range. The last are for small
/// whole numbers, of which the others are none.
const IMPOSSIBLE: [&str; 6] = ["1e300", "-1e300", "9223372036854775807", "-1", "255", "0"];

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The program's own, or the mode's.
    Default,
    /// The file, in this line from 1.
    File(usize),
    /// This flag.
    Flag(&'static str),
}

/// A key of a configuration.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Known {
    /// Written with dots.
    pub key: String,
    /// In TOML; none where it is left out and nothing takes its place.
    pub value: Option<String>,
    /// Unit; empty for a ratio, a number of things and words.
    pub unit: &'static str,
    /// What is accepted, a range in that unit or words; empty where the checks name neither.
    pub accepted: String,
    /// Where the value comes from.
    pub origin: Origin,
    /// Whether it has an effect in the program.
    pub in_force: bool,
}

impl Layers<'_> {
    /// Every key in its order: the keys of a table before the tables in it.
    ///
    /// # Errors
    /// As [`Layers::config_with`] of the default device.
    pub fn known(&self) -> Result<Vec<Known>, TextError> {
        let given = self.given()?;
        let device = DeviceProfile::default();
        let config = self.config_with(|k_p| device.used_with(Some(k_p), None).map(drop))?;
        let whole = whole(&config);
        let mut keys = Vec::new();
        let read = |error| TextError::of("", &error);
        let tree = toml::Value::try_from(&whole)
            .map_err(|error| TextError::at("", None, format_args!("no TOML: {error}")))?;
        walk(&whole, &tree, "", &mut keys).map_err(read)?;
        // of a program without a device it may be one that the checks would refuse
        let stiffness = config.stiffness_n_per_m.map(toml::Value::Float);
        let given_stiffness = keys.iter_mut().find(|(key, _)| key == DEVICE_STIFFNESS);
        if let (Some((_, value)), Some(_)) = (given_stiffness, &stiffness) {
            *value = stiffness;
        }
        let known = keys.into_iter().map(|(key, value)| Known {
            unit: unit_of(&key),
            accepted: accepted(&whole, &key, value.as_ref()),
            origin: self.origin(&given, &key),
            in_force: self.program.uses(&key) && idle(&config, &key).is_none(),
            value: value.map(|value| value.to_string()),
            key,
        });
        Ok(known.collect())
    }

    fn origin(&self, given: &Spanned<DeTable>, key: &str) -> Origin {
        if self.seed.is_some() && SEED_KEYS.contains(&key) {
            return Origin::Flag("--seed");
        }
        if let Some(flag) = self.flags.iter().rfind(|flag| within(key, flag.key)) {
            return Origin::Flag(flag.name);
        }
        // a value that is no table stands for all below it
        let mut path = Some(key);
        while let Some(shorter) = path {
            if let Some(value) = at(given.get_ref(), shorter)
                && (shorter == key || !value.get_ref().is_table())
                && value.span().start <= self.file.len()
            {
                return Origin::File(line_of(self.file, value.span().start));
            }
            path = shorter.rsplit_once('.').map(|(shorter, _)| shorter);
        }
        Origin::Default
    }
}

/// The unit that a key names.
fn unit_of(key: &str) -> &'static str {
    let unit = UNITS.iter().find(|(end, _)| key.ends_with(end));
    unit.map_or("", |(_, unit)| unit)
}

/// A key with its value; without one where it is left out.
pub(super) type Leaf = (String, Option<toml::Value>);

/// All keys of a table and of those in it.
fn walk(
    whole: &WorldConfig,
    tree: &toml::Value,
    path: &str,
    keys: &mut Vec<Leaf>,
) -> Result<(), toml::de::Error> {
    let Some(table) = tree.as_table() else {
        return Ok(());
    };
    let mut inner = Vec::new();
    for (name, value) in table {
        let key = format!("{path}{name}");
        if value.as_table().is_some_and(|table| !table.is_empty()) {
            inner.push((key, value));
        } else {
            keys.push((key, Some(value.clone())));
        }
    }
    let left_out = answer(whole, &format!("{path}?"), "0").unwrap_or_default();
    let left_out = named(&left_out).into_iter();
    let left_out = left_out.filter(|name| !table.contains_key(name));
    keys.extend(left_out.map(|name| (format!("{path}{name}"), None)));
    for (key, value) in inner {
        walk(whole, value, &format!("{key}."), keys)?;
    }
    Ok(())
}

/// What the checks accept there.
fn accepted(whole: &WorldConfig, key: &str, value: Option<&toml::Value>) -> String {
    use toml::Value as V;
    let of = |value: &str| answer(whole, key, value);
    let number = |numbers: Option<usize>| {
        let answers = IMPOSSIBLE.into_iter().filter_map(|value| match numbers {
            Some(numbers) => of(&format!("[{}]", vec![value; numbers.max(1)].join(", "))),
            None => of(value),
        });
        let answers: Vec<String> = answers.collect();
        let mut ranges = answers.iter().filter_map(|of| range(of, unit_of(key)));
        let by_type = || answers.iter().find_map(|of| range_of_type(of));
        ranges.next().or_else(by_type)
    };
    let accepted = match value {
        Some(V::Boolean(_)) => Some("true or false".to_owned()),
        Some(V::String(_)) => of("\"?\"").map(words),
        Some(V::Integer(_) | V::Float(_)) => number(None),
        Some(V::Array(list)) if list.iter().all(|one| one.is_float() || one.is_integer()) => {
            number(Some(list.len()))
        }
        _ => None,
    };
    accepted.unwrap_or_default()
}

/// The range of a message, of a number in this unit: what follows from the number may be refused before it.
fn range(message: &str, unit: &str) -> Option<String> {
    if let Some((_, places)) = message.split_once(PLACES) {
        return Some(places.to_owned());
    }
    let (_, rest) = message.split_once(RANGE)?;
    let mut words = rest.splitn(4, ' ');
    let (min, _to, max) = (words.next()?, words.next()?, words.next()?);
    let found = words.next().unwrap_or_default();
    match found.strip_prefix(unit) {
        Some("") => Some(format!("{min} to {max}")),
        Some(_) if unit.is_empty() => Some(format!("{min} to {max} {found}")),
        Some(more) if more.starts_with([' ', ';']) => Some(format!("{min} to {max}")),
        _ => None,
    }
}

/// The range of a number's type, where a message names no other.
fn range_of_type(message: &str) -> Option<String> {
    let types = [
        ("u8", "0 to 255"),
        ("u32", "0 to 4294967295"),
        ("u64", "a whole number from 0"),
    ];
    let mut named = types
        .into_iter()
        .filter(|(name, _)| message.ends_with(&format!("expected {name}")));
    named.next().map(|(_, range)| range.to_owned())
}

/// Why the checks refuse a value of a key; none if they take it.
fn answer(whole: &WorldConfig, key: &str, value: &str) -> Option<String> {
    let mut given = DeTable::new();
    let value = DeValue::parse(value).ok()?;
    lay_at(&mut given, key, &(0..0), value);
    match lay(whole, Spanned::new(0..0, given), 0) {
        Err(error) => Some(error.message().to_owned()),
        Ok(config) => Some(World::try_new(&config).err()?.to_string()),
    }
}

/// The words that a message names; else the message.
fn words(message: String) -> String {
    let leads = ["expected one of ", "expected ", "use one of "];
    let named = leads.iter().find_map(|lead| message.split_once(lead));
    named.map_or_else(|| message.clone(), |(_, words)| words.replace('`', ""))
}
