//! The terminal while the dashboard is on it. Whatever happens, it is given back as it was.

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Stderr};
use std::os::fd::{AsFd, OwnedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crossterm::cursor::Show;
use crossterm::execute;
use crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::backend::CrosstermBackend;
use ratatui::{Frame, Terminal};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use crate::log::Messages;

/// Messages shown at the bottom.
pub(super) const MESSAGES_MAX: usize = 3;

/// Whether this process has changed the terminal.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Gives the terminal back if this process took it; may be called from anywhere, any number of times.
pub(crate) fn restore_terminal() {
    if TAKEN.swap(false, Ordering::AcqRel) {
        // there is nothing else to try
        let _ = disable_raw_mode();
        let _ = execute!(io::stderr(), LeaveAlternateScreen, Show);
    }
}

/// The terminal, taken. Dropping it gives it back.
pub(crate) struct Screen {
    terminal: Terminal<CrosstermBackend<Stderr>>,
    keys: Keys,
    messages: Messages,
}

impl Screen {
    /// Whether there is a terminal to take.
    pub(crate) fn is_there() -> bool {
        io::stderr().is_terminal()
    }

    /// Takes the terminal that stderr is; none if it is none, or cannot be drawn on.
    pub(crate) fn take(messages: &Messages) -> Option<Self> {
        if !Self::is_there() {
            return None;
        }
        messages.keep();
        match Self::enter(messages) {
            Ok(screen) => Some(screen),
            Err(error) => {
                restore_terminal();
                messages.release();
                tracing::warn!("no live view on this terminal: {error}");
                None
            }
        }
    }

    fn enter(messages: &Messages) -> io::Result<Self> {
        TAKEN.store(true, Ordering::Release);
        enable_raw_mode()?;
        execute!(io::stderr(), EnterAlternateScreen)?;
        Ok(Self {
            terminal: Terminal::new(CrosstermBackend::new(io::stderr()))?,
            keys: Keys::of_terminal()?,
            messages: messages.clone(),
        })
    }

    /// Draws what `render` makes of the frame and of the newest messages.
    ///
    /// # Errors
    /// The terminal cannot be written to.
    pub(crate) fn draw(
        &mut self,
        render: impl FnOnce(&mut Frame<'_>, &[String]),
    ) -> io::Result<()> {
        let messages = self.messages.newest(MESSAGES_MAX);
        let drawn = self.terminal.draw(|frame| render(frame, &messages));
        drawn.map(|_| ())
    }

    /// Waits for a key, no longer than `patience`; returns what it asks for.
    ///
    /// # Errors
    /// The terminal cannot be read from, or is gone.
    pub(crate) fn wish(&mut self, patience: Duration) -> io::Result<Option<Wish>> {
        self.keys.wish(patience)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore_terminal();
        self.messages.release();
    }
}

/// What is typed on the terminal. Read here and not by crossterm, whose reader spins for ever once the terminal is gone.
struct Keys(OwnedFd);

impl Keys {
    /// Those of stdin if it is a terminal, else those of the terminal that the process belongs to.
    fn of_terminal() -> io::Result<Self> {
        let stdin = io::stdin();
        Ok(Self(if stdin.is_terminal() {
            stdin.as_fd().try_clone_to_owned()?
        } else {
            File::open("/dev/tty")?.into()
        }))
    }

    fn wish(&self, patience: Duration) -> io::Result<Option<Wish>> {
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
