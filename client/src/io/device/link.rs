//! The link's thread: each reading that is taken is answered at once, so that the device sets the pace.

use mmt_shared::io::clock::Clock;
use mmt_shared::io::plug_socket::{PACKET_MAX, PlugSocket};

use super::shared::Shared;
use crate::device::link::DeviceLink;

/// Serves whoever shows the token until the process ends.
pub(super) fn serve(socket: &PlugSocket, link: &mut DeviceLink, shared: &Shared) {
    let clock = Clock::start();
    let mut packet = [0; PACKET_MAX];
    loop {
        let (packet, from) = socket.receive(&mut packet);
        let now = clock.now();
        let mut due = false;
        shared.take(now, |give| {
            due = link.handle(now, from, packet, give);
            (link.seen(), *link.counts())
        });
        if due && !shared.has_ended() {
            let answer = link.answer(now, &shared.cell.load());
            socket.send(&answer, from);
        }
    }
}
