//! Which of the keys that a plan gives change nothing in any of its rows: each is an error.
//!
//! A grid may well have rows that do not read a key, such as those of another scheme; the key is refused where none does.

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::placed::PlacedAxis;
use crate::layers::{DEVICE_STIFFNESS, MODEL_STIFFNESS, at, idle_in_sweep};
use crate::text_error::TextError;
use crate::world::WorldConfig;

/// A key with its place in the plan.
type Key = (String, Range<usize>);

/// The keys of a plan that no row has read so far.
pub(super) struct Given {
    keys: Vec<Key>,
    /// Why the last row did not read it, beside each.
    why: Vec<&'static str>,
}

impl Given {
    /// The keys of the plan, in its order.
    pub(super) fn of(base: &DeTable, axes: &[PlacedAxis]) -> Self {
        let mut keys = Vec::new();
        of_table(base, "", &mut keys);
        for axis in axes {
            for step in &axis.steps {
                for (key, value) in axis.keys.iter().zip(step) {
                    let place = (key.get_ref().clone(), key.span());
                    of_value(place, value.get_ref(), &mut keys);
                }
            }
        }
        // once each: an axis has its keys at every step
        let mut known = BTreeSet::new();
        keys.retain(|(key, _)| known.insert(key.clone()));
        let why = vec![""; keys.len()];
        Self { keys, why }
    }

    /// Looks at the configuration of a row.
    pub(super) fn see(&mut self, config: &WorldConfig) {
        let seen = self.keys.drain(..).filter_map(|place| {
            let why = idle_in_sweep(config, &place.0)?;
            Some((place, why))
        });
        (self.keys, self.why) = seen.collect::<Vec<_>>().into_iter().unzip();
    }

    /// The first key that none of the rows seen reads.
    pub(super) fn refused(&self, text: &str) -> Result<(), TextError> {
        let first = self
            .keys
            .iter()
            .zip(&self.why)
            .min_by_key(|((_, place), _)| place.start);
        let Some(((key, place), why)) = first else {
            return Ok(());
        };
        let what = format!("`{key}` has no effect in this plan: {why}");
        Err(TextError::at(text, Some(place.clone()), what))
    }
}

/// What of `base` an axis gives in every row, and a stiffness of the device that the model does not get.
pub(super) fn outdone(
    text: &str,
    below: &DeTable,
    base: &DeTable,
    axes: &[PlacedAxis],
) -> Result<(), TextError> {
    let mut of_base = Vec::new();
    of_table(base, "", &mut of_base);
    let of_axes: Vec<Key> = axes.iter().flat_map(in_every_step).collect();
    let varied = |(key, _): &&Key| of_axes.iter().any(|(other, _)| other == key);
    if let Some((key, place)) = of_base.iter().find(varied) {
        let what = format!(
            "`{key}` of base has no effect in this plan: an axis gives it in every row; leave one of them out"
        );
        return Err(TextError::at(text, Some(place.clone()), what));
    }
    let own = || of_base.iter().chain(&of_axes);
    let of_device = own().find(|(key, _)| key == DEVICE_STIFFNESS);
    let of_model =
        own().any(|(key, _)| key == MODEL_STIFFNESS) || at(below, MODEL_STIFFNESS).is_some();
    match of_device.filter(|_| of_model) {
        None => Ok(()),
        Some((key, place)) => {
            let what = format!(
                "`{key}` has no effect in this plan: `{MODEL_STIFFNESS}` gives the model another k_p than the device's; leave one of them out"
            );
            Err(TextError::at(text, Some(place.clone()), what))
        }
    }
}

/// The keys that an axis gives a value at each of its steps.
fn in_every_step(axis: &PlacedAxis) -> Vec<Key> {
    let of_step = |step: &Vec<Spanned<DeValue>>| {
        let mut keys = Vec::new();
        for (key, value) in axis.keys.iter().zip(step) {
            of_value(
                (key.get_ref().clone(), key.span()),
                value.get_ref(),
                &mut keys,
            );
        }
        keys
    };
    let mut steps = axis.steps.iter().map(of_step);
    let mut common = steps.next().unwrap_or_default();
    for step in steps {
        common.retain(|(key, _)| step.iter().any(|(other, _)| other == key));
    }
    common
}

fn of_table(table: &DeTable, path: &str, keys: &mut Vec<Key>) {
    for (key, value) in table {
        let place = (format!("{path}{}", key.get_ref()), key.span());
        of_value(place, value.get_ref(), keys);
    }
}

/// The keys of a value: of a table those in it, of a list of tables those in each, numbered from 0.
fn of_value((key, place): Key, value: &DeValue, keys: &mut Vec<Key>) {
    match value {
        DeValue::Table(table) if !table.is_empty() => of_table(table, &format!("{key}."), keys),
        DeValue::Array(list) if list.iter().any(|one| one.get_ref().is_table()) => {
            for (number, one) in list.iter().enumerate() {
                let place = (format!("{key}.{number}"), place.clone());
                of_value(place, one.get_ref(), keys);
            }
        }
        _ => keys.push((key, place)),
    }
}
