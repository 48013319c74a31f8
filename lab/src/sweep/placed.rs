//! The axes of a plan with the places of their keys and values.

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;
use toml::de::DeValue;

use super::plan::Axis;
use crate::text_error::TextError;

/// An axis as the plan writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisHead {
    key: Option<Spanned<String>>,
    keys: Option<Spanned<Vec<Spanned<String>>>>,
    values: Spanned<Vec<IgnoredAny>>,
}

/// An axis with the places of its keys and values.
pub(super) struct PlacedAxis<'i> {
    pub(super) keys: Vec<Spanned<String>>,
    /// Per step a value for every key.
    pub(super) steps: Vec<Vec<Spanned<DeValue<'i>>>>,
}

impl PlacedAxis<'_> {
    pub(super) fn plain(&self, text: &str) -> Axis {
        let written = |step: &Vec<_>| step.iter().map(|value| written(text, value)).collect();
        Axis {
            keys: self.keys.iter().map(|key| key.get_ref().clone()).collect(),
            values: self.steps.iter().map(written).collect(),
        }
    }
}

/// A value as the plan writes it; of a string what is between the quotes.
fn written(text: &str, value: &Spanned<DeValue>) -> String {
    match value.get_ref() {
        DeValue::String(string) => string.to_string(),
        _ => text.get(value.span()).unwrap_or_default().to_owned(),
    }
}

/// The axis of a head with the values that stand there.
///
/// # Errors
/// It has no keys, or a value that does not fit them.
pub(super) fn placed_axis<'i>(
    text: &str,
    head: &Spanned<AxisHead>,
    placed: &DeValue<'i>,
) -> Result<PlacedAxis<'i>, TextError> {
    let axis = head.get_ref();
    let refuse = |span, what: &str| Err(TextError::at(text, Some(span), what));
    let keys = match (&axis.key, &axis.keys) {
        (Some(key), None) => vec![key.clone()],
        (None, Some(keys)) if !keys.get_ref().is_empty() => keys.get_ref().clone(),
        _ => return refuse(head.span(), "an axis has either `key` or `keys`"),
    };
    let values = placed.as_table().and_then(|axis| axis.get("values"));
    let values = values.and_then(|values| values.get_ref().as_array());
    let values: Vec<_> = values
        .into_iter()
        .flat_map(|values| values.iter())
        .collect();
    if values.is_empty() {
        return refuse(axis.values.span(), "an axis needs at least one value");
    }
    let mut steps = Vec::new();
    for value in values {
        match (&axis.keys, value.get_ref()) {
            (None, _) => steps.push(vec![value.clone()]),
            (Some(_), DeValue::Array(row)) if row.len() == keys.len() => steps.push(row.to_vec()),
            _ => {
                return refuse(
                    value.span(),
                    "with `keys`, a value is a list with one value per key",
                );
            }
        }
    }
    Ok(PlacedAxis { keys, steps })
}
