//! The arguments of the operator's console in a browser. They hold options only.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};
use mmt_client::io::console::ConsoleOptions;

use super::values;
use crate::failure::Failure;

/// Arguments of every command with a hand.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct ConsoleArguments {
    /// Serve the console for a browser here (with =, without a space), and print its address [default of --console
    /// alone: 127.0.0.1:0]
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::listen, num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1:0")]
    console: Option<SocketAddr>,
    /// Serve no console
    #[arg(long, conflicts_with = "console")]
    no_console: bool,
    /// Let --console leave this host, where whoever sees a packet can operate the slave
    #[arg(long, requires = "console")]
    console_insecure: bool,
    /// Take the console's files from this directory, while working on them
    #[arg(long, value_name = "DIR")]
    assets: Option<PathBuf>,
}

impl ConsoleArguments {
    /// Where the console is to be; `wanted` serves one on loopback although nobody asked for it in words.
    ///
    /// # Errors
    /// An address that others can reach, without the word that allows it.
    pub(crate) fn options(&self, wanted: bool) -> Result<Option<ConsoleOptions>, Failure> {
        let unasked = (wanted && !self.no_console).then_some(([127, 0, 0, 1], 0).into());
        let Some(listen) = self.console.or(unasked) else {
            return Ok(None);
        };
        if !listen.ip().is_loopback() && !self.console_insecure {
            let what = format!(
                "--console {listen}: others could reach it, and nothing of it is encrypted"
            );
            return Err(Failure::usage(what).remedy(
                "leave the address out and forward the port (ssh -L, docs/console.md), or add --console-insecure",
            ));
        }
        Ok(Some(ConsoleOptions {
            listen,
            for_others: None,
            assets: self.assets.clone(),
        }))
    }
}

/// What clap refuses of `words`; where that is the address of a console behind a space, with how it is written.
pub(crate) fn hinted(mut error: clap::Error, words: &[String]) -> clap::Error {
    let mut pairs = words.iter().zip(words.iter().skip(1));
    let apart = pairs.find(|(option, at)| *option == "--console" && values::listen(at).is_ok());
    if let Some((option, at)) = apart {
        let tip = StyledStr::from(format!("write {option}={at}, without a space"));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
    error
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(console: &str, insecure: bool) -> ConsoleArguments {
        ConsoleArguments {
            console: Some(console.parse().unwrap()),
            console_insecure: insecure,
            ..ConsoleArguments::default()
        }
    }

    #[test]
    fn a_console_leaves_this_host_only_with_the_word_that_means_it() {
        assert!(asked("127.0.0.1:0", false).options(false).is_ok());
        let refused = asked("0.0.0.0:80", false).options(false).unwrap_err();
        assert!(refused.to_string().contains("ssh -L"), "{refused}");
        assert!(asked("0.0.0.0:80", true).options(false).is_ok());
    }

    #[test]
    fn nobody_gets_a_console_that_nobody_wants() {
        let none = ConsoleArguments::default();
        assert!(none.options(false).unwrap().is_none());
        assert!(
            none.options(true)
                .unwrap()
                .is_some_and(|of| of.listen.ip().is_loopback())
        );
        let no = ConsoleArguments {
            no_console: true,
            ..none
        };
        assert!(no.options(true).unwrap().is_none());
    }
}
