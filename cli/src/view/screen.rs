//! The terminal while the dashboard is on it. Whatever happens, it is given back as it was.

use std::io::{self, IsTerminal, Stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crossterm::cursor::Show;
use crossterm::execute;
use crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::backend::CrosstermBackend;
use ratatui::{Frame, Terminal};
use rustix::termios::{Winsize, tcgetwinsize};

use super::keys::{Keys, Wish, restore_keys};
use crate::log::Messages;

/// The smallest terminal on which the live view has all its numbers, columns and rows.
const LEAST: (u16, u16) = (60, 15);
/// Messages shown at the bottom.
pub(super) const MESSAGES_MAX: usize = 3;

/// Whether this process has changed the terminal.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Gives the terminal back if this process took it; may be called from anywhere, any number of times.
pub(crate) fn restore_terminal() {
    restore_keys();
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

    /// Whether there is one with room for the live view.
    pub(crate) fn has_room() -> bool {
        tcgetwinsize(io::stderr()).is_ok_and(fits)
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

fn fits(size: Winsize) -> bool {
    let (columns, rows) = LEAST;
    size.ws_col >= columns && size.ws_row >= rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_that_cuts_numbers_has_no_room() {
        let fits = |ws_col, ws_row| {
            fits(Winsize {
                ws_row,
                ws_col,
                ws_xpixel: 0,
                ws_ypixel: 0,
            })
        };
        assert!(fits(60, 15) && fits(80, 24));
        assert!(!fits(40, 24) && !fits(58, 14) && !fits(60, 14) && !fits(0, 0));
    }
}
