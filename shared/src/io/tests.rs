//! For tests: a slave and a master, connected over loopback.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use quinn::{AsyncUdpSocket, Connection, Endpoint};
use tokio::time::timeout;

use super::congestion::RateCap;
use super::connect::connect;
use super::identity::Identity;
use super::quic::{Traffic, client_endpoint, server_endpoint};
use super::socket;
use super::transport::{AcceptError, Listener};

pub(super) const TRAFFIC: Traffic = Traffic {
    datagram_max: 100,
    rate_cap: RateCap {
        bytes_per_s: 250_000,
    },
};
/// Longer than any healthy test needs on any host.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);

pub(super) fn open() -> Arc<dyn AsyncUdpSocket> {
    socket::for_quic(socket::bind("127.0.0.1:0".parse().unwrap()).unwrap()).unwrap()
}

pub(super) struct Slave {
    pub(super) identity: Identity,
    pub(super) address: SocketAddr,
    pub(super) listener: Listener,
}

pub(super) fn slave() -> Slave {
    let identity = Identity::ephemeral().unwrap();
    let endpoint = server_endpoint(open(), &identity, TRAFFIC).unwrap();
    Slave {
        identity,
        address: endpoint.local_addr().unwrap(),
        listener: Listener::new(endpoint),
    }
}

impl Slave {
    pub(super) async fn accept(&self) -> Result<Connection, AcceptError> {
        let handshake = self.listener.next().await.unwrap();
        handshake.finish().await.map(|connection| connection.quic)
    }
}

pub(super) async fn pair() -> (Endpoint, Slave, Connection, Connection) {
    let (slave, endpoint) = (slave(), client_endpoint(open()).unwrap());
    let (up, down) = tokio::join!(
        connect(
            &endpoint,
            slave.address,
            slave.identity.pin(),
            TRAFFIC,
            PATIENCE
        ),
        slave.accept(),
    );
    (endpoint, slave, up.unwrap(), down.unwrap())
}

pub(super) async fn patiently<T>(future: impl Future<Output = T>) -> T {
    timeout(PATIENCE, future).await.unwrap()
}
