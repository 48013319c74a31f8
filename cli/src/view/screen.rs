//! The terminal while the dashboard is on it. Whatever happens, it is given back as it was.

use std::io::{self, IsTerminal, Stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crossterm::cursor::Show;
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::execute;
use crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;

use super::{Caption, History, dashboard};
use crate::log::Messages;

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
            messages: messages.clone(),
        })
    }

    /// Draws what is seen now.
    ///
    /// # Errors
    /// The terminal cannot be written to.
    pub(crate) fn draw(&mut self, caption: &Caption, history: &History) -> io::Result<()> {
        let messages = self.messages.newest(dashboard::MESSAGES_MAX);
        let draw = |frame: &mut ratatui::Frame<'_>| {
            dashboard::render(frame, caption, history, &messages);
        };
        self.terminal.draw(draw).map(|_| ())
    }

    /// Waits for a key, no longer than `patience`; whether it was one that ends the run.
    ///
    /// # Errors
    /// The terminal cannot be read from.
    pub(crate) fn wants_end(&mut self, patience: Duration) -> io::Result<bool> {
        if !event::poll(patience)? {
            return Ok(false);
        }
        match event::read()? {
            Event::Key(key) => Ok(ends(&key)),
            _ => Ok(false),
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore_terminal();
        self.messages.release();
    }
}

/// q, Esc or Ctrl-C: in raw mode the terminal makes no signal of the latter.
fn ends(key: &KeyEvent) -> bool {
    let control_c = key.modifiers.contains(KeyModifiers::CONTROL) && key.code == KeyCode::Char('c');
    let quit = matches!(key.code, KeyCode::Char('q' | 'Q') | KeyCode::Esc);
    key.kind == KeyEventKind::Press && (quit || control_c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn q_escape_and_control_c_end_and_other_keys_do_not() {
        let key = |code, modifiers| ends(&KeyEvent::new(code, modifiers));
        assert!(key(KeyCode::Char('q'), KeyModifiers::NONE));
        assert!(key(KeyCode::Esc, KeyModifiers::NONE));
        assert!(key(KeyCode::Char('c'), KeyModifiers::CONTROL));
        assert!(!key(KeyCode::Char('c'), KeyModifiers::NONE));
        assert!(!key(KeyCode::Enter, KeyModifiers::NONE));
    }
}
