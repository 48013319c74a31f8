//! Why a master host had no session, or lost its own part of one.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use mmt_netem::io::socket::WrapError;
use mmt_shared::io::connect::ConnectError;
use mmt_shared::io::loop_thread::LoopHandle;
use mmt_shared::io::quic::EndpointError;
use mmt_shared::io::socket::BindError;
use mmt_shared::io::stream::{ReadFrameError, WriteFrameError};
use mmt_shared::io::transport::Insecure;
use mmt_shared::range::OutOfRange;
use mmt_shared::wire::{DecodeError, Kind, WelcomeError};

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum MasterHostError {
    /// A number of the scripted operator or of the device's limits is wrong.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The name could not be looked up.
    #[error(
        "{address} of the pairing string cannot be looked up: {source}; write the host's number instead"
    )]
    Lookup {
        /// The address of the pairing string.
        address: String,
        /// The system's error.
        source: io::Error,
    },
    /// The name has no address.
    #[error("{address} of the pairing string has no address: write the host's number instead")]
    NoAddress {
        /// The address of the pairing string.
        address: String,
    },
    /// The name was not looked up in time.
    #[error(
        "{address} of the pairing string was not looked up within {limit:?}: write the host's number instead"
    )]
    LookupSlow {
        /// The address of the pairing string.
        address: String,
        /// How long it was waited for.
        limit: Duration,
    },
    /// Raw UDP to another host, and nobody insists.
    #[error(transparent)]
    Insecure(#[from] Insecure),
    /// No socket.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The socket cannot be used.
    #[error("the UDP socket cannot be used: {0}")]
    Socket(io::Error),
    /// The emulated network cannot be made.
    #[error(transparent)]
    Netem(#[from] WrapError),
    /// No endpoint.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    /// No connection.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The slave did not take the hello.
    #[error("the hello did not reach the slave at {address}: {source}")]
    HelloUnsent {
        /// The slave.
        address: SocketAddr,
        /// What went wrong.
        source: WriteFrameError,
    },
    /// The slave did not answer the hello.
    #[error("the slave at {address} did not answer the hello: {source}; see its log")]
    NoWelcome {
        /// The slave.
        address: SocketAddr,
        /// What went wrong.
        source: ReadFrameError,
    },
    /// The answer cannot be read.
    #[error("the answer of the slave at {address} cannot be used: {source}")]
    Unreadable {
        /// The slave.
        address: SocketAddr,
        /// What is wrong.
        source: DecodeError,
    },
    /// The answer is something else.
    #[error(
        "the slave at {address} answered the hello with a {}: run the same version of mmt on both hosts",
        kind.name()
    )]
    Unexpected {
        /// The slave.
        address: SocketAddr,
        /// What came.
        kind: Kind,
    },
    /// The welcome has numbers that this master must not render.
    #[error(
        "the welcome of the slave at {address} is not accepted: {source}; run the same version of mmt on both hosts"
    )]
    Welcome {
        /// The slave.
        address: SocketAddr,
        /// Which number.
        source: WelcomeError,
    },
    /// Another master is there.
    #[error(
        "the slave at {address} is busy: another master operates it; end that one, try again later, or give --take-over"
    )]
    Busy {
        /// The slave.
        address: SocketAddr,
    },
    /// The token is wrong.
    #[error(
        "the slave at {address} does not know the token of this pairing string: copy the line that \
         `mmt slave` or `mmt identity rotate` printed last; it may have been replaced or revoked since"
    )]
    WrongToken {
        /// The slave.
        address: SocketAddr,
    },
    /// As many observers as it admits are there.
    #[error(
        "as many observers as the slave at {address} admits are looking on: try again later, or start it with a greater --observers"
    )]
    Full {
        /// The slave.
        address: SocketAddr,
    },
    /// It admits no observers.
    #[error("the slave at {address} admits no observers: start it with --observers N")]
    NoObservers {
        /// The slave.
        address: SocketAddr,
    },
    /// The token is an observer's.
    #[error(
        "the slave at {address} lets the token of this pairing string look on and not operate: add --observe, or ask \
         its owner for an operator's (`mmt identity rotate --name NAME --role operator`)"
    )]
    WrongRole {
        /// The slave.
        address: SocketAddr,
    },
    /// A number of the hello is out of range.
    #[error(
        "the slave at {address} refused the hello: one of its numbers is out of range (start at \
         {x} m, {y} m; {samples} samples in a command; stiffness {stiffness_n_per_m} N/m); see its log"
    )]
    BadHello {
        /// The slave.
        address: SocketAddr,
        /// x of the operator's start, m.
        x: f64,
        /// y of the operator's start, m.
        y: f64,
        /// Samples in a command.
        samples: u8,
        /// k_p, N/m.
        stiffness_n_per_m: f64,
    },
    /// The slave ends.
    #[error("the slave at {address} is ending: start it again")]
    Ending {
        /// The slave.
        address: SocketAddr,
    },
    /// Asked to end before the session began.
    #[error("ended before the session with the slave began")]
    Interrupted,
    /// The system gave no descriptor or no thread.
    #[error("no thread for the haptic loop: {0}")]
    Thread(io::Error),
    /// A defect of this program.
    #[error(
        "the haptic loop panicked, the force is off and the session has ended: this is a defect of \
         mmt; please report it with what stands above"
    )]
    Panicked,
    /// A tick of the haptic loop did not end; a device has had no force since 50 ms after the last one.
    #[error(
        "the haptic loop has hung, the force is off and the session has ended: this is a defect of mmt; please report it \
         with what stands above"
    )]
    Hung,
}

impl MasterHostError {
    /// Why a loop left nothing that it ended with.
    pub(super) fn of_loop<S: Send, T>(of: &LoopHandle<S, T>) -> Self {
        if of.has_hung() {
            Self::Hung
        } else {
            Self::Panicked
        }
    }
}
