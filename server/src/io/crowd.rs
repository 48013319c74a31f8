//! Who is being judged: no more at once than there are places, and no address at the cost of others.
//!
//! Whoever comes gets a place. If none is free, one who has not shown the token leaves: of the networks with the most places
//! the one that came first. So a crowd keeps out itself, and the holder of the token has as long as its newest ones.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use mmt_shared::network::Network;
use tokio::sync::Notify;

/// Places. A master takes one when its address has proven itself, and has shown its token a round trip later: with this many
/// places, a crowd of 50 a second leaves it 2.5 s.
const PLACES: usize = 128;

/// Those who are being judged. Clones are the same.
#[derive(Clone, Debug, Default)]
pub(super) struct Crowd(Arc<Mutex<Places>>);

#[derive(Debug, Default)]
struct Places {
    came: u64,
    /// By the order in which they came.
    taken: BTreeMap<u64, (Network, Arc<Notify>)>,
}

/// A place among them; dropping it frees it.
#[derive(Debug)]
pub(super) struct Place {
    crowd: Crowd,
    number: u64,
    leave: Arc<Notify>,
}

impl Crowd {
    /// A place for whoever comes from `address`; if all are taken, another one is asked to leave.
    pub(super) fn enter(&self, address: &SocketAddr) -> Place {
        let mut places = self.lock();
        if places.taken.len() >= PLACES {
            let leaves = places.leaves();
            if let Some((_, leave)) = leaves.and_then(|number| places.taken.remove(&number)) {
                leave.notify_one();
            }
        }
        let (number, leave) = (places.came, Arc::new(Notify::new()));
        places.came += 1;
        let place = (Network::of(address.ip()), Arc::clone(&leave));
        places.taken.insert(number, place);
        Place {
            crowd: self.clone(),
            number,
            leave,
        }
    }

    /// Whether half of the places are taken: time to be stricter.
    pub(super) fn is_dense(&self) -> bool {
        self.lock().taken.len() >= PLACES / 2
    }

    fn lock(&self) -> MutexGuard<'_, Places> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Places {
    /// Who leaves: of the networks with the most places the one that came first.
    fn leaves(&self) -> Option<u64> {
        let mut of_network: BTreeMap<Network, usize> = BTreeMap::new();
        for (network, _) in self.taken.values() {
            *of_network.entry(*network).or_default() += 1;
        }
        let most = of_network.values().max()?;
        let mut taken = self.taken.iter();
        let first = taken.find(|(_, (network, _))| of_network.get(network) == Some(most));
        first.map(|(number, _)| *number)
    }
}

impl Place {
    /// Waits until its holder is asked to leave. Cancel-safe.
    pub(super) async fn lost(&self) {
        self.leave.notified().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.crowd.lock().taken.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;
    use std::pin::pin;
    use std::task::{Context, Poll, Waker};

    use super::*;

    fn lost(place: &Place) -> bool {
        let poll = pin!(place.lost()).poll(&mut Context::from_waker(Waker::noop()));
        poll == Poll::Ready(())
    }

    fn from(last: u8) -> SocketAddr {
        (Ipv4Addr::new(192, 0, 2, last), 1).into()
    }

    #[test]
    fn of_the_network_with_the_most_places_the_first_one_leaves() {
        let crowd = Crowd::default();
        let owner = crowd.enter(&from(1));
        let others: Vec<Place> = (1..PLACES).map(|_| crowd.enter(&from(2))).collect();
        let _one_more = crowd.enter(&from(3));
        assert!(!lost(&owner));
        let left: Vec<bool> = others.iter().map(lost).collect();
        assert_eq!(left.iter().position(|left| *left), Some(0));
        assert_eq!(left.iter().filter(|left| **left).count(), 1);
    }

    #[test]
    fn where_each_has_one_the_first_one_leaves_and_a_place_that_was_freed_is_free() {
        let crowd = Crowd::default();
        let places: Vec<Place> = (0..PLACES as u8).map(|n| crowd.enter(&from(n))).collect();
        assert!(crowd.is_dense());
        let more = crowd.enter(&from(200));
        assert!(lost(places.first().unwrap()) && !lost(places.get(1).unwrap()));
        drop(more);
        let _again = crowd.enter(&from(201));
        assert!(!lost(places.get(1).unwrap()));
        drop(places);
        assert!(!crowd.is_dense());
    }
}
