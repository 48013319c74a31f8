//! The hand's plug on a UDP port: a thread between a device and the haptic loop.
//!
//! The loop gives what its newest tick came to into a few atomic numbers and takes the hand's events from a bounded ring; it never
//! waits for this thread. Each reading that is taken is answered at once, so that the device sets the pace.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use mmt_shared::io::clock::Clock;
use mmt_shared::io::plug_socket::{PACKET_MAX, PlugSocket, PlugSocketError};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::PlugCounts;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::device::link::{DeviceLink, DeviceLinkConfig, DeviceLinkError, HandOutput};
use crate::operator::pointer::HandEvent;

/// Events that may wait for the loop: a second at 1 kHz, in which it stands.
const EVENTS_MAX: usize = 1024;

/// A device cannot be plugged in.
#[derive(Debug, thiserror::Error)]
pub enum DeviceHostError {
    /// It cannot listen.
    #[error("the device: {0}")]
    Socket(#[from] PlugSocketError),
    /// Its numbers.
    #[error(transparent)]
    Config(#[from] DeviceLinkError),
    /// No thread.
    #[error("no thread for the device's plug: {0}")]
    Thread(#[source] io::Error),
}

/// What the newest tick gave, for another thread.
#[derive(Debug, Default)]
struct Cell {
    /// The number of the tick, and the bits of its state below.
    tick: AtomicU64,
    force: AtomicU64,
    hip: AtomicU64,
}

/// Bits below the number of the tick.
const STATE_BITS: u32 = 8;

impl Cell {
    fn store(&self, output: &HandOutput) {
        let HandOutput {
            engaged,
            in_contact,
            stopped,
            link_late,
            ..
        } = *output;
        let state = [engaged, in_contact, stopped, link_late];
        let bits = state
            .iter()
            .rev()
            .fold(0, |bits, bit| bits << 1 | u64::from(*bit));
        self.force.store(packed(output.force), Ordering::Relaxed);
        self.hip.store(packed(output.hip), Ordering::Relaxed);
        // whoever sees this tick sees its force
        self.tick
            .store(output.tick << STATE_BITS | bits, Ordering::Release);
    }

    fn load(&self) -> HandOutput {
        let tick = self.tick.load(Ordering::Acquire);
        let bit = |number: u32| tick >> number & 1 == 1;
        HandOutput {
            tick: tick >> STATE_BITS,
            force: unpacked(self.force.load(Ordering::Relaxed)),
            hip: unpacked(self.hip.load(Ordering::Relaxed)),
            engaged: bit(0),
            in_contact: bit(1),
            stopped: bit(2),
            link_late: bit(3),
        }
    }
}

/// Two numbers as the device gets them, in one.
fn packed(v: Vec2) -> u64 {
    let [x, y] = [v.x, v.y].map(|n| u64::from((n as f32).to_bits()));
    x << 32 | y
}

fn unpacked(bits: u64) -> Vec2 {
    let [x, y] = [bits >> 32, bits & u64::from(u32::MAX)].map(|n| f32::from_bits(n as u32).into());
    Vec2::new(x, y)
}

/// What the thread and the process share.
#[derive(Debug, Default)]
struct Shared {
    cell: Cell,
    /// No tick ever takes it.
    loops: Mutex<(Option<Producer<HandEvent>>, PlugCounts)>,
}

impl Shared {
    fn loops(&self) -> MutexGuard<'_, (Option<Producer<HandEvent>>, PlugCounts)> {
        self.loops.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A plug for a device; it ends with the process.
#[derive(Debug)]
pub struct DeviceHost {
    address: String,
    shared: Arc<Shared>,
}

impl DeviceHost {
    /// Starts to listen.
    ///
    /// # Errors
    /// See [`DeviceHostError`].
    pub fn start(listen: SocketAddr, config: DeviceLinkConfig) -> Result<Self, DeviceHostError> {
        let socket = PlugSocket::bind(listen)?;
        let mut link = DeviceLink::try_new(config, *socket.token())?;
        let address = socket.address();
        let shared = Arc::new(Shared::default());
        let served = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("mmt-device".to_owned())
            .spawn(move || serve(&socket, &mut link, &served))
            .map_err(DeviceHostError::Thread)?;
        Ok(Self { address, shared })
    }

    /// The address for the device. It holds the token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The device for the loop of a session that begins; the one before gets nothing any more.
    pub fn port(&self) -> DevicePort {
        let (events, to_loop) = RingBuffer::new(EVENTS_MAX);
        self.shared.loops().0 = Some(events);
        DevicePort {
            events: to_loop,
            shared: Arc::clone(&self.shared),
            tick: 0,
        }
    }
}

/// The loop's end of the plug. When it is dropped no force is left on the device.
#[derive(Debug)]
pub struct DevicePort {
    events: Consumer<HandEvent>,
    shared: Arc<Shared>,
    tick: u64,
}

impl DevicePort {
    /// What the hand did next.
    pub(super) fn next(&mut self) -> Option<HandEvent> {
        self.events.pop().ok()
    }

    /// Gives the device what a tick came to; the number of the tick is counted here.
    pub(super) fn give(&mut self, output: HandOutput) {
        self.tick += 1;
        self.shared.cell.store(&HandOutput {
            tick: self.tick,
            ..output
        });
    }

    /// What became of the device's packets, as the plug counted it last.
    pub(super) fn counts(&self) -> PlugCounts {
        self.shared.loops().1
    }
}

impl Drop for DevicePort {
    fn drop(&mut self) {
        self.shared.cell.store(&HandOutput::default());
    }
}

fn serve(socket: &PlugSocket, link: &mut DeviceLink, shared: &Shared) {
    let clock = Clock::start();
    let mut packet = [0; PACKET_MAX];
    loop {
        let (packet, from) = socket.receive(&mut packet);
        let now = clock.now();
        let mut loops = shared.loops();
        let give = |event| {
            // a full ring is a loop that stands: what is lost ends as silence, which releases the hand
            if let Some(events) = &mut loops.0 {
                let _ = events.push(event);
            }
        };
        let due = link.handle(now, from, packet, give);
        loops.1 = *link.counts();
        drop(loops);
        if due {
            let answer = link.answer(now, &shared.cell.load());
            socket.send(&answer, from);
        }
    }
}
