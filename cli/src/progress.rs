//! The bar on stderr that shows how far a long command is; nothing where stderr is no terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that starts again for each piece of work. Copies are the same bar.
#[derive(Clone, Debug)]
pub(crate) struct Bar(ProgressBar);

impl Bar {
    /// A bar that shows nothing yet.
    pub(crate) fn new() -> Self {
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{msg} [{wide_bar}] {pos}/{len} {eta}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self(bar)
    }

    /// Shows that `done` of `whole` pieces of `what` are done.
    pub(crate) fn show(&self, what: &str, done: usize, whole: usize) {
        if self.0.message() != what {
            self.0.set_message(what.to_owned());
            self.0.reset();
        }
        self.0.set_length(whole as u64);
        self.0.set_position(done as u64);
    }

    /// Takes it off the screen while `print` writes there.
    pub(crate) fn step_aside<R>(&self, print: impl FnOnce() -> R) -> R {
        self.0.suspend(print)
    }

    /// Takes it off the screen.
    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }
}
