//! The packets that an effect is worked out for: an even stream, or those that were recorded.

use std::collections::BTreeMap;
use std::time::Duration;

use mmt_shared::rng::Substream;
use mmt_shared::time::Time;

use crate::config::{Correlation, Cross, LinkConfig, Loss};
use crate::record::summary::runs;

/// Packets sampled. The mean of a delay is then known to 0.4 % of its standard deviation.
pub const PACKETS: u32 = 60_000;
/// The most packets sampled: where delays or losses hang together in time, or a queue follows a long trace.
pub(super) const PACKETS_MAX: u32 = 10 * PACKETS;
/// The most packets of cross traffic worked out, whose time somebody waits for: those sampled are fewer where more would come.
pub(super) const CROSS_MAX: u32 = 1_000_000;
/// The stretches of an even stream; each begins at a random point of the time between two packets, so that a
/// stream does not keep step with a trace.
pub(super) const STRETCHES: u32 = 100;
/// The rates that can be asked for, packets per second; others are taken to the nearest.
pub const RATE_RANGE_HZ: (f64, f64) = (0.01, 1e6);

/// The seed of the link that is run.
pub(super) const SEED: u64 = 0x6d6d_745f_6e65_7465;

/// The packets that an effect is worked out for.
pub(super) struct Offers {
    pub(super) rate_hz: f64,
    pub(super) packets: Vec<(Time, usize)>,
    /// After how many packets there is a gap, if there are gaps.
    unbroken: Option<usize>,
}

impl Offers {
    pub(super) fn recorded(packets: &[(Time, usize)]) -> Self {
        let (first, last) = (packets.first(), packets.last());
        let length = first
            .zip(last)
            .map(|((first, _), (last, _))| last.saturating_since(*first));
        let length = length.unwrap_or_default().as_secs_f64();
        let intervals = packets.len().saturating_sub(1) as f64;
        Self {
            rate_hz: clamp_rate(if length > 0.0 {
                intervals / length
            } else {
                0.0
            }),
            packets: packets.to_vec(),
            unbroken: None,
        }
    }

    /// An even stream in stretches over the whole period of the settings: without a gap where a queue carries
    /// what one packet did to the next, else anywhere in it.
    pub(super) fn even(config: &LinkConfig, rate_hz: f64, bytes: usize) -> Self {
        let number = sample_size(config, rate_hz);
        let interval = 1.0 / rate_hz;
        let natural = f64::from(number) * interval;
        let (period, queue) = (config.period().as_secs_f64(), has_rate(config));
        let span = if queue { natural } else { natural.max(period) };
        let each = number / STRETCHES;
        let length = span / f64::from(STRETCHES);
        let slack = (length - f64::from(each) * interval).max(interval);
        let mut dither = Substream::new(SEED, "netem/effect", 0);
        let packets = (0..STRETCHES).flat_map(|stretch| {
            let begin = f64::from(stretch) * length + slack * dither.uniform();
            (0..each).map(move |packet| {
                let at = Duration::from_secs_f64(begin + f64::from(packet) * interval);
                (Time::ZERO + at, bytes)
            })
        });
        Self {
            rate_hz,
            packets: packets.collect(),
            unbroken: (span > natural).then_some(each as usize),
        }
    }

    /// Runs of lost packets; none goes on across a gap.
    pub(super) fn runs(&self, lost: &[bool]) -> BTreeMap<u64, u64> {
        let gap = self.unbroken.map(|_| false);
        let stretches = lost.chunks(self.unbroken.unwrap_or(usize::MAX));
        runs(stretches.flat_map(|stretch| stretch.iter().copied().chain(gap)))
    }
}

/// Whether there is a bottleneck at any time.
fn has_rate(config: &LinkConfig) -> bool {
    config.links().any(|link| {
        let steps = &mut link.profile.steps.iter();
        link.rate.is_some() || steps.any(|step| step.settings.rate.is_some())
    })
}

/// How many packets show what these settings do.
fn sample_size(config: &LinkConfig, rate_hz: f64) -> u32 {
    // a thousand times the time over which delays hang together, and a whole trace with its queue
    let together = config.links().map(|link| match link.correlation {
        Correlation::InTime(tau) => tau.saturating_mul(1000),
        Correlation::None | Correlation::PerPacket(_) => Duration::ZERO,
    });
    let together = together.max().unwrap_or_default();
    let whole = if has_rate(config) {
        config.period()
    } else {
        Duration::ZERO
    };
    let needed = together.max(whole).as_secs_f64() * rate_hz;
    let by_formula = config.then.is_none() && config.only_the_model();
    let bursts = |link: &LinkConfig| matches!(link.loss, Loss::Bursts(_));
    let sampled_bursts = config.links().any(bursts) && !by_formula;
    let needed = if sampled_bursts {
        needed.max(f64::from(PACKETS_MAX))
    } else {
        needed
    };
    let needed = needed.clamp(PACKETS.into(), PACKETS_MAX.into());
    let of_others: f64 = config.links().map(cross_per_s).sum();
    let most = f64::from(CROSS_MAX) * rate_hz / of_others.max(f64::MIN_POSITIVE);
    needed.min(most).max(STRETCHES.into()) as u32
}

/// Packets of cross traffic a second, at its fastest.
fn cross_per_s(link: &LinkConfig) -> f64 {
    let steps = link.profile.steps.iter().map(|step| step.settings.cross);
    let all = steps.chain([link.cross]).flatten();
    let per_s = |cross: Cross| cross.bits_per_second as f64 / (8.0 * f64::from(cross.bytes));
    all.map(per_s).fold(0.0, f64::max)
}

pub(super) fn clamp_rate(rate_hz: f64) -> f64 {
    let (low, high) = RATE_RANGE_HZ;
    // NaN compares with nothing, and so becomes the lowest
    if rate_hz >= low {
        rate_hz.min(high)
    } else {
        low
    }
}
