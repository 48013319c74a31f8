//! The serial ports of this host that a 2DIY could be at.

use std::path::{Path, PathBuf};

use serde::Serialize;

/// Names of the ports that USB devices get.
const NAMES: [&str; 2] = ["ttyACM", "ttyUSB"];
/// Vendors of the boards that the vendor's firmware is written for: Arduino, by both of its numbers.
const VENDORS: [&str; 2] = ["2341", "2a03"];

/// A serial port.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct SerialPort {
    /// Its path.
    pub port: PathBuf,
    /// What the device behind it calls itself; none if it does not.
    pub product: Option<String>,
    /// Whether its USB vendor is one that makes such boards.
    pub looks_like_a_board: bool,
}

/// All serial ports of USB devices, by name. Nothing is opened.
pub fn serial_ports() -> Vec<SerialPort> {
    ports_in(Path::new("/sys/class/tty"), Path::new("/dev"))
}

fn ports_in(classes: &Path, devices: &Path) -> Vec<SerialPort> {
    let entries = std::fs::read_dir(classes).into_iter().flatten().flatten();
    let named = entries.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        let known = NAMES.iter().any(|known| name.starts_with(known));
        known.then_some(name)
    });
    let mut ports: Vec<_> = named
        .map(|name| {
            // the interface; one above it is the device, two above of an adapter
            let interface = classes.join(&name).join("device");
            let of = |file: &str| {
                let places = ["..", "../.."].map(|above| interface.join(above).join(file));
                let text = places
                    .iter()
                    .find_map(|at| std::fs::read_to_string(at).ok());
                text.map(|text| text.trim().to_owned())
            };
            SerialPort {
                port: devices.join(&name),
                product: of("product"),
                looks_like_a_board: of("idVendor").is_some_and(|id| VENDORS.contains(&id.as_str())),
            }
        })
        .collect();
    ports.sort();
    ports
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_of_usb_devices_are_found_and_those_of_boards_known() {
        let place = tempfile::tempdir().unwrap();
        for (name, vendor) in [
            ("ttyACM0", "2341\n"),
            ("ttyUSB1", "0403\n"),
            ("tty7", "2341"),
        ] {
            let device = place.path().join(name).join("usb");
            std::fs::create_dir_all(device.join("interface")).unwrap();
            std::fs::write(device.join("idVendor"), vendor).unwrap();
            std::fs::write(device.join("product"), "Board\n").unwrap();
            std::os::unix::fs::symlink("usb/interface", place.path().join(name).join("device"))
                .unwrap();
        }
        let found = ports_in(place.path(), Path::new("/dev"));
        let seen = found
            .iter()
            .map(|port| (port.port.to_str().unwrap(), port.looks_like_a_board));
        assert_eq!(
            seen.collect::<Vec<_>>(),
            [("/dev/ttyACM0", true), ("/dev/ttyUSB1", false)]
        );
        assert_eq!(found[0].product.as_deref(), Some("Board"));
        assert_eq!(ports_in(Path::new("/nowhere"), Path::new("/dev")), []);
    }
}
