//! Keys of a file laid over a configuration that is there already, each with its place in the file's text.
//!
//! Everything goes through the configuration's own reader, so a key that a configuration learns can be laid the same
//! day. Nothing here must know the name of a key.

use std::borrow::Cow;
use std::ops::Range;

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error};

/// The configuration `base` with the given keys laid over it; `text_len` is the length of the text that they stand in.
///
/// # Errors
/// A key is unknown or its value is none; a span beyond the text is no place of the text.
pub(crate) fn lay<T: Serialize + DeserializeOwned>(
    base: &T,
    given: Spanned<DeTable>,
    text_len: usize,
) -> Result<T, Error> {
    let written = toml::to_string(base)
        .map_err(|error| serde::de::Error::custom(format!("no start: {error}")))?;
    // blanks as long as the text put every place of the base behind the text's end
    let written = format!("{}\n{written}", " ".repeat(text_len));
    let mut whole = DeTable::parse(&written)?;
    lay_over(whole.get_mut(), given.into_inner());
    T::deserialize(Deserializer::from(whole))
}

/// Puts `value` at a key written with dots, whose place is `span`; tables on the way are made.
pub(crate) fn lay_at<'i>(
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
pub(crate) fn lay_over<'i>(whole: &mut DeTable<'i>, given: DeTable<'i>) {
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
