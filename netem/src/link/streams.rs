//! The random substreams of a link, one for each feature, and the draws of one packet.

use mmt_shared::rng::Substream;

use crate::direction::{Direction, LinkId};

/// The random substreams of a link.
///
/// Each packet has its own draw of every stream, by its number, whatever the settings and whatever becomes of it
/// or of others, so that the n-th packet meets the same numbers under all settings of one seed.
#[derive(Clone, Debug)]
pub(super) struct Streams {
    loss: Substream,
    delay: Substream,
    state: Substream,
    duplicate: Substream,
    corrupt: Substream,
    corrupted_bit: Substream,
    reorder: Substream,
    copy: Substream,
    copy_corrupt: Substream,
    /// The packet whose draws come next.
    next: u64,
}

/// The draws of one packet, uniform in [0, 1).
#[derive(Clone, Copy, Debug)]
pub(super) struct Draws {
    /// Whether the packet is lost.
    pub(super) loss: f64,
    /// How long it takes.
    pub(super) delay: f64,
    /// Where the chain of a loss model goes.
    pub(super) state: f64,
    /// Whether there is a copy.
    pub(super) duplicate: f64,
    /// Whether a bit is flipped, and which.
    pub(super) corrupt: f64,
    pub(super) corrupted_bit: f64,
    /// Whether it overtakes.
    pub(super) reorder: f64,
    /// Loss and delay of the copy.
    pub(super) copy_loss: f64,
    pub(super) copy_delay: f64,
    /// Whether a bit of the copy is flipped, and which.
    pub(super) copy_corrupt: f64,
    pub(super) copy_bit: f64,
}

impl Streams {
    pub(super) fn new(seed: u64, id: LinkId) -> Self {
        let stream = |up, down| substream(id, seed, up, down);
        Self {
            loss: stream("netem/up/loss", "netem/down/loss"),
            delay: stream("netem/up/delay", "netem/down/delay"),
            state: stream("netem/up/state", "netem/down/state"),
            duplicate: stream("netem/up/duplicate", "netem/down/duplicate"),
            corrupt: stream("netem/up/corrupt", "netem/down/corrupt"),
            corrupted_bit: stream("netem/up/bit", "netem/down/bit"),
            reorder: stream("netem/up/reorder", "netem/down/reorder"),
            copy: stream("netem/up/copy", "netem/down/copy"),
            copy_corrupt: stream("netem/up/copybits", "netem/down/copybits"),
            next: 0,
        }
    }

    /// The draws of packet `number`.
    pub(super) fn draw(&mut self, number: u64) -> Draws {
        if number != self.next {
            self.seek(number);
        }
        self.next = number.wrapping_add(1);
        Draws {
            loss: self.loss.uniform(),
            delay: self.delay.uniform(),
            state: self.state.uniform(),
            duplicate: self.duplicate.uniform(),
            corrupt: self.corrupt.uniform(),
            corrupted_bit: self.corrupted_bit.uniform(),
            reorder: self.reorder.uniform(),
            copy_loss: self.copy.uniform(),
            copy_delay: self.copy.uniform(),
            copy_corrupt: self.copy_corrupt.uniform(),
            copy_bit: self.copy_corrupt.uniform(),
        }
    }
}

impl Streams {
    fn seek(&mut self, number: u64) {
        for stream in [
            &mut self.loss,
            &mut self.delay,
            &mut self.state,
            &mut self.duplicate,
            &mut self.corrupt,
            &mut self.corrupted_bit,
            &mut self.reorder,
        ] {
            stream.seek(number);
        }
        // two for each packet
        for stream in [&mut self.copy, &mut self.copy_corrupt] {
            stream.seek(number.saturating_mul(2));
        }
    }
}

/// The substream of one feature of a link, by its names in the two directions.
pub(super) fn substream(id: LinkId, seed: u64, up: &'static str, down: &'static str) -> Substream {
    let name = match id.direction {
        Direction::Up => up,
        Direction::Down => down,
    };
    Substream::new(seed, name, id.path)
}
