//! What a run is judged by: every metric is defined here, once.
//!
//! Holds (13)–(15). Each file is one idea: a streaming accumulator of fixed size that is fed once per
//! tick or event, never allocates and never becomes NaN. A metric that has no meaning in a run is absent
//! (`None`), never 0. Formulas, units and edge cases in words: `docs/metrics.md`.

mod age;
mod contact;
mod force;
mod peak;
mod pose;
mod staleness;
mod updates;

pub use age::AgeOfInformation;
pub use contact::ContactBreaks;
pub use force::{F_MIN_N, ForceMetrics, ForceSummary, JND_HIGH, JND_LOW};
pub use peak::ForcePeak;
pub use pose::PoseError;
pub use staleness::Staleness;
pub use updates::UpdateCounts;
