//! A grid over configuration: which trials a plan asks for, in which order, and what its table of results holds.
//!
//! Pure: a row is a function of the plan and the row's number. It must never depend on which rows ran before, on
//! which machine or in which shard, so that results come out the same byte for byte however the work is cut.

mod given;
mod measures;
mod placed;
mod plan;
mod reader;
mod results;
mod shard;
mod start;

pub use measures::columns;
pub use plan::{Axis, Plan, ROWS_MAX, Row, Seeds, Start};
pub use results::{PartError, Results, RowResult, part_header};
pub use shard::{Shard, ShardError};
pub(crate) use start::beginning;

#[cfg(test)]
mod tests;
