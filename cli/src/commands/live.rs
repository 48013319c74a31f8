//! `mmt live`: a record, while it is written, on a WebSocket that viewers read: Lichtblick, Foxglove, PlotJuggler.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use foxglove::{
    Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServerHandle,
};
use mcap::io::MessageReader;
use mcap::{McapError, Message};

use crate::args::LiveArguments;
use crate::failure::{Exit, Failure};
use crate::output::{note, print};
use crate::stop::Stop;

/// Between two looks at a file that does not grow.
const PAUSE: Duration = Duration::from_millis(20);
/// Messages that may wait for a viewer; the oldest go first.
const BACKLOG: usize = 4096;

/// Runs `mmt live`.
///
/// # Errors
/// The record cannot be read, is none, began anew or was whole from the start; the port cannot be had.
pub(crate) fn run(arguments: &LiveArguments) -> Result<(), Failure> {
    let stop = Stop::on_signals()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(|error| Failure::failed(format!("no thread for the server: {error}")))?;
    let context = Context::new();
    let server = serve(arguments.port, &context, &runtime)?;
    print(format_args!("ws://127.0.0.1:{}", server.port()))?;
    let shown = arguments.file.display();
    let followed = follow(&arguments.file, &context, &stop);
    runtime.block_on(server.stop().wait());
    match followed {
        Ok(true) => {
            note(format_args!("{shown} is whole: its session has ended"));
            Ok(())
        }
        Ok(false) => {
            let what = format!("{shown} is whole: the session that it holds has ended");
            Err(Failure::usage(what).remedy(
                "open the file itself in the viewer, or see mmt report; \
                 for a session that is to begin, remove the file or start mmt live after it",
            ))
        }
        Err(_) if stop.asked() => Ok(()),
        Err(error) => Err(Failure::usage(format!("{shown}: {error}"))),
    }
}

/// A server on loopback that can be read from only.
fn serve(
    port: u16,
    context: &Arc<Context>,
    runtime: &tokio::runtime::Runtime,
) -> Result<WebSocketServerHandle, Failure> {
    let server = context
        .websocket_server()
        .name("mmt")
        .bind("127.0.0.1", port)
        .message_backlog_size(BACKLOG)
        .tokio_runtime(runtime.handle());
    runtime.block_on(server.start()).map_err(|error| {
        let what = format!("cannot listen on 127.0.0.1:{port}: {error}");
        if matches!(error, FoxgloveError::Bind(_)) {
            Failure::new(Exit::Address, what).remedy("choose another one with --port")
        } else {
            Failure::failed(what)
        }
    })
}

/// Publishes each message of a record until it ends, and whether it grew meanwhile.
fn follow(path: &Path, context: &Arc<Context>, stop: &Stop) -> Result<bool, McapError> {
    let mut growing = Growing::open(path, stop)?;
    let mut channels = BTreeMap::new();
    for message in MessageReader::new(&mut growing) {
        publish(&message?, context, &mut channels);
    }
    Ok(growing.grew)
}

fn publish(
    message: &Message<'_>,
    context: &Arc<Context>,
    channels: &mut BTreeMap<u16, Arc<RawChannel>>,
) {
    let of = &message.channel;
    let channel = channels.get(&of.id).cloned().or_else(|| {
        let schema = of.schema.as_ref();
        let schema = schema.map(|s| Schema::new(&*s.name, &*s.encoding, s.data.to_vec()));
        let builder = context.channel_builder(&*of.topic).schema(schema);
        let built = builder.message_encoding(&*of.message_encoding).build_raw();
        let channel = built.ok()?;
        channels.insert(of.id, Arc::clone(&channel));
        Some(channel)
    });
    if let Some(channel) = channel {
        let at = PartialMetadata {
            log_time: Some(message.log_time),
        };
        channel.log_with_meta(&message.data, at);
    }
}

/// A file that another process writes: at its end it waits for more.
struct Growing<'a> {
    file: File,
    stop: &'a Stop,
    grew: bool,
}

impl<'a> Growing<'a> {
    /// Opens it, once it is there.
    fn open(path: &Path, stop: &'a Stop) -> io::Result<Self> {
        let mut waits = false;
        loop {
            match File::open(path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound && !stop.asked() => {
                    if !waits {
                        note(format_args!("waiting for {}", path.display()));
                    }
                    waits = true;
                    std::thread::sleep(PAUSE);
                }
                opened => {
                    return Ok(Self {
                        file: opened?,
                        stop,
                        grew: waits,
                    });
                }
            }
        }
    }
}

impl Read for Growing<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = self.file.read(buffer)?;
            if read > 0 || self.stop.asked() {
                return Ok(read);
            }
            if self.file.metadata()?.len() < self.file.stream_position()? {
                return Err(io::Error::other("it began anew: start mmt live again"));
            }
            self.grew = true;
            std::thread::sleep(PAUSE);
        }
    }
}
