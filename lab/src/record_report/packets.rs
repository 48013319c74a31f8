//! Packets of a run by what they carry and by what became of them.

use std::collections::BTreeMap;

use mmt_shared::record::messages::Packet;

use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series};
use crate::table::{Table, column};

/// A datagram of a run: direction, number, and when it left by its sender's clock.
type Key = (bool, u32, u64);

/// A datagram as its sender kept it.
#[derive(Clone, Debug)]
struct Sent {
    t_s: f64,
    what: String,
    repeats: bool,
}

/// Packets as they were handed over.
#[derive(Default)]
pub(super) struct Packets {
    sent: BTreeMap<Key, Sent>,
    arrived: BTreeMap<Key, f64>,
    /// What arrived, by direction, content and fate.
    fates: BTreeMap<(bool, String, String), u64>,
}

/// Up is first.
fn is_down(packet: &Packet) -> bool {
    packet.direction == "down"
}

/// What it carries: of an update its cause.
fn what(packet: &Packet) -> String {
    if packet.cause.is_empty() {
        packet.kind.clone()
    } else {
        format!("update:{}", packet.cause)
    }
}

impl Packets {
    pub(super) fn take(&mut self, t_s: f64, packet: Packet) {
        let key = (is_down(&packet), packet.number, packet.sent_ns);
        let what = what(&packet);
        if matches!(packet.fate.as_str(), "sent" | "repeated") {
            let repeats = packet.fate == "repeated";
            self.sent.insert(key, Sent { t_s, what, repeats });
        } else {
            self.arrived.entry(key).or_insert(t_s);
            let fates = self.fates.entry((key.0, what, packet.fate));
            *fates.or_default() += 1;
        }
    }

    /// Each with what became of it at the other end.
    pub(super) fn matched(&self) -> Matched<'_> {
        let newest = |down| {
            let arrived = self.arrived.keys().filter(|key| key.0 == down);
            arrived.map(|key| key.2).max()
        };
        Matched {
            packets: self,
            newest_ns: [newest(false), newest(true)],
        }
    }
}

/// Packets of both ends, as far as both are there.
pub(super) struct Matched<'a> {
    packets: &'a Packets,
    /// When the newest that arrived had left, by its sender's clock: up, down; none where the other end is not there.
    newest_ns: [Option<u64>; 2],
}

/// A kind of packets.
#[derive(Clone, Debug, Default)]
struct Kind {
    direction: &'static str,
    what: String,
    sent: Option<u64>,
    repeated: Option<u64>,
    lost: Option<u64>,
    fates: [u64; 6],
}

const FATES: [&str; 6] = [
    "newest",
    "reordered",
    "duplicate",
    "too_old",
    "implausible",
    "malformed",
];

impl Matched<'_> {
    /// Whether a datagram was lost on the way; none if nobody can know. What left after the newest that arrived may
    /// still be on its way.
    fn is_lost(&self, key: &Key) -> Option<bool> {
        let [up, down] = self.newest_ns;
        let newest_ns = if key.0 { down } else { up }?;
        Some(key.2 < newest_ns && !self.packets.arrived.contains_key(key))
    }

    /// Time from leaving to arriving of each datagram whose two ends are there, s: up, down.
    pub(super) fn delays(&self, down: bool) -> Vec<f64> {
        let sent = self.packets.sent.iter().filter(|(key, _)| key.0 == down);
        sent.filter_map(|(key, sent)| Some(self.packets.arrived.get(key)? - sent.t_s))
            .collect()
    }

    fn kinds(&self) -> Vec<Kind> {
        let mut kinds: BTreeMap<(bool, &str), Kind> = BTreeMap::new();
        for (key, sent) in &self.packets.sent {
            let kind = kinds.entry((key.0, &sent.what)).or_default();
            if sent.repeats {
                *kind.repeated.get_or_insert(0) += 1;
            } else {
                *kind.sent.get_or_insert(0) += 1;
            }
            if let Some(lost) = self.is_lost(key) {
                *kind.lost.get_or_insert(0) += u64::from(lost);
            }
        }
        for ((down, what, fate), count) in &self.packets.fates {
            let kind = kinds.entry((*down, what)).or_default();
            let fates = kind.fates.iter_mut().zip(FATES);
            fates.for_each(|(slot, name)| *slot += if name == fate { *count } else { 0 });
        }
        let named = kinds.into_iter().map(|((down, what), kind)| Kind {
            direction: if down { "down" } else { "up" },
            what: what.to_owned(),
            ..kind
        });
        named.collect()
    }

    /// A row a kind and direction.
    #[rustfmt::skip]
    pub(super) fn table(&self) -> Table {
        fn fate<const N: usize>(kind: &Kind) -> u64 {
            kind.fates.get(N).copied().unwrap_or(0)
        }
        Table::of(
            "Packets",
            &self.kinds(),
            &[
                column("direction", "", 0, |kind| kind.direction),
                column("what", "", 0, |kind| kind.what.clone()),
                column("sent", "", 0, |kind| kind.sent),
                column("repeated", "", 0, |kind| kind.repeated),
                column("lost", "", 0, |kind| kind.lost),
                column("newest", "", 0, fate::<0>),
                column("reordered", "", 0, fate::<1>),
                column("duplicate", "", 0, fate::<2>),
                column("too_old", "", 0, fate::<3>),
                column("implausible", "", 0, fate::<4>),
                column("malformed", "", 0, fate::<5>),
            ],
        )
    }

    /// Updates so far by cause, and datagrams lost so far.
    pub(super) fn figure(&self) -> Figure {
        let ends = self.packets.sent.values().map(|sent| sent.t_s);
        let end_s = ends.fold(0.0, f64::max);
        Figure {
            panels: vec![
                panel("updates by cause", "updates so far", self.updates(end_s)),
                panel("lost on the way", "datagrams so far", self.losses(end_s)),
            ],
            columns: 2,
            panel_size: (530, 330),
        }
    }

    /// A curve a cause.
    fn updates(&self, end_s: f64) -> Vec<Series> {
        let mut updates: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for sent in self.packets.sent.values().filter(|sent| !sent.repeats) {
            if let Some(cause) = sent.what.strip_prefix("update:") {
                updates.entry(cause).or_default().push(sent.t_s);
            }
        }
        let by_cause = updates.into_iter().zip(COLOURS);
        let by_cause = by_cause.map(|((cause, times), colour)| so_far(cause, colour, times, end_s));
        by_cause.collect()
    }

    /// A curve a direction both ends of which are there.
    fn losses(&self, end_s: f64) -> Vec<Series> {
        let ways = [("up", false), ("down", true)].into_iter();
        let known = ways.zip(self.newest_ns);
        let known = known.filter_map(|(way, newest)| newest.map(|_| way));
        let curves = known.zip(COLOURS).map(|((name, down), colour)| {
            let sent = self.packets.sent.iter().filter(|(key, _)| key.0 == down);
            let lost = sent.filter(|(key, _)| self.is_lost(key) == Some(true));
            let times = lost.map(|(_, sent)| sent.t_s).collect();
            so_far(name, colour, times, end_s)
        });
        curves.collect()
    }
}

const COLOURS: [Colour; 6] = [
    Colour::VERMILION,
    Colour::BLUE,
    Colour::GREEN,
    Colour::PURPLE,
    Colour::ORANGE,
    Colour::BLACK,
];

/// Curves over time, with room for their legend.
fn panel(title: &str, what: &str, series: Vec<Series>) -> Panel {
    let dots = series.iter().flat_map(|series| &series.dots);
    let most = dots.map(|dot| dot.y).fold(1.0, f64::max);
    let y = Axis::linear(what).over(0.0..1.5 * most);
    Panel::new(title, Axis::linear("time, s"), y, series).with_legend(Legend::UpperLeft)
}

/// A curve that rises by one at each of the times, to the end of the run.
fn so_far(label: &str, colour: Colour, mut times: Vec<f64>, end_s: f64) -> Series {
    times.sort_by(f64::total_cmp);
    let counted = times.into_iter().zip(1_u32..);
    let dots = counted.flat_map(|(t_s, count)| {
        let count = f64::from(count);
        [Dot::at(t_s, count - 1.0), Dot::at(t_s, count)]
    });
    let first = [Dot::at(0.0, 0.0)].into_iter();
    let mut dots: Vec<Dot> = first.chain(dots).collect();
    let last = dots.last().map_or(0.0, |dot| dot.y);
    dots.push(Dot::at(end_s, last));
    Series::line(label, colour, dots)
}
