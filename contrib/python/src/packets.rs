//! The datagrams of a run as one structured array.

use mmt_lab::world::WorldPacket;
use mmt_netem::DropCause;
use mmt_netem::record::End;
use mmt_shared::model::update::Cause;
use pyo3::prelude::*;

use crate::arrays::{column, of_known, structured};

/// Names of what a datagram can carry.
const KINDS: [&str; 6] = ["", "command", "update", "scene", "tool", "heartbeat"];
/// The two directions.
const DIRECTIONS: [&str; 2] = ["up", "down"];

/// The names of the causes of updates; the first is that of no update.
pub(crate) fn causes() -> Vec<&'static str> {
    let causes = Cause::ALL.into_iter().map(Cause::name);
    std::iter::once("").chain(causes).collect()
}

/// The names of what can become of a datagram, the causes of drops last.
pub(crate) fn fates() -> Vec<&'static str> {
    let causes = DropCause::ALL.into_iter().map(DropCause::name);
    let others = ["under_way", "delivered", "corrupted"].into_iter();
    others.chain(causes).collect()
}

/// The place of a name; 0 where it is none.
fn place(names: &[&str], name: &str) -> u8 {
    let at = names.iter().position(|known| *known == name);
    at.and_then(|at| u8::try_from(at).ok()).unwrap_or_default()
}

/// The fate's name, and when it came if it did, s.
fn fate(end: Option<&End>) -> (&'static str, f64) {
    match end {
        None | Some(End::Unsent) => ("under_way", f64::NAN),
        Some(End::Dropped(cause)) => (cause.name(), f64::NAN),
        Some(End::Sent { due, corrupted, .. }) => {
            let name = if *corrupted { "corrupted" } else { "delivered" };
            (name, due.as_secs_f64())
        }
    }
}

/// The array.
pub(crate) fn table<'py>(py: Python<'py>, packets: &[WorldPacket]) -> PyResult<Bound<'py, PyAny>> {
    let (causes, fates) = (causes(), fates());
    let known = |names: &[&str], of: &dyn Fn(&WorldPacket) -> u8| {
        of_known(py, names, packets.iter().map(of).collect())
    };
    let whole = |of: fn(&WorldPacket) -> u32| column(py, packets.iter().map(of).collect());
    let seconds = |of: fn(&WorldPacket) -> f64| column(py, packets.iter().map(of).collect());
    let repeats: Vec<bool> = packets
        .iter()
        .map(|of| of.packet.fate == "repeated")
        .collect();
    let columns = [
        (
            "direction",
            known(&DIRECTIONS, &|of| place(&DIRECTIONS, &of.packet.direction))?,
        ),
        ("number", whole(|of| of.packet.number)),
        ("kind", known(&KINDS, &|of| place(&KINDS, &of.packet.kind))?),
        ("update", whole(|of| of.packet.update)),
        (
            "cause",
            known(&causes, &|of| place(&causes, &of.packet.cause))?,
        ),
        ("repeat", column(py, repeats)),
        ("bytes", whole(|of| of.packet.bytes)),
        ("sent", seconds(|of| of.sent.as_secs_f64())),
        ("arrived", seconds(|of| fate(of.end.as_ref()).1)),
        (
            "fate",
            known(&fates, &|of| place(&fates, fate(of.end.as_ref()).0))?,
        ),
    ];
    structured(py, packets.len(), &columns)
}
