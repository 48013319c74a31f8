//! The arguments that choose what carries a session.

use clap::{Args, ValueEnum};
use mmt_shared::io::transport::Transport;

use crate::failure::Failure;

/// Arguments of every command with a session.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct TransportArguments {
    /// What carries the session's datagrams, the same on both sides; udp is for measurement: they are neither encrypted nor proven
    #[arg(long, value_enum, default_value_t = TransportName::Quic)]
    transport: TransportName,
    /// Let --transport udp leave this host, where whoever sees a packet can operate the slave
    #[arg(long)]
    insecure: bool,
}

/// The transports by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TransportName {
    /// Encrypted, both sides proven
    Quic,
    /// Raw UDP beside the connection, on loopback only
    Udp,
}

impl TransportArguments {
    /// The transport.
    ///
    /// # Errors
    /// --insecure without what it is for.
    pub(crate) fn choose(self) -> Result<Transport, Failure> {
        match (self.transport, self.insecure) {
            (TransportName::Udp, insist) => Ok(Transport::RawUdp { insist }),
            (TransportName::Quic, false) => Ok(Transport::Quic),
            (TransportName::Quic, true) => {
                Err(Failure::usage("--insecure goes with --transport udp only")
                    .remedy("leave --insecure out: QUIC is secure as it is"))
            }
        }
    }

    /// What a person must know before this transport is used.
    pub(crate) fn warning(self) -> Option<&'static str> {
        match (self.transport, self.insecure) {
            (TransportName::Quic, _) => None,
            (TransportName::Udp, false) => Some(
                "warning: --transport udp: commands and updates have no encryption, no authentication and no congestion \
                 control: for measurement on this host only",
            ),
            (TransportName::Udp, true) => Some(
                "warning: --transport udp --insecure: commands and updates cross the network in the clear, whoever sees a \
                 packet can operate the slave, and nothing yields to other traffic: for measurement only",
            ),
        }
    }
}
