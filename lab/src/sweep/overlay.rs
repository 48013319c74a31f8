//! Keys of a plan laid over a configuration that is there already, each with its place in the plan's text.
//!
//! Everything goes through the configuration's own reader, so a key that a configuration learns can be swept the
//! same day. Nothing here must know the name of a key, but for the two parts that a start leaves to the mode.

use std::borrow::Cow;
use std::ops::Range;

use mmt_client::device::DeviceProfile;
use mmt_server::estimator::EstimatorConfig;
use mmt_server::slave::SlaveConfig;
use mmt_server::trigger::TriggerConfig;
use mmt_shared::model::settings::Mode;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error};

use super::plan::Start;
use crate::reproduce::paper_world;
use crate::world::WorldConfig;

/// Puts `value` at a key written with dots, whose place is `span`; tables on the way are made.
pub(super) fn lay_at<'i>(
    whole: &mut DeTable<'i>,
    key: &str,
    span: &Range<usize>,
    value: Spanned<DeValue<'i>>,
) {
    let (first, rest) = key
        .split_once('.')
        .map_or((key, None), |(first, rest)| (first, Some(rest)));
    let Some(rest) = rest else {
        lay_one(
            whole,
            Spanned::new(span.clone(), Cow::Owned(first.to_owned())),
            value,
        );
        return;
    };
    if let Some(DeValue::Table(inner)) = whole.get_mut(first).map(Spanned::get_mut) {
        lay_at(inner, rest, span, value);
        return;
    }
    let mut inner = DeTable::new();
    lay_at(&mut inner, rest, span, value);
    let inner = Spanned::new(span.clone(), DeValue::Table(inner));
    put(
        whole,
        Spanned::new(span.clone(), Cow::Owned(first.to_owned())),
        inner,
    );
}

/// Puts the given keys over the ones that are there, table by table.
pub(super) fn lay_over<'i>(whole: &mut DeTable<'i>, given: DeTable<'i>) {
    for (key, value) in given {
        lay_one(whole, key, value);
    }
}

fn lay_one<'i>(whole: &mut DeTable<'i>, key: Spanned<Cow<'i, str>>, value: Spanned<DeValue<'i>>) {
    let there = whole.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut);
    match (there, value) {
        (Some(DeValue::Table(there)), value) if is_within(there, value.get_ref()) => {
            if let DeValue::Table(given) = value.into_inner() {
                lay_over(there, given);
            }
        }
        (_, value) => put(whole, key, value),
    }
}

/// Whether a value is a table that belongs into the one that is there. Two tables with one key each that differs
/// are two cases of one choice, as `{ in-time = … }` and `{ per-packet = … }`: the later one replaces the other.
fn is_within(there: &DeTable, value: &DeValue) -> bool {
    let DeValue::Table(given) = value else {
        return false;
    };
    there.len() != 1 || given.len() != 1 || there.keys().eq(given.keys())
}

/// Inserts with the place of the new key: a map keeps the old key where it has an equal one.
fn put<'i>(whole: &mut DeTable<'i>, key: Spanned<Cow<'i, str>>, value: Spanned<DeValue<'i>>) {
    whole.remove(key.get_ref().as_ref());
    whole.insert(key, value);
}

/// What must be known of the given keys to choose what they are laid over.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Hints {
    slave: SlaveHints,
    stiffness_n_per_m: Option<f64>,
    settings: Option<serde::de::IgnoredAny>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct SlaveHints {
    mode: Option<Mode>,
    estimator: Option<serde::de::IgnoredAny>,
}

/// The start in the mode that the keys name. The local model's settings and the estimator's are the mode's own
/// and absent, unless a key reaches into them.
fn beginning(start: Start, given: &Spanned<DeTable>) -> WorldConfig {
    // keys of a wrong type are told when everything is read
    let hints = Hints::deserialize(Deserializer::from(given.clone())).unwrap_or_default();
    let mode = hints.slave.mode.unwrap_or(Mode::Recommended);
    let mut world = match start {
        Start::Live => WorldConfig {
            slave: SlaveConfig::of_mode(mode),
            ..WorldConfig::default()
        },
        Start::PaperExperiment => paper_world(mode, TriggerConfig::of_mode(mode).scheme),
    };
    let device = DeviceProfile::default();
    let device = device
        .used_with(hints.stiffness_n_per_m, None)
        .unwrap_or(device);
    let coupling = device.coupling();
    if hints.settings.is_some() && world.settings.is_none() {
        world.settings = Some(mode.model_settings(coupling));
    }
    if hints.slave.estimator.is_some() {
        world.slave.estimator = Some(EstimatorConfig::of_mode(mode, coupling));
    }
    world
}

/// The configuration that the given keys make of a start; `text_len` is the length of the plan's text.
///
/// # Errors
/// A key is unknown or its value is none; a span beyond the plan's text is no place of the plan.
pub(super) fn effective(
    start: Start,
    given: Spanned<DeTable>,
    text_len: usize,
) -> Result<WorldConfig, Error> {
    let world = beginning(start, &given);
    let written = toml::to_string(&world)
        .map_err(|error| serde::de::Error::custom(format!("no start: {error}")))?;
    // blanks as long as the plan put every place of the start behind the plan's end
    let written = format!("{}\n{written}", " ".repeat(text_len));
    let mut whole = DeTable::parse(&written)?;
    lay_over(whole.get_mut(), given.into_inner());
    WorldConfig::deserialize(Deserializer::from(whole))
}
