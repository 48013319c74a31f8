//! The UDP socket under an endpoint.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;

use quinn::{AsyncUdpSocket, Runtime, TokioRuntime};
use socket2::{Domain, Protocol, Socket, Type};

/// Room for datagrams that have arrived, bytes: about 300 small ones, a third of a second at 1 kHz.
const RECEIVE_BUFFER: usize = 256 * 1024;
/// Room for datagrams that the host has not sent yet, bytes: about 80 small ones. Small, because what waits
/// here is older than what waits in QUIC's buffer, and only there the newest wins.
const SEND_BUFFER: usize = 32 * 1024;

/// Why there is no socket.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// Another socket has the port.
    #[error(
        "{address} is in use by another program (or another slave): stop that, or choose another port"
    )]
    InUse {
        /// The address asked for.
        address: SocketAddr,
    },
    /// This host has no such address.
    #[error("{address} is no address of this host: use one of its own, or 0.0.0.0 or [::] for all")]
    NotMine {
        /// The address asked for.
        address: SocketAddr,
    },
    /// Something else.
    #[error("cannot open a UDP socket on {address}: {source}")]
    Other {
        /// The address asked for.
        address: SocketAddr,
        /// The system's reason.
        source: io::Error,
    },
}

/// A UDP socket on `address`; port 0 lets the system choose. An IPv6 wildcard takes IPv4 as well.
///
/// # Errors
/// The port is taken, the address is not this host's, or the system refuses for another reason.
pub fn bind(address: SocketAddr) -> Result<UdpSocket, BindError> {
    open(address).map_err(|source| match source.kind() {
        io::ErrorKind::AddrInUse => BindError::InUse { address },
        io::ErrorKind::AddrNotAvailable => BindError::NotMine { address },
        _ => BindError::Other { address, source },
    })
}

/// The socket as quinn takes it, or as a decorator (link emulation, a counter) wraps it. Call it inside of a
/// tokio runtime with I/O; the socket belongs to that runtime.
///
/// # Errors
/// The socket cannot be made non-blocking or registered.
pub fn for_quic(socket: UdpSocket) -> io::Result<Arc<dyn AsyncUdpSocket>> {
    TokioRuntime.wrap_udp_socket(socket)
}

fn open(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = Socket::new(
        Domain::for_address(address),
        Type::DGRAM,
        Some(Protocol::UDP),
    )?;
    if address.is_ipv6() {
        // Some hosts forbid it; then IPv6 alone is what there is.
        let _ = socket.set_only_v6(false);
    }
    // The system may give less: a matter of performance, not of function.
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER);
    let _ = socket.set_send_buffer_size(SEND_BUFFER);
    socket.set_nonblocking(true)?;
    socket.bind(&address.into())?;
    Ok(socket.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_in_use_is_named_with_the_remedy() {
        let first = bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let address = first.local_addr().unwrap();
        let error = bind(address).unwrap_err();
        assert!(matches!(error, BindError::InUse { .. }));
        let text = error.to_string();
        assert!(text.contains(&address.to_string()) && text.contains("another port"));
    }

    #[test]
    fn an_address_of_another_host_is_named() {
        // TEST-NET-1 (RFC 5737)
        let error = bind("192.0.2.1:0".parse().unwrap()).unwrap_err();
        assert!(matches!(error, BindError::NotMine { .. }), "{error}");
    }
}
