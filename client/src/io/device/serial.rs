//! A serial port of this host, raw: bytes out, bytes in within a time.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// An open port.
#[derive(Debug)]
pub(super) struct Serial(File);

impl Serial {
    /// Opens the port, raw.
    ///
    /// # Errors
    /// There is none, it may not be used, or it is no serial port.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true);
        let port = options
            .custom_flags(flags.bits().cast_signed())
            .open(path)?;
        let mut settings = tcgetattr(&port)?;
        settings.make_raw();
        tcsetattr(&port, OptionalActions::Flush, &settings)?;
        Ok(Self(port))
    }

    /// Writes all of it.
    ///
    /// # Errors
    /// The port is gone, or takes nothing for `within`.
    pub(super) fn write(&mut self, bytes: &[u8], within: Duration) -> io::Result<()> {
        let mut left = bytes;
        while !left.is_empty() {
            match self.0.write(left) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(written) => left = left.get(written..).unwrap_or_default(),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if !self.is_ready(PollFlags::OUT, within)? {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Reads until `room` is full or `within` is over; how many bytes came.
    ///
    /// # Errors
    /// The port is gone.
    pub(super) fn read(
        &mut self,
        room: &mut [u8],
        clock: Clock,
        within: Duration,
    ) -> io::Result<usize> {
        let end = clock.now() + within;
        let mut came = 0;
        while let Some(left) = room.get_mut(came..).filter(|left| !left.is_empty()) {
            match self.0.read(left) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(more) => came += more,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    let left = end.saturating_since(clock.now());
                    if left.is_zero() || !self.is_ready(PollFlags::IN, left)? {
                        break;
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(came)
    }

    /// Forgets what has come and was not read.
    ///
    /// # Errors
    /// The port is gone.
    pub(super) fn drain(&mut self) -> io::Result<()> {
        let mut room = [0; 256];
        // a peer that never stops is drained by and by
        for _ in 0..64 {
            match self.0.read(&mut room) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Waits until the port can be read or written to. Whether it can.
    fn is_ready(&self, flags: PollFlags, within: Duration) -> io::Result<bool> {
        let mut ports = [PollFd::new(&self.0, flags)];
        let within = Timespec::try_from(within).ok();
        match poll(&mut ports, within.as_ref()) {
            Ok(ready) => Ok(ready > 0),
            Err(Errno::INTR) => Ok(true),
            Err(error) => Err(error.into()),
        }
    }
}
