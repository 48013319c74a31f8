//! The pairing string `mmt://HOST:PORT?pin=…&token=…`: where the slave is, which key it has, and the
//! secret that lets a master in.
//!
//! Pin and token are 32 bytes each, in 64 hexadecimal digits: a pin can be compared by eye with what
//! other tools print. The token must never appear in a debug print, a log or an error.

mod secret;
#[cfg(test)]
mod tests;
mod tokens;

use std::fmt;
use std::net::{Ipv4Addr, Ipv6Addr};
use std::str::FromStr;

pub use secret::{HexError, Pin, SECRET_BYTES, Token};
pub use tokens::{
    Created, NamedToken, TOKEN_LINE, TOKENS_MAX, TokenName, TokenNameError, Tokens, TokensError,
};

const SCHEME: &str = "mmt://";
const PORT_RULE: &str = "a number from 1 to 65535";

/// The host in an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Host {
    /// A name that must be looked up.
    Name(String),
    /// An IPv4 address.
    V4(Ipv4Addr),
    /// An IPv6 address; in brackets when written.
    V6(Ipv6Addr),
}

impl fmt::Display for Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::V4(address) => write!(f, "{address}"),
            Self::V6(address) => write!(f, "[{address}]"),
        }
    }
}

/// Where the slave listens: `HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Name or number of the host.
    pub host: Host,
    /// UDP port, not 0.
    pub port: u16,
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

/// What a master must know to reach a slave, to know that it is the right one, and to be let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pairing {
    /// Where the slave listens.
    pub address: Address,
    /// SHA-256 of the `SubjectPublicKeyInfo` (DER) in the slave's certificate.
    pub pin: Pin,
    /// The secret.
    pub token: Token,
}

impl fmt::Display for Pairing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (address, pin, token) = (&self.address, self.pin, self.token.reveal());
        write!(f, "{SCHEME}{address}?pin={pin}&token={token}")
    }
}

/// Why a text is not a host and a port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Nothing is separated by a colon.
    #[error("address {found:?} has no port: write HOST:PORT, the port {PORT_RULE}")]
    NoPort {
        /// The address.
        found: String,
    },
    /// The port is not one.
    #[error("port {found:?} is not {PORT_RULE}")]
    BadPort {
        /// What stands behind the last colon.
        found: String,
    },
    /// The host is not one.
    #[error(
        "host {found:?} is neither a name nor an address: write a host name, an IPv4 address as \
         192.0.2.1 or an IPv6 address in brackets as [2001:db8::1]"
    )]
    BadHost {
        /// What stands before the last colon.
        found: String,
    },
}

/// Why a text is not a pairing string. No variant holds anything that could be a token.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PairingError {
    /// It does not begin with the scheme.
    #[error(
        "the pairing string does not begin with {SCHEME}: copy the whole line that `mmt slave` printed"
    )]
    NoScheme,
    /// The address is wrong.
    #[error("the pairing string's {0}")]
    Address(#[from] AddressError),
    /// Pin or token stand in the address. It is not shown: it may hold the token.
    #[error(
        "the pairing string's address has a & or a = in it: copy the whole line that `mmt slave` printed, once"
    )]
    NoAddress,
    /// A part of the query is missing.
    #[error(
        "the pairing string has no {key}: copy the whole line that `mmt slave` printed, and put it in \
         quotes, since a shell ends a command at a bare &"
    )]
    Missing {
        /// `pin` or `token`.
        key: &'static str,
    },
    /// A part of the query is there twice.
    #[error("the pairing string has more than one {key}: keep the one that `mmt slave` printed")]
    Twice {
        /// `pin` or `token`.
        key: &'static str,
    },
    /// A part of the query is neither pin nor token.
    #[error("part {part} after the ? is neither pin=… nor token=…: remove it")]
    Unknown {
        /// Which part, counted from 1.
        part: usize,
    },
    /// Pin or token has the wrong length.
    #[error(
        "the pairing string's {key} has {found} characters instead of 64: copy the whole line that \
         `mmt slave` printed"
    )]
    WrongLength {
        /// `pin` or `token`.
        key: &'static str,
        /// How many characters there are.
        found: usize,
    },
    /// Pin or token has a character that is no hexadecimal digit.
    #[error(
        "character {position} of the pairing string's {key} is not one of 0-9 and a-f: copy the line \
         that `mmt slave` printed again"
    )]
    NotHex {
        /// `pin` or `token`.
        key: &'static str,
        /// Which character, counted from 1.
        position: usize,
    },
}

impl PairingError {
    fn of(key: &'static str, error: HexError) -> Self {
        match error {
            HexError::WrongLength { found } => Self::WrongLength { key, found },
            HexError::NotHex { position } => Self::NotHex { key, position },
        }
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let found = || text.to_owned();
        let bracketed = text.ends_with(']');
        let parts = text.rsplit_once(':').filter(|_| !bracketed);
        let (host, port) = parts.ok_or_else(|| AddressError::NoPort { found: found() })?;
        let digits = !port.is_empty() && port.bytes().all(|b| b.is_ascii_digit());
        let number = port.parse().ok().filter(|&port: &u16| digits && port > 0);
        Ok(Self {
            host: parse_host(host).ok_or_else(|| AddressError::BadHost {
                found: host.to_owned(),
            })?,
            port: number.ok_or_else(|| AddressError::BadPort {
                found: port.to_owned(),
            })?,
        })
    }
}

fn parse_host(text: &str) -> Option<Host> {
    let inside = text.strip_prefix('[').and_then(|t| t.strip_suffix(']'));
    if let Some(inside) = inside {
        return inside.parse().ok().map(Host::V6);
    }
    if let Ok(address) = text.parse() {
        return Some(Host::V4(address));
    }
    let label_is_sound = |label: &str| {
        let letters = |b: u8| b.is_ascii_alphanumeric() || b == b'-' || b == b'_';
        let hyphens = label.starts_with('-') || label.ends_with('-');
        (1..=63).contains(&label.len()) && label.bytes().all(letters) && !hyphens
    };
    // A last label of digits would be an address with a slip of the pen, such as 192.0.2.256.
    let last = text.rsplit('.').next()?;
    let numeric = last.bytes().all(|b| b.is_ascii_digit());
    let sound = text.len() <= 253 && text.split('.').all(label_is_sound) && !numeric;
    sound.then(|| Host::Name(text.to_owned()))
}

impl FromStr for Pairing {
    type Err = PairingError;

    fn from_str(text: &str) -> Result<Self, PairingError> {
        let rest = text.trim().strip_prefix(SCHEME);
        let rest = rest.ok_or(PairingError::NoScheme)?;
        let (address, query) = rest.split_once('?').unwrap_or((rest, ""));
        let (mut pin, mut token) = (None, None);
        let parts = query.split('&').filter(|part| !part.is_empty());
        for (index, part) in parts.enumerate() {
            let twice = match part.split_once('=') {
                Some(("pin", digits)) => {
                    let read = digits.parse().map_err(|e| PairingError::of("pin", e))?;
                    pin.replace(read).is_some().then_some("pin")
                }
                Some(("token", digits)) => {
                    let read = digits.parse().map_err(|e| PairingError::of("token", e))?;
                    token.replace(read).is_some().then_some("token")
                }
                _ => return Err(PairingError::Unknown { part: index + 1 }),
            };
            if let Some(key) = twice {
                return Err(PairingError::Twice { key });
            }
        }
        // An address can hold what was meant as a secret only if the ? is missing: it is read last.
        let pin = pin.ok_or(PairingError::Missing { key: "pin" })?;
        let token = token.ok_or(PairingError::Missing { key: "token" })?;
        if address.contains(['&', '=']) {
            return Err(PairingError::NoAddress);
        }
        Ok(Self {
            address: address.parse()?,
            pin,
            token,
        })
    }
}
