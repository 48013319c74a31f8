//! Log messages: to stderr, or into a short list while the screen belongs to the live view.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

use crate::failure::Failure;
use crate::output::note;

/// The environment variable that chooses what is logged.
pub(crate) const VARIABLE: &str = "MMT_LOG";
/// What is logged without it: our own messages and everybody's warnings.
const DEFAULT: &str = "warn,mmt_cli=info,mmt_client=info,mmt_server=info,mmt_netem=info";
/// Messages kept while the live view is shown; older ones are dropped.
const KEPT_MAX: usize = 100;

/// Where messages go. Copies share the place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages(Arc<Mutex<Option<VecDeque<String>>>>);

impl Messages {
    /// Starts logging for this process.
    ///
    /// # Errors
    /// The variable holds no filter.
    pub(crate) fn install() -> Result<Self, Failure> {
        let words = std::env::var(VARIABLE).unwrap_or_else(|_| DEFAULT.to_owned());
        let filter = filter(&words)?;
        let messages = Self::default();
        let subscriber = tracing_subscriber::fmt()
            .compact()
            .with_target(false)
            .without_time()
            .with_ansi(false)
            .with_env_filter(filter)
            .with_writer(messages.clone());
        // Fails only if a subscriber is there already, which then does the same.
        let _ = subscriber.try_init();
        Ok(messages)
    }

    /// From now on messages are kept instead of written.
    pub(crate) fn keep(&self) {
        self.lock().get_or_insert_default();
    }

    /// Writes what was kept, and from now on everything at once.
    pub(crate) fn release(&self) {
        let kept = self.lock().take();
        kept.into_iter().flatten().for_each(note);
    }

    /// The newest messages that were kept, oldest first.
    pub(crate) fn newest(&self, count: usize) -> Vec<String> {
        let kept = self.lock();
        let kept = kept.iter().flatten();
        let all: Vec<String> = kept.cloned().collect();
        all.into_iter().rev().take(count).rev().collect()
    }

    fn take(&self, message: String) {
        if let Some(kept) = self.lock().as_mut() {
            if kept.len() == KEPT_MAX {
                kept.pop_front();
            }
            kept.push_back(message);
            return;
        }
        note(message);
    }

    /// What a panicking thread left behind is whole messages, good to go on with.
    fn lock(&self) -> MutexGuard<'_, Option<VecDeque<String>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn filter(words: &str) -> Result<EnvFilter, Failure> {
    EnvFilter::try_new(words).map_err(|error| {
        let what = format!("the environment variable {VARIABLE} is {words:?}: {error}");
        Failure::usage(what).remedy("set it to error, warn, info, debug or trace, or unset it")
    })
}

/// One message while it is written.
#[derive(Debug)]
pub(crate) struct Message {
    to: Messages,
    bytes: Vec<u8>,
}

impl Write for Message {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Message {
    fn drop(&mut self) {
        let text = String::from_utf8_lossy(&self.bytes);
        self.to.take(text.trim_end().to_owned());
    }
}

impl<'a> MakeWriter<'a> for Messages {
    type Writer = Message;

    fn make_writer(&'a self) -> Message {
        Message {
            to: self.clone(),
            bytes: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn while_kept_only_the_newest_messages_stay_in_their_order() {
        let messages = Messages::default();
        messages.keep();
        for number in 0..=KEPT_MAX {
            let mut message = messages.make_writer();
            writeln!(message, "number {number}").unwrap();
        }
        let kept = messages.newest(2);
        assert_eq!(
            kept,
            [
                format!("number {}", KEPT_MAX - 1),
                format!("number {KEPT_MAX}")
            ]
        );
        assert_eq!(messages.newest(1000).len(), KEPT_MAX);
        messages.release();
        assert!(messages.newest(1).is_empty());
    }

    #[test]
    fn a_filter_that_is_none_is_refused_by_the_name_of_its_variable() {
        assert!(filter(DEFAULT).is_ok());
        assert!(filter("debug").is_ok());
        let failure = filter("mmt=loud").unwrap_err().to_string();
        assert!(
            failure.contains(VARIABLE) && failure.contains("what to do"),
            "{failure}"
        );
    }
}
