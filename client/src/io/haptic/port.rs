//! Where the haptic thread and the network task meet: nothing here waits, and only making it allocates.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use mmt_shared::io::wake::Waker;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::tool::{HandPort, Tool};
use mmt_shared::model::update::Update;
use mmt_shared::time::Time;
use triple_buffer::{Input, Output, triple_buffer};

use crate::io::MasterLive;

/// Samples that may wait for the network task: a quarter of a second. Older ones the slave would not
/// play any more; when the ring is full the new one is dropped and counted.
pub const RING_SAMPLES: usize = 256;

/// What a tick says to the slave.
#[derive(Clone, Copy, Debug)]
pub struct Said {
    /// The HIP and the force that is felt.
    pub sample: HipSample,
    /// What goes to the tool's port, where the hand may feel the tool.
    pub port: Option<HandPort>,
}

/// What both ends look at.
#[derive(Debug)]
struct Signals {
    last_heard_ns: AtomicU64,
    release: AtomicBool,
    ended: AtomicBool,
}

/// The haptic thread's end.
#[derive(Debug)]
pub(super) struct LoopEnd {
    updates: Output<Option<Update>>,
    tools: Output<Option<(Time, Tool)>>,
    samples: rtrb::Producer<Said>,
    look: Input<MasterLive>,
    signals: Arc<Signals>,
    waker: Waker,
}

/// The network task's end.
#[derive(Debug)]
pub struct HapticPort {
    updates: Input<Option<Update>>,
    tools: Input<Option<(Time, Tool)>>,
    samples: rtrb::Consumer<Said>,
    look: Output<MasterLive>,
    signals: Arc<Signals>,
    superseded: u32,
}

/// Both ends; the slave counts as heard at `began`, `waker` wakes the network task.
pub(super) fn ends(began: Time, waker: Waker) -> (LoopEnd, HapticPort) {
    let signals = Arc::new(Signals {
        last_heard_ns: AtomicU64::new(began.as_nanos()),
        release: AtomicBool::new(false),
        ended: AtomicBool::new(false),
    });
    let (updates_in, updates_out) = triple_buffer(&None);
    let (tools_in, tools_out) = triple_buffer(&None);
    let (samples_in, samples_out) = rtrb::RingBuffer::new(RING_SAMPLES);
    let (look_in, look_out) = triple_buffer(&MasterLive::default());
    let loop_end = LoopEnd {
        updates: updates_out,
        tools: tools_out,
        samples: samples_in,
        look: look_in,
        signals: Arc::clone(&signals),
        waker,
    };
    let port = HapticPort {
        updates: updates_in,
        tools: tools_in,
        samples: samples_out,
        look: look_out,
        signals,
        superseded: 0,
    };
    (loop_end, port)
}

/// Tells the network task that the loop is no more, however it ended: also by a panic.
#[derive(Debug)]
pub(in crate::io) struct Gone {
    signals: Arc<Signals>,
    waker: Waker,
}

impl Drop for Gone {
    fn drop(&mut self) {
        self.signals.ended.store(true, Ordering::Release);
        self.waker.wake();
    }
}

impl LoopEnd {
    /// The newest update, if no tick has taken it before.
    pub(super) fn newest(&mut self) -> Option<&Update> {
        match self.updates.update() {
            true => self.updates.output_buffer().as_ref(),
            false => None,
        }
    }

    /// The newest news of the tool and when they arrived, if no tick has taken them before.
    pub(super) fn newest_tool(&mut self) -> Option<&(Time, Tool)> {
        match self.tools.update() {
            true => self.tools.output_buffer().as_ref(),
            false => None,
        }
    }

    /// How long nothing was heard of the slave.
    pub(super) fn silence(&self, now: Time) -> Duration {
        let heard = Time::from_nanos(self.signals.last_heard_ns.load(Ordering::Acquire));
        now.saturating_since(heard)
    }

    /// Whether the network task wants the hand released.
    pub(super) fn asked_to_release(&self) -> bool {
        self.signals.release.load(Ordering::Acquire)
    }

    /// Leaves a sample; false if the ring is full and it was dropped.
    pub(super) fn give(&mut self, said: Said) -> bool {
        self.samples.push(said).is_ok()
    }

    /// Wakes the network task.
    pub(super) fn wake(&self) {
        self.waker.wake();
    }

    /// Leaves a look for a screen.
    pub(super) fn show(&mut self, look: MasterLive) {
        *self.look.input_buffer_mut() = look;
        self.look.publish();
    }

    /// What tells the network task that the loop is no more.
    pub(super) fn gone(&self) -> Gone {
        Gone {
            signals: Arc::clone(&self.signals),
            waker: self.waker.clone(),
        }
    }
}

impl HapticPort {
    /// Puts an update into the cell; one that no tick has taken yet is superseded.
    pub fn offer(&mut self, update: &Update) {
        *self.updates.input_buffer_mut() = Some(*update);
        let overtook = self.updates.publish();
        self.superseded = self.superseded.saturating_add(u32::from(overtook));
    }

    /// Puts news of the tool that arrived at `now` into the cell: the newest is all that counts.
    pub fn offer_tool(&mut self, now: Time, tool: &Tool) {
        *self.tools.input_buffer_mut() = Some((now, *tool));
        self.tools.publish();
    }

    /// Says when the slave was last heard.
    pub fn heard(&self, at: Time) {
        self.signals
            .last_heard_ns
            .store(at.as_nanos(), Ordering::Release);
    }

    /// Asks the loop to release the hand and to end.
    pub fn release(&self) {
        self.signals.release.store(true, Ordering::Release);
    }

    /// Whether the loop's thread has ended.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.signals.ended.load(Ordering::Acquire)
    }

    /// The oldest sample that waits.
    pub fn pop(&mut self) -> Option<Said> {
        self.samples.pop().ok()
    }

    /// The newest look, without what only the network knows.
    pub fn look(&mut self) -> MasterLive {
        *self.look.read()
    }

    /// Updates that a newer one overtook before a tick could take them.
    #[must_use]
    pub fn superseded(&self) -> u32 {
        self.superseded
    }

    /// Whether an update waits that no tick has taken: once the loop has ended, none will.
    #[must_use]
    pub fn untaken(&self) -> bool {
        !self.updates.consumed()
    }
}
