//! Reads a plan's text into configurations, and reports of each wrong key or value where it stands.
//!
//! Whatever a run could refuse must be refused here, before anything runs.

use std::ops::Range;
use std::time::Duration;

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::given::{Given, outdone};
use super::placed::{AxisHead, PlacedAxis, placed_axis};
use super::plan::{Plan, ROWS_MAX, Seeds, Start, steps};
use super::start::beginning;
use crate::layers::{SEED_KEYS, at, configuration};
use crate::overlay::{lay, lay_at, lay_over};
use crate::text_error::TextError;
use crate::trial::{Change, TrialError};
use crate::world::{World, WorldConfig};

/// Accepted length of a run, s: one tick to a week.
const DURATION_S: (f64, f64) = (0.001, 604_800.0);
/// The most parts of a key: no configuration is as deep, and each part is a table in a table.
const KEY_PARTS_MAX: usize = 16;

impl Plan {
    /// The plan of a text in TOML (`docs/sweep.md` has its keys).
    ///
    /// # Errors
    /// What is wrong with which key or value, with its line: nothing of the plan has run by then.
    pub fn parse(text: &str) -> Result<Self, TextError> {
        Self::parse_over(text, "")
    }

    /// The same, with the plan's keys laid over those of a configuration that has been read before.
    ///
    /// # Errors
    /// As [`Plan::parse`].
    pub fn parse_over(text: &str, below: &str) -> Result<Self, TextError> {
        let root = DeTable::parse(text).map_err(|error| TextError::of(text, &error))?;
        let head = Head::deserialize(Deserializer::from(root.clone()))
            .map_err(|error| TextError::of(text, &error))?;
        let duration = head.duration(text)?;
        let reader = Reader::new(text, below, &root, &head)?;
        reader.check_size(head.seeds.get_ref(), &head.seeds.span())?;
        let change = head.change(text)?;
        Ok(Self {
            duration,
            seeds: *head.seeds.get_ref(),
            change,
            points: reader.points(change)?,
            axes: reader.axes.iter().map(|axis| axis.plain(text)).collect(),
        })
    }
}

/// What a plan holds beside the values, which keep their places.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    duration_s: Spanned<f64>,
    seeds: Spanned<Seeds>,
    #[serde(default)]
    start: Start,
    base: Option<Spanned<IgnoredAny>>,
    #[serde(default)]
    axis: Vec<Spanned<AxisHead>>,
    change: Option<Spanned<Change>>,
}

impl Head {
    fn duration(&self, text: &str) -> Result<Duration, TextError> {
        let (least, most) = DURATION_S;
        let seconds = *self.duration_s.get_ref();
        if !(least..=most).contains(&seconds) {
            let what = format!("duration_s is {seconds}; it must be {least} to {most}");
            return Err(TextError::at(text, Some(self.duration_s.span()), what));
        }
        Ok(Duration::from_secs_f64(seconds))
    }

    fn change(&self, text: &str) -> Result<Option<Change>, TextError> {
        let Some(change) = &self.change else {
            return Ok(None);
        };
        let contact_s = change.get_ref().contact_s;
        if !(contact_s.is_finite() && contact_s >= 0.0) {
            let what = format!("contact_s of the change is {contact_s}; it must be at least 0");
            return Err(TextError::at(text, Some(change.span()), what));
        }
        Ok(Some(*change.get_ref()))
    }
}

/// Turns the placed keys and values into configurations.
struct Reader<'i> {
    text: &'i str,
    /// The keys of a configuration below all of these.
    below: Spanned<DeTable<'i>>,
    start: Start,
    base: Spanned<DeTable<'i>>,
    axes: Vec<PlacedAxis<'i>>,
    /// Where the plan has what the change makes of the object.
    to: Option<Range<usize>>,
}

impl<'i> Reader<'i> {
    fn new(
        text: &'i str,
        below: &'i str,
        root: &Spanned<DeTable<'i>>,
        head: &Head,
    ) -> Result<Self, TextError> {
        let base = match (root.get_ref().get("base"), &head.base) {
            (Some(base), Some(place)) => match base.get_ref() {
                DeValue::Table(table) => Spanned::new(place.span(), table.clone()),
                _ => {
                    return Err(TextError::at(
                        text,
                        Some(place.span()),
                        "base must be a table",
                    ));
                }
            },
            _ => Spanned::new(text.len() + 1..text.len() + 1, DeTable::new()),
        };
        let placed = root
            .get_ref()
            .get("axis")
            .and_then(|axes| axes.get_ref().as_array());
        let placed = placed.into_iter().flat_map(|axes| axes.iter());
        let axes = head.axis.iter().zip(placed);
        let axes = axes.map(|(head, placed)| placed_axis(text, head, placed.get_ref()));
        let reader = Self {
            text,
            below: configuration(below)?,
            start: head.start,
            base,
            axes: axes.collect::<Result<_, _>>()?,
            to: at(root.get_ref(), "change.to").map(place_of_value),
        };
        reader.check_keys()?;
        outdone(
            text,
            reader.below.get_ref(),
            reader.base.get_ref(),
            &reader.axes,
        )?;
        Ok(reader)
    }

    /// No key twice or within another, and no seed.
    fn check_keys(&self) -> Result<(), TextError> {
        let keys: Vec<&Spanned<String>> = self.axes.iter().flat_map(|axis| &axis.keys).collect();
        for (n, key) in keys.iter().enumerate() {
            let name = key.get_ref();
            let refuse = |what: String| Err(TextError::at(self.text, Some(key.span()), what));
            if name.split('.').any(str::is_empty) || name.split('.').count() > KEY_PARTS_MAX {
                return refuse(format!(
                    "`{name}` is no key; write it as slave.trigger.scheme"
                ));
            }
            if SEED_KEYS.contains(&name.as_str()) {
                return refuse(format!(
                    "`{name}` is no axis: the seeds of a plan are `seeds`"
                ));
            }
            let overlaps = |other: &&&Spanned<String>| {
                let other = other.get_ref();
                let within =
                    |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.starts_with('.'));
                name == other || within(name, other) || within(other, name)
            };
            if let Some(other) = keys.iter().take(n).find(overlaps) {
                return refuse(format!(
                    "`{name}` varies what `{}` varies already",
                    other.get_ref()
                ));
            }
        }
        for key in SEED_KEYS {
            let mut inner = Some(self.base.get_ref());
            let (path, last) = key.rsplit_once('.').unwrap_or(("", key));
            if !path.is_empty() {
                inner = inner.and_then(|base| base.get(path)?.get_ref().as_table());
            }
            if let Some((place, _)) = inner.and_then(|base| base.get_key_value(last)) {
                let what = format!("`{key}` is not for base: the seeds of a plan are `seeds`");
                return Err(TextError::at(self.text, Some(place.span()), what));
            }
        }
        Ok(())
    }

    fn check_size(&self, seeds: &Seeds, place: &Range<usize>) -> Result<(), TextError> {
        let refuse = |what: String| Err(TextError::at(self.text, Some(place.clone()), what));
        if seeds.count == 0 {
            return refuse("count of seeds is 0; it must be at least 1".to_owned());
        }
        if seeds.first.checked_add(seeds.count).is_none() {
            return refuse("the last seed is no number of 64 bits".to_owned());
        }
        let sizes = self.axes.iter().map(|axis| axis.steps.len() as u64);
        let rows = sizes.fold(seeds.count, u64::saturating_mul);
        if rows > ROWS_MAX {
            return refuse(format!(
                "{rows} rows are too many; a plan has at most {ROWS_MAX}"
            ));
        }
        Ok(())
    }

    /// The configuration at every point of the grid, each tried.
    fn points(&self, change: Option<Change>) -> Result<Vec<WorldConfig>, TextError> {
        let sizes: Vec<usize> = self.axes.iter().map(|axis| axis.steps.len()).collect();
        let points = 0..sizes.iter().product();
        let mut given = Given::of(self.base.get_ref(), &self.axes);
        let points = points
            .map(|point| {
                let steps: Vec<Option<usize>> =
                    steps(point, &sizes).into_iter().map(Some).collect();
                let config = self.config(&steps)?;
                match attempt(&config, change) {
                    Ok(()) => given.see(&config),
                    Err(error) => return Err(self.refused(&steps, change, &error)),
                }
                Ok(config)
            })
            .collect::<Result<_, _>>()?;
        given.refused(self.text)?;
        Ok(points)
    }

    /// The configuration with each axis at a step, or left out.
    fn config(&self, steps: &[Option<usize>]) -> Result<WorldConfig, TextError> {
        let mut given = self.base.clone();
        for (key, value) in self.assignments(steps) {
            lay_at(given.get_mut(), key.get_ref(), &key.span(), value.clone());
        }
        let mut hints = self.below.clone();
        lay_over(hints.get_mut(), given.get_ref().clone());
        let start = beginning(self.start, &hints);
        lay(&start, self.below.clone(), self.text.len())
            .and_then(|start| lay(&start, given, self.text.len()))
            .map_err(|error| TextError::of(self.text, &error).context(&self.named(steps)))
    }

    fn assignments(
        &self,
        steps: &[Option<usize>],
    ) -> impl Iterator<Item = (&Spanned<String>, &Spanned<DeValue<'i>>)> {
        let placed = self.axes.iter().zip(steps);
        let placed = placed.filter_map(|(axis, step)| Some((axis, axis.steps.get((*step)?)?)));
        placed.flat_map(|(axis, values)| axis.keys.iter().zip(values))
    }

    /// Where the grid stands, for people.
    fn named(&self, steps: &[Option<usize>]) -> String {
        let named = self.assignments(steps).map(|(key, value)| {
            let value = self.text.get(value.span()).unwrap_or_default();
            format!("{} = {value}", key.get_ref())
        });
        named.collect::<Vec<_>>().join(", ")
    }

    /// An error with the place that is to blame: the change where all is well without it, the base, or the first axis whose
    /// value is refused without the other axes, or no place where only values together are.
    fn refused(
        &self,
        steps: &[Option<usize>],
        change: Option<Change>,
        error: &TrialError,
    ) -> TextError {
        let refuses = |steps: &[Option<usize>]| {
            let config = self.config(steps);
            config.is_ok_and(|config| attempt(&config, change).is_err())
        };
        let whole = self.config(steps);
        if whole.is_ok_and(|config| attempt(&config, None).is_ok()) {
            let error = TextError::at(self.text, self.to.clone(), error);
            let always = refuses(&vec![None; steps.len()]);
            let named = self.named(steps);
            return error.context(if always { "" } else { &named });
        }
        if refuses(&vec![None; steps.len()]) {
            return TextError::at(self.text, Some(self.base.span()), error);
        }
        let alone = |axis: usize| -> Vec<Option<usize>> {
            let kept = |(n, step): (usize, &Option<usize>)| step.filter(|_| n == axis);
            steps.iter().enumerate().map(kept).collect()
        };
        let to_blame = (0..steps.len()).map(alone).find(|steps| refuses(steps));
        let place = to_blame.and_then(|steps| {
            let mut spans = self.assignments(&steps).map(|(_, value)| value.span());
            let first = spans.next()?;
            Some(first.start..spans.last().map_or(first.end, |last| last.end))
        });
        TextError::at(self.text, place, error).context(&self.named(steps))
    }
}

/// Where a value stands; of a table with one key that of the key's.
fn place_of_value(value: &Spanned<DeValue>) -> Range<usize> {
    let table = value.get_ref().as_table();
    let only = table.and_then(|table| table.values().next());
    only.unwrap_or(value).span()
}

/// Makes the world, and where there is a change makes it at once: whatever a run could refuse is refused here.
fn attempt(config: &WorldConfig, change: Option<Change>) -> Result<(), TrialError> {
    let mut world = World::try_new(config)?;
    if let Some(change) = change {
        change.to.apply(world.environment_mut())?;
    }
    Ok(())
}
