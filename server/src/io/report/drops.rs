//! Everything that a slave host drops or refuses, by the name that the report gives it.

use std::sync::atomic::{AtomicU64, Ordering};

use mmt_shared::report::{Counts, named};
use mmt_shared::stats::session::Traffic;

use super::Outcome;
use crate::io::host::Shared;
use crate::io::slave_loop::Finished;

/// Every drop of the session by name; who was turned away at the door is counted from the host's start on.
pub(super) fn drops(
    shared: &Shared,
    outcome: &Outcome,
    finished: &Finished,
    traffic: &Traffic,
) -> Counts {
    let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    let (network, refusals) = (&outcome.counts, &shared.refusals);
    let away = shared.listener.turned_away();
    let mut drops = named([
        ("datagrams_malformed", traffic.malformed.into()),
        ("datagrams_duplicate", traffic.duplicates.into()),
        ("datagrams_too_old", traffic.too_old.into()),
        ("datagrams_unread", outcome.unread),
        ("datagrams_displaced", outcome.unsent),
        (
            "echoes_implausible",
            finished.end.channel().peer().echoes_implausible().into(),
        ),
        (
            "datagrams_ring_full",
            outcome.arrivals_dropped + finished.departures_dropped,
        ),
        ("updates_unsealed", finished.end.counts().unsendable),
        ("send_too_large", network.too_large),
        ("send_unsupported", network.unsupported),
        ("send_disconnected", network.disconnected),
        ("masters_busy", read(&refusals.busy)),
        ("masters_wrong_token", read(&refusals.wrong_token)),
        ("masters_bad_hello", read(&refusals.bad_hello)),
        ("masters_ending", read(&refusals.ending)),
        ("masters_no_hello", read(&refusals.no_hello)),
        ("masters_crowded", read(&refusals.crowded)),
        ("handshakes_failed", read(&refusals.handshake)),
        ("handshakes_refused", away.refused),
        ("handshakes_unreadable", away.unreadable),
    ]);
    let (socket, before) = (&outcome.after.outgoing, &outcome.before.outgoing);
    drops.extend(named(socket.drops_since(before)));
    drops.extend(slave_drops(finished));
    drops
}

fn slave_drops(finished: &Finished) -> Counts {
    let slave = finished.end.slave();
    let playout = slave.playout().counts();
    named([
        (
            "updates_superseded",
            finished.end.counts().updates_superseded,
        ),
        ("samples_late", playout.late),
        ("samples_duplicate", playout.duplicate),
        ("samples_overflow", playout.overflow),
        ("samples_implausible", playout.implausible),
        ("estimates_refused", slave.refused_estimates()),
        ("states_clamped", slave.clamped_states()),
        ("wrenches_refused", slave.environment().refused()),
        ("forces_not_finite", slave.force().rejected()),
    ])
}
