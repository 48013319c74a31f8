//! TUN devices: network interfaces whose packets a program reads and writes.
//!
//! One call of the kernel. The crate for it, `tun-rs`, would bring 22 packages, most of them for other systems.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::OwnedFd;

use nix::libc::{IFF_NO_PI, IFF_TUN};
use rustix::ioctl::{Setter, ioctl, opcode};

const DEVICE: &str = "/dev/net/tun";
/// The longest name of an interface, bytes.
const NAME_MAX: usize = 15;

/// `struct ifreq` (netdevice(7)).
#[repr(C)]
struct Request {
    name: [u8; NAME_MAX + 1],
    flags: i16,
    rest: [u8; 22],
}

/// The device from which interfaces are made.
///
/// # Errors
/// It is not there, or not open to this user.
pub(super) fn open() -> io::Result<File> {
    let device = OpenOptions::new().read(true).write(true).open(DEVICE);
    device.map_err(|error| io::Error::new(error.kind(), format!("{DEVICE}: {error}")))
}

/// A new interface of this name in the namespace of this thread. It is gone when its descriptor is closed.
///
/// # Errors
/// The host forbids it.
pub(super) fn make(name: &str) -> io::Result<OwnedFd> {
    /// `TUNSETIFF` (linux/if_tun.h).
    const MAKE: rustix::ioctl::Opcode = opcode::write::<i32>(b'T', 202);
    let device = open()?;
    let mut request = Request {
        name: [0; NAME_MAX + 1],
        // packets begin with their IP header
        flags: (IFF_TUN | IFF_NO_PI) as i16,
        rest: [0; 22],
    };
    for (slot, byte) in request.name.iter_mut().zip(name.bytes().take(NAME_MAX)) {
        *slot = byte;
    }
    // SAFETY: this call reads and writes one `struct ifreq` of 40 bytes, which `Request` is.
    #[allow(unsafe_code, reason = "no safe wrapper of this call exists")]
    unsafe {
        ioctl(&device, Setter::<MAKE, Request>::new(request))?;
    }
    Ok(device.into())
}
