//! Who may look and operate: whoever has the token, from a page that this console itself served.
//!
//! A browser runs the scripts of every page that it shows, and each may try to reach this port. The Host must be a name
//! of this console (against names that somebody else resolves to it), the Origin of a socket must be this console's page,
//! and the token must be the one that was printed.

use std::fmt;
use std::hint::black_box;
use std::net::IpAddr;

use axum::http::header::{HOST, ORIGIN};
use axum::http::{HeaderMap, Uri};
use mmt_shared::io::secret::NoRandomness;
use mmt_shared::pairing::Token;

/// Why somebody is turned away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refusal {
    /// The Host is no name of this console.
    #[error(
        "this console is not called so: open the address as mmt printed it, through localhost, or by the host's IP address"
    )]
    Host,
    /// The page is another's.
    #[error("only the console's own page may connect")]
    Origin,
    /// No token, or a wrong one.
    #[error("the token is missing or wrong: open the whole address that mmt printed")]
    Token,
}

/// Length of a ticket, characters: 128 bits, short enough for an address on a narrow terminal.
const TICKET_LENGTH: usize = 32;

/// What the printed address carries: 32 hexadecimal digits. `Debug` hides it.
#[derive(Clone)]
pub(super) struct Ticket(String);

impl Ticket {
    /// A fresh one.
    pub(super) fn generate() -> Result<Self, NoRandomness> {
        let mut digits = Token::generate()?.reveal().to_string();
        digits.truncate(TICKET_LENGTH);
        Ok(Self(digits))
    }

    /// The digits.
    pub(super) fn reveal(&self) -> &str {
        &self.0
    }

    /// Whether this is the one, in a time that does not depend on where they differ.
    fn is(&self, given: &str) -> bool {
        let pairs = self.0.bytes().zip(given.bytes());
        let differences = pairs.fold(0, |found, (a, b)| black_box(found | (a ^ b)));
        given.len() == self.0.len() && differences == 0
    }
}

impl fmt::Debug for Ticket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Ticket(secret)")
    }
}

/// What is checked.
#[derive(Debug)]
pub(super) struct Admission {
    listen: IpAddr,
    ticket: Ticket,
}

impl Admission {
    /// For a console that listens there.
    pub(super) fn new(listen: IpAddr, ticket: Ticket) -> Self {
        Self { listen, ticket }
    }

    /// The files of the page: they hold no secret.
    pub(super) fn file(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = headers.get(HOST).and_then(|host| host.to_str().ok());
        let known = host.is_some_and(|host| self.knows(host));
        known.then_some(()).ok_or(Refusal::Host)
    }

    /// The page itself.
    pub(super) fn page(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), Refusal> {
        self.file(headers)?;
        let pairs = uri.query().unwrap_or_default().split('&');
        let given = pairs.filter_map(|pair| pair.strip_prefix("token=")).next();
        let right = given.is_some_and(|given| self.ticket.is(given));
        right.then_some(()).ok_or(Refusal::Token)
    }

    /// The page's socket.
    pub(super) fn socket(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), Refusal> {
        self.file(headers)?;
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let own = text(HOST).map(|host| format!("http://{host}"));
        if own.is_none() || text(ORIGIN).map(str::to_owned) != own {
            return Err(Refusal::Origin);
        }
        self.page(headers, uri)
    }

    /// Whether a Host is a name of this console, at any port: a forwarded port may be another.
    fn knows(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.chars().all(|c| c.is_ascii_digit()) => name,
            _ => host,
        };
        if name.eq_ignore_ascii_case("localhost") {
            return true;
        }
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        // an address is nobody's name: only names can be made to lead here
        bare.parse::<IpAddr>().is_ok_and(|address| {
            address.is_loopback() || address == self.listen || self.listen.is_unspecified()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn admission(listen: &str) -> (Admission, Uri) {
        let ticket = Ticket::generate().unwrap();
        let uri = format!("/ws?token={}", ticket.reveal()).parse().unwrap();
        (Admission::new(listen.parse().unwrap(), ticket), uri)
    }

    fn headers(host: &str, origin: Option<&str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, HeaderValue::from_str(host).unwrap());
        if let Some(origin) = origin {
            headers.insert(ORIGIN, HeaderValue::from_str(origin).unwrap());
        }
        headers
    }

    #[test]
    fn the_own_page_with_the_token_is_let_in_also_through_a_forwarded_port() {
        let (admission, uri) = admission("127.0.0.1");
        for host in ["127.0.0.1:4711", "localhost:9000", "LOCALHOST", "[::1]:80"] {
            let headers = headers(host, Some(&format!("http://{host}")));
            assert_eq!(admission.socket(&headers, &uri), Ok(()), "{host}");
        }
    }

    #[test]
    fn a_foreign_name_is_refused_though_it_leads_here() {
        let (admission, uri) = admission("127.0.0.1");
        for host in [
            "evil.example:4711",
            "evil.example",
            "127.0.0.1.evil.example",
            "10.0.0.1:1",
            "",
        ] {
            let headers = headers(host, Some(&format!("http://{host}")));
            assert_eq!(
                admission.socket(&headers, &uri),
                Err(Refusal::Host),
                "{host}"
            );
            assert_eq!(admission.file(&headers), Err(Refusal::Host));
        }
        assert_eq!(admission.file(&HeaderMap::new()), Err(Refusal::Host));
    }

    #[test]
    fn a_foreign_or_missing_origin_is_refused() {
        let (admission, uri) = admission("127.0.0.1");
        let host = "127.0.0.1:4711";
        let others = [
            "http://evil.example",
            "http://127.0.0.1:4712",
            "https://127.0.0.1:4711",
            "null",
        ];
        for origin in others.map(Some).into_iter().chain([None]) {
            let headers = headers(host, origin);
            assert_eq!(
                admission.socket(&headers, &uri),
                Err(Refusal::Origin),
                "{origin:?}"
            );
        }
    }

    #[test]
    fn a_wrong_or_missing_token_is_refused() {
        let (admission, uri) = admission("127.0.0.1");
        let (_, other) = self::admission("127.0.0.1");
        let headers = headers("127.0.0.1:4711", Some("http://127.0.0.1:4711"));
        let mut cut = uri.to_string();
        assert_eq!(
            cut.pop().map(|_| cut.len()),
            Some("/ws?token=".len() + TICKET_LENGTH - 1)
        );
        let cut = cut.parse().unwrap();
        for uri in [
            other,
            cut,
            "/ws".parse().unwrap(),
            "/ws?token=".parse().unwrap(),
        ] {
            assert_eq!(
                admission.socket(&headers, &uri),
                Err(Refusal::Token),
                "{uri}"
            );
            assert_eq!(admission.page(&headers, &uri), Err(Refusal::Token));
        }
        let with_more = format!("{uri}&x=1").parse().unwrap();
        assert_eq!(admission.page(&headers, &with_more), Ok(()));
    }

    #[test]
    fn a_console_on_all_addresses_is_reached_by_any_address_and_by_no_name() {
        let (admission, _) = admission("0.0.0.0");
        assert_eq!(admission.file(&headers("192.168.1.7:80", None)), Ok(()));
        assert_eq!(
            admission.file(&headers("robot.lan:80", None)),
            Err(Refusal::Host)
        );
    }
}
