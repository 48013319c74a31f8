//! `mmt.Link`: the emulated link by itself.

use std::collections::VecDeque;

use mmt_netem::link::LinkId;
use mmt_netem::packet::flip_bit;
use mmt_netem::words::parse;
use mmt_netem::{self as netem, Direction, DropCause, Fate, LinkConfig, Packet};
use mmt_shared::time::Time;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{column, numbers, of_known};
use crate::packets::fates;

/// The latest time, s: far beyond use, and a nanosecond there still is one.
const TIME_MAX_S: f64 = 1e9;
/// The longest packet, bytes: what a datagram of UDP may hold.
const BYTES_MAX: usize = 65_535;
/// Bytes of a packet whose size is not given.
const BYTES: usize = 100;

/// A packet that left the link, or was dropped by it.
///
/// number: of its offer, from 0. offered, time: when it was offered, and when it left or was dropped, s. payload: its
/// bytes, one bit flipped where it is corrupted. fate: "delivered" or the cause of the drop: "loss", "outage", "mtu",
/// "queue", "codel", "limit". copy: whether it is a second one of its offer. corrupted: whether a bit is flipped.
/// marked: whether it met congestion (ECN). queued: how long it waited before the bottleneck, s.
#[pyclass(frozen, get_all, module = "mmt")]
pub(crate) struct Departure {
    number: u64,
    offered: f64,
    time: f64,
    payload: Py<PyBytes>,
    fate: &'static str,
    copy: bool,
    corrupted: bool,
    marked: bool,
    queued: f64,
}

#[pymethods]
impl Departure {
    fn __repr__(&self) -> String {
        let Self {
            number,
            offered,
            time,
            fate,
            ..
        } = self;
        format!("<mmt.Departure {number}: offered {offered} s, {fate} {time} s>")
    }
}

type Out = netem::Departure<Vec<u8>>;

fn departure(py: Python<'_>, mut out: Out) -> Departure {
    let (fate, bit, marked) = match out.fate {
        Fate::Dropped(cause) => (cause.name(), None, false),
        Fate::Delivered {
            corrupted_bit,
            marked,
        } => ("delivered", corrupted_bit, marked),
    };
    if let Some(bit) = bit {
        flip_bit(&mut out.payload, bit);
    }
    Departure {
        number: out.number,
        offered: out.offered_at.as_secs_f64(),
        time: out.due.as_secs_f64(),
        payload: PyBytes::new(py, &out.payload).unbind(),
        fate,
        copy: out.copy,
        corrupted: bit.is_some(),
        marked,
        queued: out.queued.as_secs_f64(),
    }
}

/// One direction of an emulated path, in virtual time: packets go in, and come out later or not at all.
///
/// words: those of `tc netem` and more (docs/netem.md): "delay 50ms 5ms loss burst 2% 60ms". Files that they name are read.
/// seed: of its draws. direction: "up" or "down"; of one seed the two draw different numbers, as those of a run do.
/// Equal calls give equal answers. Times are s from the link's beginning and must not go back. Raises ValueError of wrong words.
#[pyclass(module = "mmt")]
pub(crate) struct Link {
    link: netem::Link<Vec<u8>>,
    now: Time,
    offers: u64,
    /// What has left and was not asked for yet.
    out: VecDeque<Out>,
}

impl Link {
    fn at(&self, time: f64) -> PyResult<Time> {
        if !(0.0..=TIME_MAX_S).contains(&time) {
            let what = format!("time is {time}; it must be 0 to {TIME_MAX_S} s");
            return Err(PyValueError::new_err(what));
        }
        let at = Time::from_nanos((time * 1e9).round() as u64);
        if at < self.now {
            let now = self.now.as_secs_f64();
            let what = format!("time is {time} s, and the link is at {now} s: it does not go back");
            return Err(PyValueError::new_err(what));
        }
        Ok(at)
    }

    /// Everything that is done by then goes out: what is due and still there would count against the limit.
    fn go_on(&mut self, now: Time) {
        self.now = self.now.max(now);
        while let Some(out) = self.link.poll(now) {
            self.out.push_back(out);
        }
    }

    fn put(&mut self, now: Time, payload: Vec<u8>) -> u64 {
        self.go_on(now);
        let number = self.offers;
        self.offers += 1;
        self.link.offer(now, Packet::new(payload.len(), payload));
        number
    }
}

/// The fate of each of some packets, and when it came.
struct Fates {
    first: u64,
    arrived: Vec<f64>,
    places: Vec<u8>,
}

impl Fates {
    fn new(first: u64, count: usize) -> Self {
        Self {
            first,
            arrived: vec![f64::NAN; count],
            places: vec![0; count],
        }
    }

    /// What came first is its fate; an offer that was lost may have a copy that still comes.
    fn take(&mut self, out: &Out, names: &[&str]) {
        let at = out.number.checked_sub(self.first);
        let at = at.and_then(|at| usize::try_from(at).ok());
        let at = at.unwrap_or(usize::MAX);
        let name = match out.fate {
            Fate::Dropped(cause) => cause.name(),
            Fate::Delivered { .. } if out.is_corrupted() => "corrupted",
            Fate::Delivered { .. } => "delivered",
        };
        let place = names.iter().position(|known| *known == name);
        let place = place.and_then(|place| u8::try_from(place).ok());
        let (arrived, slot) = (self.arrived.get_mut(at), self.places.get_mut(at));
        if let (Some(arrived), Some(slot), Some(place)) = (arrived, slot, place)
            && arrived.is_nan()
        {
            *slot = place;
            if out.is_delivered() {
                *arrived = out.due.as_secs_f64();
            }
        }
    }
}

#[pymethods]
impl Link {
    #[new]
    #[pyo3(signature = (words, *, seed=1, direction="up"))]
    fn new(words: &str, seed: u64, direction: &str) -> PyResult<Self> {
        let refused = |error: String| PyValueError::new_err(error);
        let mut read =
            |path: &str| std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"));
        let config: LinkConfig =
            parse(words, &mut read).map_err(|error| refused(error.to_string()))?;
        let direction = match direction {
            "up" => Direction::Up,
            "down" => Direction::Down,
            _ => {
                let what = format!("direction is '{direction}'; it must be 'up' or 'down'");
                return Err(refused(what));
            }
        };
        let link = netem::Link::try_new(config, seed, LinkId::first(direction));
        Ok(Self {
            link: link.map_err(|error| refused(error.to_string()))?,
            now: Time::ZERO,
            offers: 0,
            out: VecDeque::new(),
        })
    }

    /// Puts a packet on the link at a time, s; returns the number of the offer, from 0.
    #[pyo3(signature = (time, payload))]
    fn offer(&mut self, time: f64, payload: &[u8]) -> PyResult<u64> {
        let now = self.at(time)?;
        if payload.len() > BYTES_MAX {
            let what = format!(
                "payload has {} bytes; it may have {BYTES_MAX}",
                payload.len()
            );
            return Err(PyValueError::new_err(what));
        }
        Ok(self.put(now, payload.to_vec()))
    }

    /// Everything that has left or was dropped by a time, s, and was not handed out yet: by time, then by number. Drops of copies
    /// are counted, and not handed out.
    #[pyo3(signature = (time))]
    fn poll(&mut self, py: Python<'_>, time: f64) -> PyResult<Vec<Departure>> {
        let now = self.at(time)?;
        py.detach(|| self.go_on(now));
        Ok(self.out.drain(..).map(|out| departure(py, out)).collect())
    }

    /// When to poll next, s; None while nothing is on the link.
    #[getter]
    fn next_time(&self) -> Option<f64> {
        let first = self.out.front().map(|out| out.due);
        let next = first.into_iter().chain(self.link.poll_timeout()).min();
        next.map(Time::as_secs_f64)
    }

    /// Sends many packets and waits until the last of them has left or was dropped, which is the link's time then.
    ///
    /// times: when each is offered, s, (N,), not falling. sizes: bytes of each, (N,) or one number; 100 if None.
    /// Returns (arrived, fate): when each came, s, (N,), NaN where it did not; and "delivered", "corrupted" or the
    /// cause of the drop, (N,). A copy changes neither. Releases the GIL.
    #[pyo3(signature = (times, sizes=None))]
    fn send<'py>(
        &mut self,
        py: Python<'py>,
        times: &Bound<'py, PyAny>,
        sizes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (times, shape) = numbers(times)?;
        if shape.len() != 1 {
            return Err(PyValueError::new_err("times must be of shape (N,)"));
        }
        let sizes = sizes_of(sizes, times.len())?;
        let mut at = Vec::with_capacity(times.len());
        for time in &times {
            let time = self.at(*time)?;
            if at.last().is_some_and(|before| time < *before) {
                return Err(PyValueError::new_err("times must not fall"));
            }
            at.push(time);
        }
        let names = fates();
        let fates = py.detach(|| self.send_all(&at, &sizes, &names));
        let fate = of_known(py, &names, fates.places)?;
        Ok((column(py, fates.arrived), fate))
    }

    /// Packets on the link.
    #[getter]
    fn in_flight(&self) -> usize {
        self.link.in_flight()
    }

    /// Its settings in words.
    #[getter]
    fn words(&self) -> String {
        self.link.config().to_string()
    }

    /// What became of the packets so far: packets offered, delivered, duplicated, corrupted, marked, bytes_offered,
    /// bytes_delivered, and dropped, a dict of packets by cause. offered + duplicated = delivered + in_flight + dropped.
    #[getter]
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counters = self.link.counters();
        let stats = PyDict::new(py);
        let dropped = PyDict::new(py);
        for cause in DropCause::ALL {
            dropped.set_item(cause.name(), counters.dropped.of(cause).packets)?;
        }
        stats.set_item("offered", counters.offered.packets)?;
        stats.set_item("delivered", counters.delivered.packets)?;
        stats.set_item("duplicated", counters.duplicated.packets)?;
        stats.set_item("corrupted", counters.corrupted.packets)?;
        stats.set_item("marked", counters.marked.packets)?;
        stats.set_item("bytes_offered", counters.offered.bytes)?;
        stats.set_item("bytes_delivered", counters.delivered.bytes)?;
        stats.set_item("dropped", dropped)?;
        Ok(stats)
    }

    fn __repr__(&self) -> String {
        format!("<mmt.Link {}>", self.words())
    }
}

impl Link {
    fn send_all(&mut self, at: &[Time], sizes: &[usize], names: &[&str]) -> Fates {
        let kept = self.out.len();
        let mut fates = Fates::new(self.offers, at.len());
        for (at, bytes) in at.iter().zip(sizes) {
            self.put(*at, vec![0; *bytes]);
        }
        while let Some(next) = self.link.poll_timeout() {
            self.go_on(next);
        }
        // what was on the link before is still to be asked for
        let first = fates.first;
        let mut earlier = VecDeque::new();
        for (n, out) in self.out.drain(..).enumerate() {
            if n < kept || out.number < first {
                earlier.push_back(out);
            } else {
                fates.take(&out, names);
            }
        }
        self.out = earlier;
        fates
    }
}

/// Bytes of each of so many packets.
fn sizes_of(given: Option<&Bound<'_, PyAny>>, count: usize) -> PyResult<Vec<usize>> {
    let sizes: Vec<usize> = match given {
        None => vec![BYTES; count],
        Some(given) => match given.extract::<usize>() {
            Ok(all) => vec![all; count],
            Err(_) => given.extract()?,
        },
    };
    if sizes.len() != count {
        let what = format!("there are {} sizes for {count} times", sizes.len());
        return Err(PyValueError::new_err(what));
    }
    match sizes.iter().find(|bytes| **bytes > BYTES_MAX) {
        None => Ok(sizes),
        Some(bytes) => {
            let what = format!("a packet of {bytes} bytes; it may have {BYTES_MAX}");
            Err(PyValueError::new_err(what))
        }
    }
}
