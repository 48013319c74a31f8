//! A link in the words that parse back to the very same settings.

use std::fmt;
use std::time::Duration;

use super::SHAPES;
use crate::config::{
    Chance, Codel, Correlation, Cross, Delay, Limit, LinkConfig, Loss, Order, Outage, Probability,
    Profile, Queue, Rate, Service, Shape, Slot, SlotGap,
};
use crate::distribution::Cdf;
use crate::trace::path::Replay;

impl From<LinkConfig> for String {
    fn from(config: LinkConfig) -> Self {
        config.to_string()
    }
}

impl fmt::Display for LinkConfig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentences: Vec<String> = self.sentences().into_iter().flatten().collect();
        if sentences.is_empty() {
            f.write_str("none")?;
        }
        f.write_str(&sentences.join(" "))?;
        self.profile.fmt(f)?;
        match &self.then {
            Some(then) => write!(f, "; then {then}"),
            None => Ok(()),
        }
    }
}

impl LinkConfig {
    fn sentences(&self) -> Vec<Option<String>> {
        let chance = |name, chance: Chance| {
            (chance != Chance::default()).then(|| format!("{name} {}", InWords(chance)))
        };
        let gap = |gap| match gap {
            1 => String::new(),
            gap => format!(" gap {gap}"),
        };
        let mut sentences = vec![
            (self.delay != Delay::default()).then(|| delay(&self.delay, self.correlation)),
            self.slot.as_ref().map(slot),
            loss(&self.loss),
            self.ecn.then(|| "ecn".to_owned()),
            self.replay.as_ref().map(replay),
        ];
        sentences.extend(self.outages.iter().map(|outage| Some(outage_words(outage))));
        sentences.extend([
            (self.order == Order::Free).then(|| "order free".to_owned()),
            self.reorder
                .map(|reorder| format!("reorder {}{}", InWords(reorder.chance), gap(reorder.gap))),
            chance("duplicate", self.duplicate),
            chance("corrupt", self.corrupt),
            self.mtu.map(|mtu| format!("mtu {mtu}")),
            self.rate.as_ref().map(rate),
            queue(&self.queue),
            self.queue.codel.map(codel),
            self.cross.map(cross),
            limit(self.limit),
            self.seed.map(|seed| format!("seed {seed}")),
        ]);
        sentences
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in &self.steps {
            write!(f, "; at {}", Exact(step.at))?;
            if !step.ramp.is_zero() {
                write!(f, " over {}", Exact(step.ramp))?;
            }
            write!(f, " {}", step.settings)?;
        }
        match self.repeat {
            Some(repeat) => write!(f, "; loop {}", Exact(repeat)),
            None => Ok(()),
        }
    }
}

fn delay(delay: &Delay, correlation: Correlation) -> String {
    let correlated = match correlation {
        Correlation::None => String::new(),
        Correlation::PerPacket(rho) => format!(" {rho}"),
        Correlation::InTime(tau) => format!(" tau {}", Exact(tau)),
    };
    let (mean, jitter) = (Exact(delay.mean), Exact(delay.jitter));
    match &delay.shape {
        Shape::Empirical(cdf) => format!("delay cdf {}{correlated}", points(cdf)),
        Shape::Constant => format!("delay {mean}"),
        Shape::Uniform => format!("delay {mean} {jitter}{correlated}"),
        other => format!(
            "delay {mean} {jitter}{correlated} distribution {}",
            shape(other)
        ),
    }
}

/// The name of a distribution.
fn shape(shape: &Shape) -> String {
    if let Shape::Table(table) = shape {
        return format!("table {}", table.name);
    }
    let named = SHAPES.iter().find(|(_, named)| named == shape);
    named.map_or("uniform", |(name, _)| name).to_owned()
}

fn slot(slot: &Slot) -> String {
    let mut words = match &slot.gap {
        SlotGap::Uniform { least, most } if least == most => format!("slot {}", Exact(*least)),
        SlotGap::Uniform { least, most } => format!("slot {} {}", Exact(*least), Exact(*most)),
        SlotGap::Drawn(gap) => {
            let (mean, jitter) = (Exact(gap.mean), Exact(gap.jitter));
            format!("slot distribution {} {mean} {jitter}", shape(&gap.shape))
        }
    };
    if let Some(packets) = slot.packets {
        words.push_str(&format!(" packets {packets}"));
    }
    if let Some(bytes) = slot.bytes {
        words.push_str(&format!(" bytes {bytes}"));
    }
    words
}

fn points(cdf: &Cdf) -> String {
    if let Some(name) = &cdf.name {
        return name.clone();
    }
    let point = |(delay, share): (u64, f64)| {
        let share = Probability::from_percent(100.0 * share).unwrap_or_default();
        format!("{}@{share}", Exact(Duration::from_nanos(delay)))
    };
    cdf.points().map(point).collect::<Vec<_>>().join(",")
}

fn loss(loss: &Loss) -> Option<String> {
    Some(match loss {
        Loss::None => return None,
        Loss::Independent { probability } => format!("loss {probability}"),
        Loss::Correlated {
            probability,
            correlation,
        } => format!("loss {probability} {correlation}"),
        Loss::Gemodel(c) => format!(
            "loss gemodel {} {} {} {}",
            c.to_bad, c.to_good, c.loss_in_bad, c.loss_in_good
        ),
        Loss::FourState(c) => format!(
            "loss state {} {} {} {} {}",
            c.p13, c.p31, c.p32, c.p23, c.p14
        ),
        Loss::Bursts(b) => format!(
            "loss burst {} {} {} {}",
            b.share,
            Exact(b.mean),
            b.loss_inside,
            b.loss_between
        ),
        Loss::Every(n) => format!("loss every {n}"),
        Loss::Listed(list) => {
            let range = |(first, last): &(u64, u64)| {
                if first == last {
                    return first.to_string();
                }
                format!("{first}-{last}")
            };
            let ranges: Vec<String> = list.ranges().iter().map(range).collect();
            format!("loss list {}", ranges.join(","))
        }
    })
}

fn replay(replay: &Replay) -> String {
    let direction = replay.direction.map(|direction| direction.name());
    match direction {
        Some(direction) => format!("trace {} {direction}", replay.name),
        None => format!("trace {}", replay.name),
    }
}

fn outage_words(outage: &Outage) -> String {
    let (at, length) = (Exact(outage.at), Exact(outage.length));
    match outage.every {
        Some(every) => format!("outage {at} for {length} every {}", Exact(every)),
        None => format!("outage {at} for {length}"),
    }
}

fn rate(rate: &Rate) -> String {
    let service = match &rate.service {
        Service::Constant { bits_per_second } => bits(*bits_per_second),
        Service::Opportunities(trace) => format!("trace {}", trace.name),
    };
    let framing = &rate.framing;
    match (framing.overhead, framing.cell, framing.cell_overhead) {
        (0, 0, 0) => format!("rate {service}"),
        (overhead, 0, 0) => format!("rate {service} {overhead}"),
        (overhead, cell, cell_overhead) => {
            format!("rate {service} {overhead} {cell} {cell_overhead}")
        }
    }
}

/// A rate as a whole number of the largest unit that holds it exactly.
fn bits(rate: u64) -> String {
    let units = [
        (1_000_000_000, "gbit"),
        (1_000_000, "mbit"),
        (1_000, "kbit"),
    ];
    let whole = units.iter().find(|(size, _)| rate.is_multiple_of(*size));
    let (size, unit) = whole.copied().unwrap_or((1, "bit"));
    format!("{}{unit}", rate / size)
}

fn queue(queue: &Queue) -> Option<String> {
    let limits = [
        queue.bytes.map(|bytes| format!("{bytes}b")),
        queue.packets.map(|packets| format!("{packets}p")),
        queue.wait.map(|wait| Exact(wait).to_string()),
    ];
    let limits: Vec<String> = limits.into_iter().flatten().collect();
    let end = if queue.drop_head { " drop-head" } else { "" };
    (!limits.is_empty()).then(|| format!("queue {}{end}", limits.join(" ")))
}

fn limit(limit: Limit) -> Option<String> {
    let bytes = match limit.bytes {
        bytes if bytes == Limit::default().bytes => String::new(),
        bytes => format!(" {bytes}b"),
    };
    (limit != Limit::default()).then(|| format!("limit {}{bytes}", limit.packets))
}

fn codel(codel: Codel) -> String {
    if codel == Codel::default() {
        return "codel".to_owned();
    }
    format!("codel {} {}", Exact(codel.target), Exact(codel.interval))
}

fn cross(cross: Cross) -> String {
    let rate = bits(cross.bits_per_second);
    format!("cross {rate} poisson {}", cross.bytes)
}

/// A chance in words: its share, and its correlation if it has one.
struct InWords(Chance);

impl fmt::Display for InWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0.probability)?;
        if self.0.correlation != Probability::ZERO {
            write!(f, " {}", self.0.correlation)?;
        }
        Ok(())
    }
}

/// A percentage without rounding and without idle zeros.
impl fmt::Display for Probability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const PER_PERCENT: u32 = 10_000_000;
        let parts = self.parts_per_billion();
        let decimals = format!("{:07}", parts % PER_PERCENT);
        match decimals.trim_end_matches('0') {
            "" => write!(f, "{}%", parts / PER_PERCENT),
            decimals => write!(f, "{}.{decimals}%", parts / PER_PERCENT),
        }
    }
}

/// A time as a whole number of the largest unit that holds it exactly.
struct Exact(Duration);

impl fmt::Display for Exact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")];
        let whole = units
            .iter()
            .find(|(size, _)| nanos > 0 && nanos.is_multiple_of(*size));
        let (size, unit) = whole.copied().unwrap_or((1, "ns"));
        write!(f, "{}{unit}", nanos / size)
    }
}
