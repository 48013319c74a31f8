//! Commands to an emulated network at work, a line each. It parses and hands over; it changes no network.

use std::io::ErrorKind;

use mmt_netem::{Direction, LinkConfig};

use crate::args::network;
use crate::input::read_line;
use crate::output::note;

/// What a line asks for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// New settings for a direction.
    Link(Direction, Box<LinkConfig>),
    /// New ports toward the target.
    Rebind,
}

impl Command {
    /// The command in a line; none in an empty one.
    ///
    /// # Errors
    /// What is wrong with the line.
    pub(crate) fn parse(line: &str) -> Result<Option<Self>, String> {
        let line = line.trim();
        let (command, words) = line.split_once(' ').unwrap_or((line, ""));
        match command {
            "" => Ok(None),
            "up" => Ok(Some(Self::Link(
                Direction::Up,
                Box::new(of_running(words)?),
            ))),
            "down" => Ok(Some(Self::Link(
                Direction::Down,
                Box::new(of_running(words)?),
            ))),
            "rebind" if words.is_empty() => Ok(Some(Self::Rebind)),
            _ => Err(format!(
                "no command {line:?}: up WORDS, down WORDS or rebind"
            )),
        }
    }
}

/// New settings of a link at work.
fn of_running(words: &str) -> Result<LinkConfig, String> {
    network(words).and_then(without_seed)
}

/// New settings of a link at work, if they have no seed: it would change nothing.
pub(crate) fn without_seed(link: LinkConfig) -> Result<LinkConfig, String> {
    if link.links().any(|link| link.seed.is_some()) {
        return Err("a link at work keeps its draws: leave the seed out".to_owned());
    }
    Ok(link)
}

/// Hands the lines of stdin to `apply` on a thread of their own, until stdin ends or `apply` returns false.
pub(crate) fn from_stdin(mut apply: impl FnMut(&str) -> bool + Send + 'static) {
    std::thread::spawn(move || {
        let mut stdin = std::io::stdin().lock();
        loop {
            match read_line(&mut stdin) {
                Ok(Some(line)) if apply(&line) => {}
                Err(wrong) if wrong.kind() == ErrorKind::InvalidData => note(wrong),
                Ok(_) | Err(_) => break,
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_command_or_is_refused_with_what_is_wrong() {
        let parse = Command::parse;
        assert_eq!(parse("  "), Ok(None));
        let link = "delay 5ms loss 1%".parse().unwrap();
        let command = Command::Link(Direction::Down, Box::new(link));
        assert_eq!(parse("down delay 5ms loss 1%\n"), Ok(Some(command)));
        let none = Command::Link(Direction::Up, Box::default());
        assert_eq!(parse("up"), Ok(Some(none)));
        assert_eq!(parse("rebind"), Ok(Some(Command::Rebind)));
        assert!(parse("up delay 5").unwrap_err().contains("unit"));
        for seeded in ["up delay 5ms seed 7", "down none; then seed 7 delay 5ms"] {
            assert!(parse(seeded).unwrap_err().contains("seed"), "{seeded}");
        }
        assert!(parse("sideways").unwrap_err().contains("up WORDS"));
    }
}
