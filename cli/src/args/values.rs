//! The values of arguments. An error names the place and what would be right.

use std::convert::Infallible;
use std::fmt;
use std::net::SocketAddr;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use mmt_netem::LinkConfig;
use mmt_netem::words::Reason;
use mmt_server::trigger::{Scheme, SchemeError};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::settings::Mode;
use mmt_shared::pairing::{Address, AddressError, Host, TOKENS_MAX};
use mmt_shared::wire::SAMPLES_MAX;

/// The longest duration accepted: a week.
const DURATION_MAX: Duration = Duration::from_secs(7 * 24 * 3600);
/// The shortest duration accepted: a tick.
const DURATION_MIN: Duration = Duration::from_millis(1);
/// The longest soak, hours.
const HOURS_MAX: f64 = 168.0;
/// The shortest: two cycles of sessions.
const HOURS_MIN: f64 = 0.002;
/// The units of a duration, in ms.
const UNITS: [(&str, f64); 5] = [
    ("ms", 1.0),
    ("min", 60e3),
    ("s", 1e3),
    ("m", 60e3),
    ("h", 3600e3),
];

/// Who moves the hand, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum OperatorWords {
    /// The scripted operator.
    Scripted,
    /// A person at the console's pointer.
    Pointer,
    /// A recorded path in a file.
    Trace(PathBuf),
}

/// A pairing string not looked at yet. It holds a secret: neither shown nor part of an error.
#[derive(Clone)]
pub(crate) struct PairingWords(String);

impl PairingWords {
    /// The words.
    pub(crate) fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for PairingWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PairingWords(secret)")
    }
}

impl FromStr for PairingWords {
    type Err = Infallible;

    fn from_str(words: &str) -> Result<Self, Infallible> {
        Ok(Self(words.to_owned()))
    }
}

/// T_update, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Period(pub(crate) Option<Duration>);

/// A time with its unit: `20s`, `1.5min`, `500ms`, `1h`.
pub(super) fn duration(text: &str) -> Result<Duration, String> {
    let wrong = || {
        format!(
            "write a time with its unit (ms, s, min, h), such as 20s, from {DURATION_MIN:?} to {} h",
            DURATION_MAX.as_secs() / 3600
        )
    };
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = text.strip_prefix(digits).unwrap_or_default();
    let factor = UNITS.iter().find(|(name, _)| *name == unit);
    let plain = digits.chars().all(|c| c.is_ascii_digit() || c == '.');
    let number = digits.parse::<f64>().ok().filter(|_| plain);
    let (number, (_, factor)) = number.zip(factor).ok_or_else(wrong)?;
    let time = Duration::try_from_secs_f64(number * factor * 1e-3).map_err(|_| wrong())?;
    if (DURATION_MIN..=DURATION_MAX).contains(&time) {
        Ok(time)
    } else {
        Err(wrong())
    }
}

/// Hours of a soak.
pub(super) fn hours(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok();
    number
        .filter(|hours| (HOURS_MIN..=HOURS_MAX).contains(hours))
        .ok_or_else(|| format!("write a number of hours from {HOURS_MIN} to {HOURS_MAX}"))
}

/// A link in netem's words; a caret line points at the wrong one.
pub(crate) fn netem(text: &str) -> Result<LinkConfig, String> {
    let mut read = |name: &str| {
        let bytes = crate::input::read_bytes(Path::new(name), "the network's file");
        let bytes = bytes.map_err(|failure| failure.what().to_owned())?;
        mmt_netem::record::as_text(bytes).map_err(|error| error.to_string())
    };
    mmt_netem::words::parse(text, &mut read).map_err(|error| {
        let pointer = error.pointer(text).replace('\n', "\n    ");
        let advice = match error.reason {
            Reason::File { .. } => {
                "check the path, and that the file is of the kind that this word takes"
            }
            _ => "write it as \"delay 50ms 5ms loss 1%\", or none",
        };
        format!("{error}\n\n    {pointer}\n\n{advice}")
    })
}

/// An update scheme in its words.
pub(super) fn scheme(text: &str) -> Result<Scheme, String> {
    text.parse().map_err(|error: SchemeError| error.to_string())
}

/// Delta of (12) in per cent.
pub(super) fn deadband(text: &str) -> Result<f64, String> {
    match format!("deadband {text}").parse() {
        Ok(Scheme::Deadband { delta }) => Ok(delta),
        _ => Err("write a share from 0.1% to 100%, such as 10%".to_owned()),
    }
}

/// T_update, or `none`.
pub(super) fn period(text: &str) -> Result<Period, String> {
    if text == "none" {
        return Ok(Period(None));
    }
    match format!("timer {text}").parse() {
        Ok(Scheme::Timer { t_update }) => Ok(Period(Some(t_update))),
        _ => Err("write a time from 1ms to 60s, such as 150ms, or none".to_owned()),
    }
}

/// An address to listen on.
pub(super) fn listen(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        "write address and port: 0.0.0.0:4433 for all of this host's IPv4 addresses, [::]:4433 for \
         IPv6, and IPv4 as well, 127.0.0.1:0 for this host alone and any free port"
            .to_owned()
    })
}

/// A host and a port to send to.
pub(super) fn address(text: &str) -> Result<Address, String> {
    text.parse()
        .map_err(|error: AddressError| error.to_string())
}

/// A host without a port.
pub(super) fn host(text: &str) -> Result<Host, String> {
    let wrong = |error: AddressError| match error {
        AddressError::BadHost { .. } => format!("{error}; the port is added by itself"),
        _ => error.to_string(),
    };
    // any port will do: only the host counts
    let address = format!("{text}:1").parse::<Address>().map_err(wrong)?;
    Ok(address.host)
}

/// Who moves the hand.
pub(super) fn operator(text: &str) -> Result<OperatorWords, String> {
    match (text, text.strip_prefix("trace:")) {
        ("scripted", _) => Ok(OperatorWords::Scripted),
        ("pointer", _) => Ok(OperatorWords::Pointer),
        (_, Some(file)) if !file.is_empty() => Ok(OperatorWords::Trace(file.into())),
        _ => Err(
            "write scripted, pointer, or trace:FILE with the path of a recorded tool path"
                .to_owned(),
        ),
    }
}

/// Whether a plant is plugged in.
pub(super) fn plant() -> impl TypedValueParser<Value = bool> {
    one_of(&[
        ("world", "The simulated world", false),
        ("link", "A plant of your own", true),
    ])
}

/// The bundle of choices.
pub(super) fn mode() -> impl TypedValueParser<Value = Mode> {
    one_of(&[
        ("paper", "The paper to the letter", Mode::Paper),
        ("recommended", "What works better", Mode::Recommended),
    ])
}

/// Whose force the hand feels.
pub(super) fn architecture() -> impl TypedValueParser<Value = Architecture> {
    one_of(&[
        ("mmt", "The local model's", Architecture::Mmt),
        (
            "tdpa",
            "The tool's, across the network, with time-domain passivity control",
            Architecture::Tdpa,
        ),
    ])
}

/// One of these words, each with its help and its value.
fn one_of<T: Clone + Send + Sync>(
    words: &'static [(&'static str, &'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let shown = words.iter();
    let shown = shown.map(|(word, help, _)| PossibleValue::new(*word).help(*help));
    PossibleValuesParser::new(shown).try_map(|given| {
        let known = words.iter().find(|(word, _, _)| *word == given);
        known
            .map(|(_, _, value)| value.clone())
            .ok_or("no such word")
    })
}

/// Any number; its range is checked where it is used.
pub(super) fn number(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    number.ok_or_else(|| "write a number, such as 1.5".to_owned())
}

/// A whole number from `least` to `most`.
pub(super) fn whole<T: TryFrom<u64>>(
    least: u64,
    most: u64,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text: &str| {
        let number = text.parse::<u64>().ok();
        let number = number.filter(|number| (least..=most).contains(number));
        let number = number.and_then(|number| T::try_from(number).ok());
        number.ok_or_else(|| format!("write a whole number from {least} to {most}"))
    }
}

/// A seed.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    whole(0, u64::MAX)(text)
}

/// Threads.
pub(super) fn jobs(text: &str) -> Result<NonZero<usize>, String> {
    let jobs = text.parse().ok();
    jobs.ok_or_else(|| "write a whole number of threads, 1 or more".to_owned())
}

/// 1 to [`SAMPLES_MAX`].
pub(super) fn samples_per_command(text: &str) -> Result<u8, String> {
    whole(1, SAMPLES_MAX as u64)(text)
}

/// 0 to as many commands of one sample as a command has room for.
pub(super) fn repeat_samples(text: &str) -> Result<u8, String> {
    whole(0, SAMPLES_MAX as u64 - 1)(text)
}

/// 0 to as many observers as a slave has tokens.
pub(super) fn observers(text: &str) -> Result<u8, String> {
    whole(0, TOKENS_MAX as u64)(text)
}
