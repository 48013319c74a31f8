//! Log messages: to stderr, or into a short list while the screen belongs to the live view.
//!
//! A message is one line, [cleaned](clean) of whatever a peer wrote into it. Nobody waits for it to be read, and one cause
//! cannot fill the log.

use std::collections::{HashMap, VecDeque};
use std::io::{self, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use mmt_shared::clean::clean;
use tracing::Metadata;
use tracing::callsite::Identifier;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::MakeWriter;

use crate::failure::Failure;
use crate::output::note;

/// The environment variable that chooses what is logged.
pub(crate) const VARIABLE: &str = "MMT_LOG";
/// What is logged without it: our own messages and everybody's warnings. A right that a loop was granted is no news.
const DEFAULT: &str = "warn,mmt_cli=info,mmt_client=info,mmt_server=info,mmt_netem=info,\
     mmt_shared::io::identity_file=info";
/// Messages kept while the live view is shown; older ones are dropped.
const KEPT_MAX: usize = 100;
/// Messages of one cause, a line of the program, that are shown in a window of time: a stranger's thousand attempts are
/// ten lines a second and a number.
const SHOWN_MAX: u32 = 10;
/// That window.
const WINDOW: Duration = Duration::from_secs(1);

/// Where messages go. Copies share the place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    /// While the live view is shown.
    kept: Option<VecDeque<String>>,
    causes: HashMap<Identifier, Cause>,
}

/// What a cause has reported of late.
#[derive(Clone, Copy, Debug)]
struct Cause {
    /// When its window began.
    since: Instant,
    shown: u32,
    hidden: u64,
}

impl Cause {
    /// Whether one more may be shown at `now`, and how many were not before it.
    fn admit(&mut self, now: Instant) -> Option<u64> {
        if now.saturating_duration_since(self.since) >= WINDOW {
            (self.since, self.shown) = (now, 0);
        }
        if self.shown == SHOWN_MAX {
            self.hidden += 1;
            return None;
        }
        self.shown += 1;
        Some(std::mem::take(&mut self.hidden))
    }
}

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
        self.lock().kept.get_or_insert_default();
    }

    /// Writes what was kept, and from now on everything at once.
    pub(crate) fn release(&self) {
        let kept = self.lock().kept.take();
        kept.into_iter().flatten().for_each(note);
    }

    /// The newest messages that were kept, oldest first.
    pub(crate) fn newest(&self, count: usize) -> Vec<String> {
        let state = self.lock();
        let kept = state.kept.iter().flatten();
        let all: Vec<String> = kept.cloned().collect();
        all.into_iter().rev().take(count).rev().collect()
    }

    /// Takes what belongs to no line of the log: writes it, or keeps it.
    pub(crate) fn show(&self, text: &str) {
        self.take(None, text);
    }

    fn take(&self, cause: Option<Identifier>, text: &str) {
        let mut state = self.lock();
        let hidden = cause.map_or(Some(0), |cause| {
            let now = Instant::now();
            let new = Cause {
                since: now,
                shown: 0,
                hidden: 0,
            };
            state.causes.entry(cause).or_insert(new).admit(now)
        });
        let message = match hidden {
            None => return,
            Some(0) => clean(text),
            Some(hidden) => format!("{} ({hidden} more like this were not shown)", clean(text)),
        };
        if let Some(kept) = state.kept.as_mut() {
            if kept.len() == KEPT_MAX {
                kept.pop_front();
            }
            kept.push_back(message);
            return;
        }
        drop(state);
        note(message);
    }

    /// What a panicking thread left behind is whole messages, good to go on with.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn filter(words: &str) -> Result<EnvFilter, Failure> {
    let refused = |why: String| {
        let what = format!("the environment variable {VARIABLE} is {words:?}: {why}");
        Failure::usage(what).remedy("set it to error, warn, info, debug or trace, or unset it")
    };
    if let Some(word) = words
        .split(',')
        .map(str::trim)
        .find(|word| is_unknown(word))
    {
        return Err(refused(format!(
            "{word:?} is neither a level nor a crate of mmt"
        )));
    }
    EnvFilter::try_new(words).map_err(|error| refused(error.to_string()))
}

/// Whether a word that stands alone is a level that is mistyped: the filter takes it for a crate that is silent.
fn is_unknown(word: &str) -> bool {
    let stands_alone = !word.is_empty() && !word.contains(['=', '[', ' ', '"']);
    stands_alone && !word.starts_with("mmt") && word.parse::<LevelFilter>().is_err()
}

/// One message while it is written.
#[derive(Debug)]
pub(crate) struct Message {
    to: Messages,
    cause: Option<Identifier>,
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
        self.to.take(self.cause.take(), text.trim_end());
    }
}

impl<'a> MakeWriter<'a> for Messages {
    type Writer = Message;

    fn make_writer(&'a self) -> Message {
        Message {
            to: self.clone(),
            cause: None,
            bytes: Vec::new(),
        }
    }

    fn make_writer_for(&'a self, of: &Metadata<'_>) -> Message {
        let mut message = self.make_writer();
        message.cause = Some(of.callsite());
        message
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
    fn a_message_is_one_line_that_steers_no_terminal() {
        let messages = Messages::default();
        messages.keep();
        let mut message = messages.make_writer();
        writeln!(
            message,
            "closed by peer: \x1b[2Jbye\r\n INFO 10.0.0.7 operates"
        )
        .unwrap();
        drop(message);
        assert_eq!(
            messages.newest(9),
            ["closed by peer: ?[2Jbye?? INFO 10.0.0.7 operates"]
        );
    }

    #[test]
    fn one_cause_is_shown_ten_times_a_second_and_what_was_not_shown_is_counted() {
        let start = Instant::now();
        let mut cause = Cause {
            since: start,
            shown: 0,
            hidden: 0,
        };
        let just_before = start + WINDOW - Duration::from_nanos(1);
        let shown = (0..1000).filter(|_| cause.admit(just_before).is_some());
        assert_eq!(shown.count(), 10);
        assert_eq!(cause.admit(start + WINDOW), Some(990));
        assert_eq!(cause.admit(start + WINDOW), Some(0));
    }

    #[test]
    fn by_default_changed_tokens_are_shown_and_rights_that_were_granted_are_not() {
        let subscriber = tracing_subscriber::fmt().with_env_filter(filter(DEFAULT).unwrap());
        let _guard = tracing::subscriber::set_default(subscriber.finish());
        assert!(tracing::enabled!(
            target: "mmt_shared::io::identity_file::token_list",
            tracing::Level::INFO
        ));
        assert!(!tracing::enabled!(
            target: "mmt_shared::io::loop_thread::spawn",
            tracing::Level::INFO
        ));
    }

    #[test]
    fn a_filter_that_is_none_is_refused_by_the_name_of_its_variable() {
        assert!(filter(DEFAULT).is_ok());
        for words in [
            "debug",
            "",
            "WARN",
            "warn,mmt_client=debug",
            "off, mmt_server",
        ] {
            assert!(filter(words).is_ok(), "{words}");
        }
        for words in ["mmt=loud", "debgu", "warn,verbose"] {
            let failure = filter(words).unwrap_err().to_string();
            assert!(
                failure.contains(VARIABLE) && failure.contains("what to do"),
                "{failure}"
            );
        }
    }
}
