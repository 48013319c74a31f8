//! The emulated network in front of a host's own socket: its record, its commands, what it will do.

use std::path::PathBuf;

use mmt_netem::effect::BYTES;
use mmt_netem::io::record_file::RecordFile;
use mmt_netem::io::socket::{SocketControl, SocketExtras};
use mmt_netem::record::Heading;
use mmt_netem::{Direction, LinkConfig};

use super::control::{self, Command};
use super::record_file;
use crate::args::EmulationArguments;
use crate::failure::Failure;
use crate::output::note;

/// Commands a second, for which the effect of a network up is printed.
const UP_HZ: f64 = 100.0;
/// Heartbeats, updates and QUIC's acknowledgements a second, for which that of a network down is printed.
const DOWN_HZ: f64 = 40.0;

/// Record and control of the emulated networks of a run.
#[derive(Debug, Default)]
pub(crate) struct Emulation {
    record: Option<(PathBuf, RecordFile)>,
    controls: Option<[SocketControl; 2]>,
    /// Whether stdin gives commands.
    orders: bool,
}

impl Emulation {
    /// Opens the record and begins to take commands: from stdin if the arguments ask for that, else, if it is `controlled`, from
    /// this process. `up` and `down`: the networks of this run; none where
    /// this process sends nothing.
    ///
    /// # Errors
    /// The record cannot be written.
    pub(crate) fn start(
        arguments: &EmulationArguments,
        controlled: bool,
        seed: u64,
        up: Option<&LinkConfig>,
        down: Option<&LinkConfig>,
    ) -> Result<Self, Failure> {
        let words =
            |link: Option<&LinkConfig>| link.map_or_else(String::new, LinkConfig::to_string);
        let controlled = controlled || arguments.netem_control;
        let heading = Heading {
            seed,
            up: words(up),
            down: words(down),
        };
        let record = match &arguments.netem_record {
            Some(path) => Some((path.clone(), record_file(path, &heading)?)),
            None => None,
        };
        let emulation = Self {
            record,
            controls: controlled.then(Default::default),
            orders: arguments.netem_control,
        };
        if let Some([control_up, control_down]) =
            (emulation.controls.clone()).filter(|_| emulation.orders)
        {
            let up = up.map(|_| control_up);
            let down = down.map(|_| control_down);
            control::from_stdin(move |line| {
                if let Err(what) = apply(line, up.as_ref(), down.as_ref()) {
                    note(what);
                }
                true
            });
        }
        Ok(emulation)
    }

    /// For the socket that sends in this direction.
    pub(crate) fn extras(&self, direction: Direction) -> SocketExtras {
        let control = self.controls.clone().map(|[up, down]| match direction {
            Direction::Up => up,
            Direction::Down => down,
        });
        SocketExtras {
            record: self.record.as_ref().map(|(_, file)| file.writer()),
            control,
        }
    }

    /// Whether commands come from stdin: then a live view would take the keys away.
    pub(crate) fn takes_orders(&self) -> bool {
        self.orders
    }

    /// New settings in this direction from now on.
    ///
    /// # Errors
    /// A setting out of its range, or nothing to set.
    pub(crate) fn reconfigure(
        &self,
        direction: Direction,
        link: &LinkConfig,
    ) -> Result<(), String> {
        let Some([up, down]) = &self.controls else {
            return Err("these networks cannot be changed".to_owned());
        };
        let control = match direction {
            Direction::Up => up,
            Direction::Down => down,
        };
        control
            .reconfigure(link.clone())
            .map_err(|error| error.to_string())
    }

    /// Waits until the record is written.
    ///
    /// # Errors
    /// It could not be.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let Some((path, file)) = self.record else {
            return Ok(());
        };
        let shown = path.display();
        match file.finish() {
            Ok(0) => Ok(()),
            Ok(missed) => {
                note(format_args!("the record {shown} misses {missed} packets"));
                Ok(())
            }
            Err(error) => Err(Failure::failed(format!("the record {shown}: {error}"))),
        }
    }
}

fn apply(
    line: &str,
    up: Option<&SocketControl>,
    down: Option<&SocketControl>,
) -> Result<(), String> {
    let (direction, link) = match Command::parse(line)? {
        None => return Ok(()),
        Some(Command::Rebind) => return Err("only the relay (mmt netem) can rebind".to_owned()),
        Some(Command::Link(direction, link)) => (direction, link),
    };
    let control = match direction {
        Direction::Up => up,
        Direction::Down => down,
    };
    let Some(control) = control else {
        let name = direction.name();
        return Err(format!(
            "nothing is sent {name} from here: give the command at the other end"
        ));
    };
    let effect = effect(direction, &link).map_err(|error| error.to_string())?;
    control
        .reconfigure(*link)
        .map_err(|error| error.to_string())?;
    note(effect);
    Ok(())
}

/// The line with what a network will really do.
///
/// # Errors
/// A setting out of its range.
pub(crate) fn effect(direction: Direction, link: &LinkConfig) -> Result<String, Failure> {
    let rate = match direction {
        Direction::Up => UP_HZ,
        Direction::Down => DOWN_HZ,
    };
    let effect = link.expected(rate, BYTES).map_err(Failure::usage)?;
    Ok(format!(
        "network {:5} {effect}",
        format!("{}:", direction.name())
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_reach_the_direction_that_this_end_sends_and_no_other() {
        let up = SocketControl::default();
        assert_eq!(apply("up delay 5ms", Some(&up), None), Ok(()));
        assert_eq!(apply("", Some(&up), None), Ok(()));
        let down = apply("down delay 5ms", Some(&up), None).unwrap_err();
        assert!(down.contains("the other end"), "{down}");
        let rebind = apply("rebind", Some(&up), None).unwrap_err();
        assert!(rebind.contains("relay"), "{rebind}");
    }

    #[test]
    fn a_record_that_cannot_be_written_is_refused_before_anything_runs() {
        let arguments = EmulationArguments {
            netem_record: Some("/no/such/folder/run.csv".into()),
            netem_control: false,
        };
        let failure = Emulation::start(&arguments, false, 1, None, None).unwrap_err();
        assert!(failure.to_string().contains("/no/such/folder/run.csv"));
    }

    #[test]
    fn the_effect_of_a_network_reads_as_in_the_documents() {
        let link = "delay 50ms".parse().unwrap();
        let line = effect(Direction::Up, &link).unwrap();
        assert!(
            line.starts_with("network up:   at 100 packets/s: delay mean 50.00 ms"),
            "{line}"
        );
    }
}
