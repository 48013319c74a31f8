//! The task that reads an endpoint's socket and deals out what came.

use std::future::poll_fn;
use std::io::{self, IoSliceMut};
use std::sync::Arc;
use std::task::{Context, Poll};

use quinn::udp::RecvMeta;

use super::hub::Hub;

/// Messages read in one call; each may hold several datagrams of one sender (GRO).
const BATCH: usize = 8;
/// The longest message of the kernel, bytes.
const MESSAGE_MAX: usize = 65_536;

/// Reads until the endpoint is closed or its socket fails.
pub(super) async fn drive(hub: Arc<Hub>) {
    let mut buffers = vec![0; BATCH * MESSAGE_MAX];
    poll_fn(|context| read(&hub, context, &mut buffers)).await;
}

fn read(hub: &Hub, context: &mut Context<'_>, buffers: &mut [u8]) -> Poll<()> {
    loop {
        if hub.is_closed(context.waker()) {
            return Poll::Ready(());
        }
        let mut meta = [RecvMeta::default(); BATCH];
        let polled = {
            let mut slices: Vec<_> = buffers
                .chunks_mut(MESSAGE_MAX)
                .map(IoSliceMut::new)
                .collect();
            hub.socket.poll_recv(context, &mut slices, &mut meta)
        };
        match polled {
            Poll::Pending => return Poll::Pending,
            Poll::Ready(Ok(messages)) => {
                let filled = buffers.chunks(MESSAGE_MAX).zip(&meta).take(messages);
                filled.for_each(|(bytes, meta)| deal(hub, bytes, meta));
            }
            // somebody whom a packet was sent to is not there: no news of the socket
            Poll::Ready(Err(error)) if error.kind() == io::ErrorKind::ConnectionReset => {}
            Poll::Ready(Err(error)) => {
                tracing::warn!(%error, "the UDP socket failed");
                hub.fail();
                return Poll::Ready(());
            }
        }
    }
}

fn deal(hub: &Hub, bytes: &[u8], meta: &RecvMeta) {
    let message = bytes.get(..meta.len).unwrap_or_default();
    for datagram in message.chunks(meta.stride.max(1)) {
        hub.take(meta.addr, datagram);
    }
}
