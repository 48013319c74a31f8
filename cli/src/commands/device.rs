//! The hand's device as a command uses it: a known one, or one that is plugged in. And `mmt device`.

mod gauge;
mod hand;
mod list;
mod test;

use crate::args::{DevicesArguments, DevicesCommand};
use crate::failure::Failure;
pub(super) use hand::{Device, configuration, profile};

/// Runs `mmt device`.
///
/// # Errors
/// Wrong input, or a device that is unfit.
pub(crate) fn run(arguments: &DevicesArguments) -> Result<(), Failure> {
    match &arguments.command {
        DevicesCommand::List(arguments) => list::run(arguments),
        DevicesCommand::Test(arguments) => test::run(arguments),
    }
}
