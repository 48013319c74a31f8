//! Keys on the terminal: those of the live view, and those of a run that shows plain lines.

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal};
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Mutex;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcgetpgrp, tcsetattr};

/// How the terminal of stdin was before a [`Keyboard`] took its keys one by one.
static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

/// Gives stdin's terminal back as it was; may be called from anywhere, any number of times.
pub(super) fn restore_keys() {
    let before = BEFORE.lock().ok().and_then(|mut before| before.take());
    if let Some(before) = before {
        // there is nothing else to try
        let _ = tcsetattr(io::stdin(), OptionalActions::Now, &before);
    }
}

/// The keys of a run without live view: each at once and without echo, while Ctrl-C and Ctrl-Z do what they always do. Dropping
/// it gives the terminal back.
pub(crate) struct Keyboard(Keys);

impl Keyboard {
    /// The keys of stdin; none if it is no terminal, or that of another job.
    pub(crate) fn take() -> Option<Self> {
        let stdin = io::stdin();
        if !stdin.is_terminal() || !is_ours() {
            return None;
        }
        let before = tcgetattr(&stdin).ok()?;
        let mut each = before.clone();
        each.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        let keys = Keys::of_terminal().ok()?;
        tcsetattr(&stdin, OptionalActions::Now, &each).ok()?;
        *BEFORE.lock().ok()? = Some(before);
        Some(Self(keys))
    }

    /// Waits for a key, no longer than `patience`; returns what it asks for. What is typed for another job is not read.
    ///
    /// # Errors
    /// The terminal cannot be read from, or is gone.
    pub(crate) fn wish(&mut self, patience: Duration) -> io::Result<Option<Wish>> {
        if is_ours() {
            return self.0.wish(patience);
        }
        std::thread::sleep(patience);
        Ok(None)
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        restore_keys();
    }
}

/// Whether what is typed on stdin's terminal is for this job: another one that read it would be stopped by the system.
fn is_ours() -> bool {
    tcgetpgrp(io::stdin()).is_ok_and(|front| front == rustix::process::getpgrp())
}

/// What is typed on the terminal. Read here and not by crossterm, whose reader spins for ever once the terminal is gone.
pub(super) struct Keys(OwnedFd);

impl Keys {
    /// Those of stdin if it is a terminal, else those of the terminal that the process belongs to.
    pub(super) fn of_terminal() -> io::Result<Self> {
        let stdin = io::stdin();
        Ok(Self(if stdin.is_terminal() {
            stdin.as_fd().try_clone_to_owned()?
        } else {
            File::open("/dev/tty")?.into()
        }))
    }

    pub(super) fn wish(&self, patience: Duration) -> io::Result<Option<Wish>> {
        let patience = Timespec::try_from(patience).unwrap_or_default();
        let mut polled = [PollFd::new(&self.0, PollFlags::IN)];
        match poll(&mut polled, Some(&patience)) {
            Ok(0) | Err(Errno::INTR) => return Ok(None),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        let [polled] = polled;
        let mut typed = [0; 64];
        let gone = PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL;
        let count = if polled.revents().intersects(gone) {
            0
        } else {
            rustix::io::read(&self.0, &mut typed)?
        };
        if count == 0 {
            return Err(io::Error::new(
                ErrorKind::BrokenPipe,
                "the terminal is gone",
            ));
        }
        Ok(typed.get(..count).and_then(Wish::of))
    }
}

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wish {
    /// The space bar: the emergency stop.
    Stop,
    /// c: no emergency stop any more.
    Clear,
    /// The end of the run.
    End,
}

impl Wish {
    /// The space bar before all others. Keys that begin with Esc are none.
    fn of(typed: &[u8]) -> Option<Self> {
        let pressed = |keys: &[u8]| {
            let one = |key| keys.contains(key);
            !typed.starts_with(b"\x1b") && typed.iter().any(one)
        };
        if pressed(b" ") {
            Some(Self::Stop)
        } else if ends(typed) {
            Some(Self::End)
        } else {
            pressed(b"cC").then_some(Self::Clear)
        }
    }
}

/// q, Esc or Ctrl-C: in raw mode the terminal makes no signal of the latter. Other keys that begin with Esc go on.
fn ends(typed: &[u8]) -> bool {
    typed == b"\x1b"
        || (!typed.starts_with(b"\x1b") && typed.iter().any(|key| b"qQ\x03".contains(key)))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn the_space_bar_stops_c_clears_and_q_escape_and_control_c_end() {
        for typed in [&b"q"[..], b"Q", b"\x1b", b"\x03", b"xq"] {
            assert_eq!(Wish::of(typed), Some(Wish::End), "{typed:?}");
        }
        for typed in [&b" "[..], b" q", b"c "] {
            assert_eq!(Wish::of(typed), Some(Wish::Stop), "{typed:?}");
        }
        assert_eq!(Wish::of(b"c"), Some(Wish::Clear));
        for typed in [&b"x"[..], b"\r", b"\x1b[A", b"\x1b[15~", b"\x1bOq"] {
            assert_eq!(Wish::of(typed), None, "{typed:?}");
        }
    }

    #[test]
    fn a_terminal_that_vanishes_ends_the_view() {
        let (reader, mut writer) = io::pipe().unwrap();
        let keys = Keys(reader.into());
        assert_eq!(keys.wish(Duration::ZERO).unwrap(), None, "nothing is typed");
        writer.write_all(b"x").unwrap();
        assert_eq!(keys.wish(Duration::ZERO).unwrap(), None);
        writer.write_all(b"q").unwrap();
        assert_eq!(keys.wish(Duration::ZERO).unwrap(), Some(Wish::End));
        drop(writer);
        assert!(keys.wish(Duration::ZERO).is_err());
    }
}
