//! Pairing strings: what reads back, what is refused with which words, what is never shown.

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
    let twice = format!("mmt://h:1&token={token}?pin={pin}&token={token}");
    assert_eq!(error(&twice), PairingError::NoAddress);
    assert!(!error(&twice).to_string().contains("a5a5"));
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
