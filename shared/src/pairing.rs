//! The pairing string `mmt://HOST:PORT?pin=…&token=…`: where the slave is, which key it has, and the
//! secret that lets a master in.
//!
//! Pin and token are 32 bytes each, in 64 hexadecimal digits: a pin can be compared by eye with what
//! other tools print. The token must never appear in a debug print, a log or an error.

mod secret;

use std::fmt;
use std::net::{Ipv4Addr, Ipv6Addr};
use std::str::FromStr;

pub use secret::{HexError, Pin, SECRET_BYTES, Token};

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
        // An address can hold what was meant as a secret only if the ? is missing: look at it last.
        let pin = pin.ok_or(PairingError::Missing { key: "pin" })?;
        let token = token.ok_or(PairingError::Missing { key: "token" })?;
        Ok(Self {
            address: address.parse()?,
            pin,
            token,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pairing(address: &str) -> Pairing {
        Pairing {
            address: address.parse().unwrap(),
            pin: Pin::new([0x0f; 32]),
            token: Token::new([0xa5; 32]),
        }
    }

    fn error(text: &str) -> PairingError {
        text.parse::<Pairing>().unwrap_err()
    }

    #[test]
    fn a_pairing_string_reads_back_as_it_was_written() {
        for address in [
            "robot.example.org:4433",
            "localhost:1",
            "192.0.2.1:65535",
            "[2001:db8::1]:4433",
            "[::]:4433",
            "under_score-1:7",
        ] {
            let text = pairing(address).to_string();
            assert!(
                text.starts_with(&format!("mmt://{address}?pin=0f0f")),
                "{text}"
            );
            assert_eq!(text.parse(), Ok(pairing(address)), "{text}");
            let upper = text.replace("0f", "0F").replace("a5", "A5");
            assert_eq!(upper.parse(), Ok(pairing(address)));
            assert_eq!(format!(" {text}\n").parse(), Ok(pairing(address)));
        }
    }

    #[test]
    fn the_order_of_pin_and_token_does_not_matter() {
        let (pin, token) = ("0f".repeat(32), "a5".repeat(32));
        let text = format!("mmt://h:1?token={token}&pin={pin}");
        assert_eq!(text.parse(), Ok(pairing("h:1")));
    }

    #[test]
    fn a_wrong_address_is_named() {
        let found = String::from("host");
        assert_eq!(
            "host".parse::<Address>(),
            Err(AddressError::NoPort { found })
        );
        let found = String::from("[::1]");
        assert_eq!(
            "[::1]".parse::<Address>(),
            Err(AddressError::NoPort { found })
        );
        for port in ["", "0", "65536", "+1", "x", "-1"] {
            let found = port.to_owned();
            let read = format!("host:{port}").parse::<Address>();
            assert_eq!(read, Err(AddressError::BadPort { found }));
        }
        for host in [
            "",
            "a b",
            "192.0.2.256",
            "1",
            "::1",
            "-a",
            "a..b",
            "[::1",
            "[h]",
            "é",
        ] {
            let found = host.to_owned();
            let read = format!("{host}:1").parse::<Address>();
            assert_eq!(read, Err(AddressError::BadHost { found }), "{host}");
        }
        assert!(format!("{}:1", "a".repeat(64)).parse::<Address>().is_err());
    }

    #[test]
    fn each_mistake_has_its_own_answer() {
        let (pin, token) = ("0f".repeat(32), "a5".repeat(32));
        assert_eq!(error("http://h:1"), PairingError::NoScheme);
        assert_eq!(error(""), PairingError::NoScheme);
        let key = "token";
        assert_eq!(
            error(&format!("mmt://h:1?pin={pin}")),
            PairingError::Missing { key }
        );
        let twice = format!("mmt://h:1?pin={pin}&token={token}&token={token}");
        assert_eq!(error(&twice), PairingError::Twice { key });
        let unknown = format!("mmt://h:1?pin={pin}&key={token}");
        assert_eq!(error(&unknown), PairingError::Unknown { part: 2 });
        let short = format!("mmt://h:1?pin={pin}&token={}", &token[1..]);
        assert_eq!(error(&short), PairingError::WrongLength { key, found: 63 });
        let bad = format!("mmt://h:1?pin={pin}&token={}g", &token[1..]);
        assert_eq!(error(&bad), PairingError::NotHex { key, position: 64 });
        let key = "pin";
        assert_eq!(error("mmt://h:1"), PairingError::Missing { key });
        let port = format!("mmt://h:x?pin={pin}&token={token}");
        assert!(matches!(error(&port), PairingError::Address(_)));
        assert!(error("mmt://h:1?pin=").to_string().contains("0 characters"));
    }

    #[test]
    fn neither_debug_nor_an_error_shows_the_token() {
        let text = pairing("h:1").to_string();
        let shown = format!("{:?}", pairing("h:1"));
        assert!(shown.contains("secret") && !shown.contains("165") && !shown.contains("a5a5"));
        for cut in 0..text.len() {
            for broken in [
                text[..cut].to_owned(),
                format!("{}!{}", &text[..cut], &text[cut..]),
                format!("{}{}", &text[..cut], &text[cut + 1..]),
            ] {
                if let Err(error) = broken.parse::<Pairing>() {
                    let shown = format!("{error} {error:?}");
                    assert!(!shown.contains("a5a5"), "{shown}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn any_pin_and_token_read_back(pin: [u8; 32], token: [u8; 32], port in 1..=u16::MAX) {
            let address = Address { host: Host::Name(String::from("host")), port };
            let (pin, token) = (Pin::new(pin), Token::new(token));
            let pairing = Pairing { address, pin, token };
            prop_assert_eq!(pairing.to_string().parse(), Ok(pairing));
        }

        #[test]
        fn no_text_panics(text in ".*", tail in "[mt:/?=&.0-9a-z]*") {
            let _ = text.parse::<Pairing>();
            let _ = format!("mmt://{tail}").parse::<Pairing>();
        }
    }
}
