//! Which client gives its place to a newer one when all are taken.
//!
//! Whoever comes gets a place, so that strangers who take all of them keep nobody out: who has sent nothing for the longest,
//! or was never answered, makes room. Who talks with the target stays, whoever else comes.

use std::net::IpAddr;
use std::time::Duration;

use mmt_shared::network::Network;
use mmt_shared::time::Time;

/// Who has talked with the target may be silent for as long again before it makes room: so long at least and at most. The
/// least is a few round trips, the most QUIC's own idle timeout in this project.
const SILENCE_LEAST: Duration = Duration::from_millis(500);
const SILENCE_MOST: Duration = Duration::from_secs(15);
/// A network that has this part of the places makes room for its own newcomers itself.
const SHARE: usize = 4;

/// What a client has shown of itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    network: Network,
    /// When it sent something last, and when something came from it or for it last.
    sent: Time,
    seen: Time,
    /// When the target answered it first.
    answered: Option<Time>,
}

impl Standing {
    /// That of a client which came just now from this address.
    pub(super) fn new(address: IpAddr, now: Time) -> Self {
        Self {
            network: Network::of(address),
            sent: now,
            seen: now,
            answered: None,
        }
    }

    /// It has sent something.
    pub(super) fn sends(&mut self, now: Time) {
        (self.sent, self.seen) = (now, now);
    }

    /// Something came for it.
    pub(super) fn is_answered(&mut self, now: Time) {
        self.seen = now;
        self.answered.get_or_insert(now);
    }

    /// When something came from it or for it last.
    pub(super) fn seen(&self) -> Time {
        self.seen
    }

    /// Whether it talks with the target.
    fn talks(&self, now: Time) -> bool {
        self.answered.is_some_and(|answered| {
            let talked = self.seen.saturating_since(answered);
            now < self.sent + talked.clamp(SILENCE_LEAST, SILENCE_MOST)
        })
    }
}

/// Who makes room for a newcomer from `address` where all `places` are taken: of those that do not talk with the target the
/// one that came first; of the newcomer's own network, if that has its share of the places. None: all talk.
///
/// `clients` are in the order in which they came.
pub(super) fn makes_room<'a>(
    clients: impl Iterator<Item = (u64, &'a Standing)> + Clone,
    address: IpAddr,
    places: usize,
    now: Time,
) -> Option<u64> {
    let own = Network::of(address);
    let mut idle = clients.filter(|(_, client)| !client.talks(now));
    let of_own = idle.clone().filter(|(_, client)| client.network == own);
    let crowds = of_own.clone().count() >= (places / SHARE).max(1);
    let first = if crowds {
        of_own.clone().next()
    } else {
        idle.next()
    };
    first.map(|(number, _)| number)
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const PLACES: usize = 8;

    fn at(ms: u64) -> Time {
        Time::from_millis(ms)
    }

    fn address(last: u8) -> IpAddr {
        Ipv4Addr::new(192, 0, 2, last).into()
    }

    /// Strangers who came at these times, ms, each from an address of its own.
    fn strangers(came: std::ops::Range<u64>) -> Vec<Standing> {
        let stranger = |ms| Standing::new(address(ms as u8 + 1), at(ms));
        came.map(stranger).collect()
    }

    /// Who makes room for a newcomer from an address that ends so.
    fn leaves(clients: &[Standing], last: u8, ms: u64) -> Option<u64> {
        let clients = (0..).zip(clients);
        makes_room(clients, address(last), PLACES, at(ms))
    }

    /// A session of so many ms with an answer to each datagram, every 10 ms.
    fn session(came: u64, until: u64) -> Standing {
        let mut client = Standing::new(address(200), at(came));
        for ms in (came..=until).step_by(10) {
            client.sends(at(ms));
            client.is_answered(at(ms + 1));
        }
        client
    }

    #[test]
    fn the_first_that_was_never_answered_makes_room_and_who_talks_does_not() {
        let mut clients = vec![session(0, 1000)];
        clients.extend(strangers(1000..1007));
        assert_eq!(leaves(&clients, 100, 1010), Some(1));
        // whoever sends on and on without an answer is no better
        clients[1].sends(at(1009));
        assert_eq!(leaves(&clients, 100, 1010), Some(1));
        clients[1].is_answered(at(1009));
        assert_eq!(leaves(&clients, 100, 1010), Some(2));
        let talk = [session(0, 1000); PLACES];
        assert_eq!(leaves(&talk, 100, 1010), None);
    }

    #[test]
    fn a_session_may_be_silent_for_as_long_as_it_went_on_and_who_was_answered_once_for_a_moment() {
        let rests = |until, silence| leaves(&[session(0, until)], 100, until + silence).is_none();
        assert!(rests(3000, 2990) && !rests(3000, 3010));
        assert!(rests(100_000, 14_990) && !rests(100_000, 15_010));
        assert!(rests(0, 490) && !rests(0, 510));
        // what the target goes on to send keeps nobody who sends nothing
        let mut client = session(0, 0);
        (0..20_000).for_each(|ms| client.is_answered(at(ms)));
        assert_eq!(leaves(&[client], 100, 20_000), Some(0));
    }

    #[test]
    fn who_crowds_makes_room_for_its_own() {
        let mut clients = strangers(0..7);
        let crowd = |ms| Standing::new(address(100), at(ms));
        clients.push(crowd(8));
        assert_eq!(leaves(&clients, 100, 10), Some(0), "no crowd yet");
        clients[6] = crowd(7);
        assert_eq!(leaves(&clients, 100, 10), Some(6));
        assert_eq!(leaves(&clients, 101, 10), Some(0), "not one of them");
    }
}
