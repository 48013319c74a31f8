//! The engine of the experiments: a grid of cases and seeds, columns over what its runs measured, and the description
//! by which the command line finds an experiment.

#[cfg(feature = "io")]
pub mod description;
pub mod findings;
pub mod grid;
#[cfg(feature = "io")]
pub(crate) mod prelude;
