//! The *wrap* driver: a QUIC socket whose outgoing datagrams pass through an emulated link.
//!
//! [`EmulatedSocket`] decorates any socket of quinn's. Without emulation it passes straight through and
//! only counts. With it, each datagram goes on the link, and a thread of its own sends what comes through at
//! its time. Sending never blocks, never waits and never reports a full queue: what does not fit is dropped
//! and counted.

use std::fmt;
use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use quinn::udp::{RecvMeta, Transmit};
use quinn::{AsyncUdpSocket, UdpPoller};

use crate::config::LinkConfig;
use crate::direction::LinkId;
use crate::io::driver::Datagram;
use crate::io::record_file::RecordWriter;

mod control;
mod meter;
mod release;
mod segments;
#[cfg(test)]
mod tests;

pub use control::SocketControl;
pub use meter::{SocketCounters, SocketMeter};
pub use release::WrapError;
use release::{Address, Release};
use segments::segments;

/// What a wrapped socket can do besides. With any of it there is a thread even while there is nothing to
/// emulate.
#[derive(Clone, Debug, Default)]
pub struct SocketExtras {
    /// Where every datagram is recorded.
    pub record: Option<RecordWriter>,
    /// Who may give new settings.
    pub control: Option<SocketControl>,
}

impl SocketExtras {
    fn is_empty(&self) -> bool {
        self.record.is_none() && self.control.is_none()
    }
}

/// A socket for `quinn::Endpoint::new_with_abstract_socket` that emulates a link on what it sends.
///
/// When it is dropped its thread ends; datagrams still in flight are counted as abandoned.
pub struct EmulatedSocket {
    inner: Arc<dyn AsyncUdpSocket>,
    meter: SocketMeter,
    /// None: nothing to emulate.
    release: Option<Release>,
}

impl EmulatedSocket {
    /// Wraps `inner`. A transparent `config` without extras makes no thread and sends straight through.
    ///
    /// # Errors
    /// Settings out of range, or no thread to be had.
    pub fn try_new(
        inner: Arc<dyn AsyncUdpSocket>,
        config: LinkConfig,
        seed: u64,
        id: LinkId,
        extras: SocketExtras,
    ) -> Result<Self, WrapError> {
        let meter = SocketMeter::default();
        config.check()?;
        let release = if config.is_transparent() && extras.is_empty() {
            None
        } else {
            let release = Release::start(&inner, config, seed, id, &meter, extras.record)?;
            if let Some(control) = extras.control {
                control.attach(release.shared())?;
            }
            Some(release)
        };
        Ok(Self {
            inner,
            meter,
            release,
        })
    }

    /// The counters, for as long as anybody wants to read them.
    #[must_use]
    pub fn meter(&self) -> SocketMeter {
        self.meter.clone()
    }
}

impl AsyncUdpSocket for EmulatedSocket {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        match self.release {
            Some(_) => Box::pin(AlwaysWritable),
            None => self.inner.clone().create_io_poller(),
        }
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        let Some(release) = &self.release else {
            let sent = self.inner.try_send(transmit);
            self.meter.passed_through(transmit, &sent);
            return sent;
        };
        for contents in segments(transmit) {
            release.offer(Datagram {
                address: Address {
                    destination: transmit.destination,
                    src_ip: transmit.src_ip,
                },
                ecn: transmit.ecn,
                contents: contents.to_owned(),
            });
        }
        Ok(())
    }

    fn poll_recv(
        &self,
        cx: &mut Context<'_>,
        bufs: &mut [IoSliceMut<'_>],
        meta: &mut [RecvMeta],
    ) -> Poll<io::Result<usize>> {
        let polled = self.inner.poll_recv(cx, bufs, meta);
        if let Poll::Ready(Ok(messages)) = &polled {
            self.meter.received(meta.iter().take(*messages));
        }
        polled
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.inner.local_addr()
    }

    fn max_transmit_segments(&self) -> usize {
        match self.release {
            // each datagram has its own fate
            Some(_) => 1,
            None => self.inner.max_transmit_segments(),
        }
    }

    fn max_receive_segments(&self) -> usize {
        self.inner.max_receive_segments()
    }

    fn may_fragment(&self) -> bool {
        self.inner.may_fragment()
    }
}

impl fmt::Debug for EmulatedSocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EmulatedSocket")
            .field("inner", &self.inner)
            .field("emulates", &self.release.is_some())
            .finish_non_exhaustive()
    }
}

/// The emulated link takes or drops every datagram: there is never anything to wait for.
#[derive(Debug)]
struct AlwaysWritable;

impl UdpPoller for AlwaysWritable {
    fn poll_writable(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
