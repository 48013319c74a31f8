//! What `mmt doctor` finds at a slave: it connects, and sends no hello.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::Duration;

use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::connect::{ConnectError, in_order};
use mmt_shared::io::quic::Traffic;
use mmt_shared::io::socket;
use mmt_shared::io::transport::{CLOSE_FINISHED, Connection, Endpoint, Transport};
use mmt_shared::pairing::Pairing;
use tokio::time::timeout;

use super::finding::{Finding, Verdict};
use crate::failure::Failure;

/// How long a name may take to be looked up, and a slave to answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long the close may take to go out.
const CLOSING: Duration = Duration::from_secs(1);
/// It sends no datagram.
const TRAFFIC: Traffic = Traffic {
    datagram_max: 400,
    rate_cap: RateCap {
        bytes_per_s: 100_000,
    },
};
/// Beyond it the hand runs far ahead of the object.
const ROUND_TRIP_FAR: Duration = Duration::from_millis(500);

/// All findings.
///
/// # Errors
/// No runtime.
pub(super) fn findings(slave: &Pairing) -> Result<Vec<Finding>, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::failed(format!("no runtime: {error}")))?;
    Ok(runtime.block_on(look(slave)))
}

async fn look(slave: &Pairing) -> Vec<Finding> {
    let name = slave.address.to_string();
    let found = timeout(PATIENCE, tokio::net::lookup_host(name.clone())).await;
    let addresses: Vec<SocketAddr> = match found {
        Ok(Ok(found)) => in_order(found),
        Ok(Err(error)) => return vec![unfit(format!("{name}: {error}"), "check its name")],
        Err(_) => {
            return vec![unfit(
                format!("{name}: no answer to its name"),
                "check the name server",
            )];
        }
    };
    let mut failures = Vec::new();
    for address in addresses {
        match try_at(address, slave).await {
            Ok(found) => return found,
            Err(error) => failures.push(unfit(error, "see docs/commands.md, `mmt slave`")),
        }
    }
    failures
}

fn unfit(found: impl std::fmt::Display, remedy: &str) -> Finding {
    Finding::of("slave", Verdict::Unfit, found, remedy)
}

async fn try_at(address: SocketAddr, slave: &Pairing) -> Result<Vec<Finding>, String> {
    let any: IpAddr = if address.is_ipv4() {
        Ipv4Addr::UNSPECIFIED.into()
    } else {
        Ipv6Addr::UNSPECIFIED.into()
    };
    let bound = socket::bind((any, 0).into()).map_err(|error| error.to_string())?;
    let own = socket::for_quic(bound).map_err(|error| error.to_string())?;
    let endpoint = Endpoint::of_master(Transport::Quic, own).map_err(|error| error.to_string())?;
    let connecting = endpoint.connect(address, slave.pin, TRAFFIC, PATIENCE);
    let connected = connecting.await;
    let findings = match &connected {
        Ok(connection) => answered(address, connection),
        Err(error @ ConnectError::NoAnswer { .. }) => return Err(error.to_string()),
        Err(error) => vec![unfit(
            error,
            "take the pairing string that the slave prints",
        )],
    };
    if let Ok(connection) = connected {
        connection.close(CLOSE_FINISHED, b"a look at the path, no session");
        let _ = timeout(CLOSING, endpoint.wait_idle()).await;
    }
    Ok(findings)
}

fn answered(address: SocketAddr, connection: &Connection) -> Vec<Finding> {
    let round_trip = connection.round_trip();
    let found = format!("round trip {:.1} ms", round_trip.as_secs_f64() * 1e3);
    vec![
        Finding::fit(
            "slave",
            format_args!("answers at {address}, with the pinned key"),
        ),
        if round_trip > ROUND_TRIP_FAR {
            let remedy = "read docs/limits.md: what such a delay does that no model makes good";
            Finding::of("path", Verdict::Advised, found, remedy)
        } else {
            Finding::fit("path", found)
        },
        // the handshake's first packets are as long, and are not split
        Finding::fit("MTU", "packets of 1200 bytes pass"),
    ]
}
