//! A device at the haptic loop: a thread between the two, of the link's UDP port or of a protocol of the device's own.
//!
//! The loop gives what its newest tick came to into a few atomic numbers and takes the hand's events from a bounded ring; it never
//! waits for this thread. A device at the link sets its own pace: each reading that is taken is answered at once. The others are
//! asked a thousand times a second. Whatever ends, the last that a device gets is no force.

mod inverse3;
mod link;
pub mod ports;
mod serial;
mod shared;
#[cfg(test)]
mod tests;
mod two_diy;

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;

use mmt_shared::io::plug_socket::{PlugSocket, PlugSocketError};
use mmt_shared::plug::PlugCounts;
use rtrb::{Consumer, RingBuffer};

use crate::device::inverse3::Inverse3;
use crate::device::link::{DeviceLink, DeviceLinkConfig, DeviceLinkError, HandOutput};
use crate::device::two_diy::TwoDiy;
use crate::io::hand_events::{HandEvents, hand_events};
use crate::operator::pointer::HandEvent;
pub use inverse3::version;
pub use shared::Seen;
use shared::Shared;

/// Events that may wait for the loop: a second at 1 kHz, in which it stands.
const EVENTS_MAX: usize = 1024;

/// Where a device is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceAddress {
    /// It comes to this UDP port.
    Link(SocketAddr),
    /// The Inverse Service listens there.
    Inverse3(SocketAddr),
    /// A 2DIY is at this serial port.
    TwoDiy(PathBuf),
}

/// A device cannot be plugged in.
#[derive(Debug, thiserror::Error)]
pub enum DeviceHostError {
    /// It cannot listen.
    #[error("the device: {0}")]
    Socket(#[from] PlugSocketError),
    /// Its numbers.
    #[error(transparent)]
    Config(#[from] DeviceLinkError),
    /// Nobody answers where the service should be.
    #[error("the device: no Inverse Service answers at {address}: {why}")]
    Service {
        /// Where.
        address: SocketAddr,
        /// Why.
        why: String,
    },
    /// The serial port cannot be had.
    #[error("the device: the serial port {} cannot be used: {source}", port.display())]
    Port {
        /// Its path.
        port: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// No thread.
    #[error("no thread for the device: {0}")]
    Thread(#[source] io::Error),
}

/// A plug for a device; it ends with the process, and when it is dropped no force is left on the device.
#[derive(Debug)]
pub struct DeviceHost {
    address: String,
    shared: Arc<Shared>,
    /// The thread that has a last word for its device.
    speaks: Option<JoinHandle<()>>,
}

impl DeviceHost {
    /// Opens the way to a device.
    ///
    /// # Errors
    /// See [`DeviceHostError`].
    pub fn start(at: &DeviceAddress, config: DeviceLinkConfig) -> Result<Self, DeviceHostError> {
        let shared = Arc::new(Shared::default());
        let served = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("mmt-device".to_owned());
        let (address, thread) = match at.clone() {
            DeviceAddress::Link(listen) => {
                let socket = PlugSocket::bind(listen)?;
                let mut device = DeviceLink::try_new(config, *socket.token())?;
                let address = socket.address();
                let thread = thread.spawn(move || link::serve(&socket, &mut device, &served));
                (address, thread)
            }
            DeviceAddress::Inverse3(at) => {
                let mut device = Inverse3::try_new(config)?;
                let first = inverse3::connect(at);
                let first = first.map_err(|why| DeviceHostError::Service { address: at, why })?;
                let serve = move || inverse3::serve(at, first, &mut device, &served);
                (format!("ws://{at}"), thread.spawn(serve))
            }
            DeviceAddress::TwoDiy(path) => {
                let mut device = TwoDiy::try_new(config)?;
                let refused = |source| DeviceHostError::Port {
                    port: path.clone(),
                    source,
                };
                let first = serial::Serial::open(&path).map_err(refused)?;
                let address = path.display().to_string();
                let serve = move || two_diy::serve(&path, first, &mut device, &served);
                (address, thread.spawn(serve))
            }
        };
        let thread = thread.map_err(DeviceHostError::Thread)?;
        let speaks = !matches!(at, DeviceAddress::Link(_));
        Ok(Self {
            address,
            shared,
            speaks: speaks.then_some(thread),
        })
    }

    /// The address of the device, or for it: that of a link holds the token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The device for the loop of a session that begins; the one before gets nothing any more.
    pub fn port(&self) -> DevicePort {
        let (events, to_loop) = hand_events(EVENTS_MAX);
        self.shared.listeners().events = Some(events);
        DevicePort {
            events: to_loop,
            shared: Arc::clone(&self.shared),
            tick: 0,
        }
    }

    /// The device's readings as they come, for whoever looks at it; the one before gets nothing any more.
    pub fn readings(&self) -> Consumer<Seen> {
        let (readings, seen) = RingBuffer::new(EVENTS_MAX);
        self.shared.listeners().readings = Some(readings);
        seen
    }
}

impl Drop for DeviceHost {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Release);
        if let Some(thread) = self.speaks.take() {
            // a thread that panicked has reported it, and sends no more
            let _ = thread.join();
        }
    }
}

/// The loop's end of the plug. When it is dropped no force is left on the device.
#[derive(Debug)]
pub struct DevicePort {
    events: HandEvents,
    shared: Arc<Shared>,
    tick: u64,
}

impl DevicePort {
    /// What the hand did next.
    pub fn event(&mut self) -> Option<HandEvent> {
        self.events.next_event()
    }

    /// Gives the device what a tick came to; the number of the tick is counted here.
    pub fn give(&mut self, output: HandOutput) {
        self.tick += 1;
        self.shared.cell.store(&HandOutput {
            tick: self.tick,
            ..output
        });
    }

    /// What of the hand found no room on its way to the loop.
    pub fn events_lost(&self) -> u64 {
        self.events.lost()
    }

    /// What became of the device's packets, as the plug counted it last.
    pub fn counts(&self) -> PlugCounts {
        self.shared.listeners().counts
    }
}

impl Drop for DevicePort {
    fn drop(&mut self) {
        self.shared.cell.store(&HandOutput::default());
    }
}
