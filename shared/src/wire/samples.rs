//! The HIP samples of one command, packed: the first absolute, the others as differences.
//!
//! A step of a push takes 6 bytes instead of 24. Must never allocate, and never hold stamps that do not
//! increase.

use std::fmt;

use serde::de::{self, SeqAccess, Visitor};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::model::sample::{ForceCounts, HipCounts, HipSample};
use crate::time::{TICK, Time, duration_nanos};

/// The most samples that one command carries: 32 ms of motion, about 260 bytes.
pub const SAMPLES_MAX: usize = 32;

/// Why a sample was not added to a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PushError {
    /// The block is full.
    #[error("a command holds {SAMPLES_MAX} samples: send it before the next one")]
    Full,
    /// The stamp is not a whole, positive number of ticks after the last one, at most 2^32 - 1.
    #[error("stamp {stamp_ns} ns is not a whole number of milliseconds after {last_ns} ns")]
    OffGrid {
        /// The sample's stamp, ns.
        stamp_ns: u64,
        /// The last sample's stamp, ns.
        last_ns: u64,
    },
}

/// Up to [`SAMPLES_MAX`] samples, a whole positive number of milliseconds apart.
#[derive(Clone, Copy)]
pub struct SampleBlock {
    length: usize,
    samples: [HipSample; SAMPLES_MAX],
}

impl SampleBlock {
    /// Adds a sample.
    ///
    /// # Errors
    /// Why the sample cannot be in this block; the block stays as it was.
    pub fn push(&mut self, sample: HipSample) -> Result<(), PushError> {
        if let Some(last) = self.last() {
            ticks_between(last.stamp, sample.stamp).ok_or(PushError::OffGrid {
                stamp_ns: sample.stamp.as_nanos(),
                last_ns: last.stamp.as_nanos(),
            })?;
        }
        let room = self.samples.get_mut(self.length);
        *room.ok_or(PushError::Full)? = sample;
        self.length += 1;
        Ok(())
    }

    /// The samples, oldest first.
    pub fn as_slice(&self) -> &[HipSample] {
        self.samples.get(..self.length).unwrap_or_default()
    }

    /// The newest sample.
    pub fn last(&self) -> Option<&HipSample> {
        self.as_slice().last()
    }

    /// How many samples it holds.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Whether no more fit.
    pub fn is_full(&self) -> bool {
        self.length == SAMPLES_MAX
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.length = 0;
    }
}

impl Default for SampleBlock {
    /// A block without samples.
    fn default() -> Self {
        Self {
            length: 0,
            samples: [HipSample::default(); SAMPLES_MAX],
        }
    }
}

impl PartialEq for SampleBlock {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl fmt::Debug for SampleBlock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.as_slice()).finish()
    }
}

/// Whole ticks from `earlier` to `later`, if there are 1 to 2^32 - 1 of them and no remainder.
fn ticks_between(earlier: Time, later: Time) -> Option<u32> {
    let tick = duration_nanos(TICK);
    let apart = later.as_nanos().checked_sub(earlier.as_nanos())?;
    let ticks = u32::try_from(apart / tick).ok()?;
    (ticks > 0 && apart % tick == 0).then_some(ticks)
}

/// Every sample but the first on the wire: what changed since the one before.
#[derive(Serialize, Deserialize)]
struct Step {
    ticks: u32,
    hip_x: i64,
    hip_y: i64,
    force_x: i64,
    force_y: i64,
}

impl Step {
    fn between(from: &HipSample, to: &HipSample) -> Option<Self> {
        let apart = |from: i32, to: i32| i64::from(to) - i64::from(from);
        Some(Self {
            ticks: ticks_between(from.stamp, to.stamp)?,
            hip_x: apart(from.hip.x, to.hip.x),
            hip_y: apart(from.hip.y, to.hip.y),
            force_x: apart(from.force.x, to.force.x),
            force_y: apart(from.force.y, to.force.y),
        })
    }

    /// The sample after `from`; none if a number leaves its type or time stands still.
    fn from(&self, from: &HipSample) -> Option<HipSample> {
        let moved = |from: i32, by: i64| i32::try_from(i64::from(from).checked_add(by)?).ok();
        let apart = u64::from(self.ticks).checked_mul(duration_nanos(TICK))?;
        let stamp = from.stamp.as_nanos().checked_add(apart)?;
        (self.ticks > 0).then_some(HipSample {
            stamp: Time::from_nanos(stamp),
            hip: HipCounts {
                x: moved(from.hip.x, self.hip_x)?,
                y: moved(from.hip.y, self.hip_y)?,
            },
            force: ForceCounts {
                x: moved(from.force.x, self.force_x)?,
                y: moved(from.force.y, self.force_y)?,
            },
        })
    }
}

impl Serialize for SampleBlock {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut seq = serializer.serialize_seq(Some(self.length))?;
        if let Some(first) = self.as_slice().first() {
            seq.serialize_element(first)?;
        }
        for (from, to) in self.as_slice().iter().zip(self.as_slice().iter().skip(1)) {
            let step = Step::between(from, to);
            let step = step.ok_or_else(|| serde::ser::Error::custom("stamps off the grid"))?;
            seq.serialize_element(&step)?;
        }
        seq.end()
    }
}

impl<'de> Deserialize<'de> for SampleBlock {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Packed)
    }
}

/// Unpacks a block.
struct Packed;

impl<'de> Visitor<'de> for Packed {
    type Value = SampleBlock;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "up to {SAMPLES_MAX} samples with increasing stamps")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<SampleBlock, A::Error> {
        let mut block = SampleBlock::default();
        let Some(mut sample) = seq.next_element::<HipSample>()? else {
            return Ok(block);
        };
        block.push(sample).map_err(de::Error::custom)?;
        while let Some(step) = seq.next_element::<Step>()? {
            let next = step.from(&sample);
            sample = next.ok_or_else(|| de::Error::custom("a step leaves the range"))?;
            block.push(sample).map_err(de::Error::custom)?;
        }
        Ok(block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(ms: u64, x: i32, force: i32) -> HipSample {
        HipSample {
            stamp: Time::from_millis(ms),
            hip: HipCounts { x, y: -x },
            force: ForceCounts { x: force, y: 0 },
        }
    }

    fn packed(block: &SampleBlock) -> Vec<u8> {
        let mut buffer = [0; 1024];
        postcard::to_slice(block, &mut buffer).unwrap().to_vec()
    }

    fn unpacked(bytes: &[u8]) -> Option<SampleBlock> {
        postcard::from_bytes(bytes).ok()
    }

    #[test]
    fn stamps_in_a_block_increase_by_whole_ticks_or_the_sample_stays_out() {
        let mut block = SampleBlock::default();
        block.push(sample(5, 0, 0)).unwrap();
        let before = block;
        for stamp in [0, 4_000_000, 5_000_000, 5_999_999, 6_000_001] {
            let stamp = Time::from_nanos(stamp);
            let off = HipSample {
                stamp,
                ..sample(0, 1, 1)
            };
            assert!(matches!(block.push(off), Err(PushError::OffGrid { .. })));
            assert_eq!(block, before);
        }
        block.push(sample(9, 1, 1)).unwrap();
        assert_eq!(block.len(), 2);
    }

    #[test]
    fn a_full_block_takes_no_more_until_cleared() {
        let mut block = SampleBlock::default();
        for k in 0..SAMPLES_MAX as u64 {
            assert!(!block.is_full());
            block.push(sample(k, 0, 0)).unwrap();
        }
        assert!(block.is_full());
        assert_eq!(block.push(sample(99, 0, 0)), Err(PushError::Full));
        block.clear();
        assert!(block.is_empty() && block.last().is_none());
        block.push(sample(0, 0, 0)).unwrap();
    }

    #[test]
    fn the_widest_steps_survive_packing() {
        let mut block = SampleBlock::default();
        block.push(sample(0, i32::MIN + 1, i32::MAX)).unwrap();
        block
            .push(sample(u64::from(u32::MAX), i32::MAX, i32::MIN))
            .unwrap();
        assert_eq!(unpacked(&packed(&block)), Some(block));
    }

    #[test]
    fn a_step_that_leaves_its_type_or_stands_still_is_refused() {
        // one sample at stamp 0, all zero, then one step
        let with_step = |step: &[u8]| {
            let mut bytes = vec![2, 0, 0, 0, 0, 0];
            bytes.extend_from_slice(step);
            unpacked(&bytes)
        };
        assert!(with_step(&[1, 2, 0, 0, 0]).is_some());
        assert!(with_step(&[0, 2, 0, 0, 0]).is_none(), "no time passes");
        // zigzag of 2^31: one beyond i32
        let beyond = [1, 0x80, 0x80, 0x80, 0x80, 0x10, 0, 0, 0];
        assert!(with_step(&beyond).is_none(), "x leaves i32");
        let below = [1, 0xff, 0xff, 0xff, 0xff, 0x0f, 0, 0, 0];
        assert!(with_step(&below).is_some(), "-2^31 is within i32");
    }

    #[test]
    fn a_stamp_that_leaves_its_type_is_refused() {
        let mut late = sample(0, 0, 0);
        late.stamp = Time::MAX;
        let mut block = SampleBlock::default();
        block.push(late).unwrap();
        let mut bytes = packed(&block);
        bytes[0] = 2;
        bytes.extend_from_slice(&[1, 0, 0, 0, 0]);
        assert!(unpacked(&bytes).is_none());
    }

    #[test]
    fn more_samples_than_a_block_holds_are_refused_whatever_length_is_claimed() {
        for claimed in [33, 127] {
            let mut bytes = vec![claimed, 0, 0, 0, 0, 0];
            for _ in 1..claimed {
                bytes.extend_from_slice(&[1, 0, 0, 0, 0]);
            }
            assert!(unpacked(&bytes).is_none());
        }
        assert!(unpacked(&[0xff, 0xff, 0xff, 0xff, 0x0f, 0, 0, 0, 0, 0]).is_none());
    }
}
