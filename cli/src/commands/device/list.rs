//! `mmt device list`: what can be plugged in, and what of it is there.

use std::fmt;
use std::net::SocketAddr;

use mmt_client::io::device::ports::{SerialPort, serial_ports};
use mmt_client::io::device::version;
use mmt_shared::clean::clean;
use serde::Serialize;

use crate::args::DeviceListArguments;
use crate::failure::Failure;
use crate::output::{print, print_json};

/// What can be plugged in.
#[derive(Debug, Serialize)]
struct Document {
    version: &'static str,
    command: &'static str,
    /// How a device of one's own is plugged in.
    link: &'static str,
    inverse3: Service,
    #[serde(rename = "2diy")]
    two_diy: Ports,
}

/// The vendor's service.
#[derive(Debug, Serialize)]
struct Service {
    service: SocketAddr,
    reachable: bool,
    /// Its version; null if it reports none.
    service_version: Option<String>,
    /// Why it is not reachable.
    why: Option<String>,
}

#[derive(Debug, Serialize)]
struct Ports {
    ports: Vec<SerialPort>,
}

/// Runs `mmt device list`.
///
/// # Errors
/// stdout cannot be written to.
pub(super) fn run(arguments: &DeviceListArguments) -> Result<(), Failure> {
    let service = arguments.service();
    let (reachable, service_version, why) = match version(service) {
        Ok(version) => (true, version, None),
        Err(error) => (false, None, Some(error.to_string())),
    };
    let document = Document {
        version: env!("CARGO_PKG_VERSION"),
        command: "device list",
        link: "--device link",
        inverse3: Service {
            service,
            reachable,
            service_version,
            why,
        },
        two_diy: Ports {
            ports: serial_ports(),
        },
    };
    if arguments.json {
        print_json(&document)
    } else {
        print(document)
    }
}

impl fmt::Display for Document {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "link      any device over UDP: {}", self.link)?;
        let Service {
            service,
            service_version,
            why,
            ..
        } = &self.inverse3;
        // what calls itself so may be anything
        let service_version = service_version.as_deref().map(clean);
        match (why, service_version) {
            (Some(why), _) => writeln!(f, "inverse3  no Inverse Service at {service}: {why}")?,
            (None, Some(version)) => {
                writeln!(f, "inverse3  Inverse Service {version} at {service}")?
            }
            (None, None) => writeln!(
                f,
                "inverse3  something at {service} that reports no version"
            )?,
        }
        if self.two_diy.ports.is_empty() {
            return write!(f, "2diy      no serial port of a USB device");
        }
        for (n, port) in self.two_diy.ports.iter().enumerate() {
            let end = if n == 0 { "" } else { "\n" };
            let product = port.product.as_deref().map(clean);
            let product = product.as_deref().unwrap_or("reports no name");
            let board = if port.looks_like_a_board {
                ", looks like the board"
            } else {
                ""
            };
            write!(
                f,
                "{end}2diy      {}: {product}{board}",
                port.port.display()
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_service_and_a_device_call_themselves_steers_no_terminal_and_forges_no_line() {
        let hostile = || Some("3.1\x1b[2J\n2diy      forged".to_owned());
        let document = Document {
            version: "0",
            command: "device list",
            link: "--device link",
            inverse3: Service {
                service: ([127, 0, 0, 1], 10001).into(),
                reachable: true,
                service_version: hostile(),
                why: None,
            },
            two_diy: Ports {
                ports: vec![SerialPort {
                    port: "/dev/ttyACM0".into(),
                    product: hostile(),
                    looks_like_a_board: true,
                }],
            },
        };
        let shown = document.to_string();
        assert_eq!(shown.lines().count(), 3, "{shown:?}");
        assert!(!shown.contains('\x1b'), "{shown:?}");
    }
}
