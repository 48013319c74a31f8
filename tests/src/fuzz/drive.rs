//! Runs a target over many inputs, and reports the one that fails.

use std::collections::BTreeSet;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::mutate::Mutator;
use super::outcome::Outcome;
use super::target::Target;

/// Inputs that are kept to be mutated further, besides the seeds.
const KEPT_MAX: usize = 500;

/// What is to be run.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Seed of the mutations.
    pub seed: u64,
    /// Which part of several that run at once.
    pub shard: u64,
    /// How many inputs.
    pub inputs: u64,
}

/// What it came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ran {
    /// Inputs that the target took.
    pub accepted: u64,
    /// Inputs that it refused.
    pub refused: u64,
    /// Sorts of inputs and reasons of refusal that were met.
    pub marks: u64,
    /// The most memory that one input took at once, bytes.
    pub peak: u64,
    /// A digest of all outcomes: equal for equal plans.
    pub digest: u64,
}

impl Ran {
    /// Inputs in all.
    #[must_use]
    pub fn inputs(&self) -> u64 {
        self.accepted + self.refused
    }

    /// Both together.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            accepted: self.accepted + other.accepted,
            refused: self.refused + other.refused,
            marks: self.marks.max(other.marks),
            peak: self.peak.max(other.peak),
            digest: self.digest ^ other.digest,
        }
    }
}

/// An input that broke a promise.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The target.
    pub target: &'static str,
    /// The input.
    pub input: Vec<u8>,
    /// The how-manieth it was, from 1.
    pub number: u64,
    /// What was said of it.
    pub why: String,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            target,
            input,
            number,
            why,
        } = self;
        write!(
            f,
            "{target}: input {number}, {} bytes: {why}\n{}",
            input.len(),
            shown(input)
        )
    }
}

/// An input as people read it.
#[must_use]
pub fn shown(input: &[u8]) -> String {
    let text = input.escape_ascii().to_string();
    let cut = text
        .char_indices()
        .nth(1200)
        .map_or(text.len(), |(at, _)| at);
    text[..cut].to_owned()
}

/// Who looks on.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    /// Is shown each input before it is run.
    pub before: fn(&'static str, &[u8]),
    /// Runs what it is given and returns how much memory that took at once, bytes.
    pub measured: fn(&mut dyn FnMut()) -> u64,
}

/// Runs a target over its seeds, over `kept` and over inputs that are made of both.
///
/// # Errors
/// The first input that breaks a promise.
pub fn drive(
    target: &Target,
    plan: &Plan,
    kept: &[Vec<u8>],
    watch: &Watch,
) -> Result<Ran, Failure> {
    let mut pool = (target.seeds)();
    pool.extend_from_slice(kept);
    let seeds = pool.len();
    // inputs of the pool that were taken
    let mut taken = Vec::new();
    let mut mutator = Mutator::new(
        plan.seed,
        target.name,
        plan.shard,
        target.words,
        target.longest,
    );
    let (mut ran, mut marks) = (Ran::default(), BTreeSet::new());
    let mut input = Vec::new();
    for number in 1..=plan.inputs {
        match usize::try_from(number - 1)
            .ok()
            .and_then(|number| pool.get(number))
            .filter(|_| number <= seeds as u64)
        {
            Some(seed) => seed.clone_into(&mut input),
            None => mutator.next(&pool, &taken, &mut input),
        }
        (watch.before)(target.name, &input);
        let (outcome, peak) = judged(target, &input, watch.measured).map_err(|why| Failure {
            target: target.name,
            input: input.clone(),
            number,
            why,
        })?;
        let is_seed = number <= seeds as u64;
        if is_seed && outcome.accepted {
            taken.push(number as usize - 1);
        }
        if marks.insert(outcome.mark) && !is_seed && pool.len() < seeds + KEPT_MAX {
            if outcome.accepted {
                taken.push(pool.len());
            }
            pool.push(input.clone());
        }
        ran.accepted += u64::from(outcome.accepted);
        ran.refused += u64::from(!outcome.accepted);
        ran.peak = ran.peak.max(peak);
        ran.digest = (ran.digest ^ outcome.mark).wrapping_mul(0x0100_0000_01b3);
    }
    ran.marks = marks.len() as u64;
    Ok(ran)
}

/// One input: what became of it and the memory that it took, or what was said when a promise broke.
fn judged(
    target: &Target,
    input: &[u8],
    measured: fn(&mut dyn FnMut()) -> u64,
) -> Result<(Outcome, u64), String> {
    let mut outcome = None;
    let peak = measured(&mut || {
        outcome = Some(catch_unwind(AssertUnwindSafe(|| (target.run)(input))));
    });
    let outcome = match outcome {
        Some(Ok(outcome)) => outcome,
        Some(Err(said)) => return Err(said_of(said.as_ref())),
        None => return Err("it was not run".to_owned()),
    };
    let most = target.room_kb * 1024 + 64 * input.len() as u64;
    if peak > most {
        return Err(format!(
            "it takes {peak} bytes of memory at once, {most} are allowed"
        ));
    }
    Ok((outcome, peak))
}

/// What a panic said.
fn said_of(said: &(dyn std::any::Any + Send)) -> String {
    let text = said.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| said.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "a panic without words".to_owned())
}
