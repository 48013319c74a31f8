//! The file of a record: MCAP with the profile `ros2`, chunks without compression, so that the same messages give the same
//! bytes.

use std::collections::BTreeMap;
use std::io::Write;

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, McapResult, WriteOptions, Writer};

use crate::record::cdr::CdrWriter;
use crate::record::messages::{Message, Stamp, schema};
use crate::record::ros::Standard;

/// Writes messages. The first error ends it: what comes later is not written.
pub struct RecordWriter {
    inner: Option<Writer<NoSeek<Box<dyn Write + Send>>>>,
    error: Option<String>,
    channels: BTreeMap<&'static str, Channel>,
    message: CdrWriter,
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    messages: u32,
}

impl RecordWriter {
    /// A record at the beginning of `file`.
    pub fn create(file: impl Write + Send + 'static) -> Self {
        let options = WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library("mmt")
            // a chunk is written when it is complete: a cut never leaves one with a wrong length
            .disable_seeking(true);
        let file: Box<dyn Write + Send> = Box::new(file);
        let mut writer = Self {
            inner: None,
            error: None,
            channels: BTreeMap::new(),
            message: CdrWriter::default(),
        };
        writer.inner = writer.judged(options.create(NoSeek::new(file)));
        writer
    }

    /// Writes a flat message.
    pub fn put<M: Message>(&mut self, topic: &'static str, stamp: Stamp, message: &M) {
        let describe = || (M::NAME, schema::<M>());
        self.write(topic, stamp, describe, |out| message.write(out));
    }

    /// Writes a standard message.
    pub fn put_standard(&mut self, topic: &'static str, stamp: Stamp, message: Standard<'_>) {
        let describe = || {
            let (name, schema) = message.definition();
            (name, schema.to_owned())
        };
        self.write(topic, stamp, describe, |out| message.write(out, stamp));
    }

    fn write(
        &mut self,
        topic: &'static str,
        stamp: Stamp,
        describe: impl FnOnce() -> (&'static str, String),
        body: impl FnOnce(&mut CdrWriter),
    ) {
        let Some(inner) = &mut self.inner else {
            return;
        };
        let channel = match self.channels.get_mut(topic) {
            Some(channel) => channel,
            None => match open(inner, topic, describe()) {
                Ok(id) => {
                    let new = Channel { id, messages: 0 };
                    self.channels.entry(topic).or_insert(new)
                }
                Err(error) => return self.fail(&error),
            },
        };
        channel.messages = channel.messages.wrapping_add(1);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages,
            log_time: stamp.0,
            publish_time: stamp.0,
        };
        body(self.message.begin());
        if let Err(error) = inner.write_to_known_channel(&header, self.message.message()) {
            self.fail(&error);
        }
    }

    /// Brings everything so far to the file.
    pub fn flush(&mut self) {
        let flushed = self.inner.as_mut().map(Writer::flush);
        if let Some(Err(error)) = flushed {
            self.fail(&error);
        }
    }

    /// Ends the record; returns why it is not whole.
    pub fn finish(mut self) -> Option<String> {
        self.flush();
        let finished = self.inner.as_mut().map(Writer::finish);
        if let Some(Err(error)) = finished {
            self.fail(&error);
        }
        self.error
    }

    fn judged<T>(&mut self, result: McapResult<T>) -> Option<T> {
        result.map_err(|error| self.fail(&error)).ok()
    }

    fn fail(&mut self, error: &McapError) {
        self.inner = None;
        let error = match error {
            McapError::Io(system) => system.to_string(),
            other => other.to_string(),
        };
        tracing::error!("the record ends here, the session goes on: {error}");
        self.error.get_or_insert(error);
    }
}

/// Makes a topic known.
fn open(
    inner: &mut Writer<NoSeek<Box<dyn Write + Send>>>,
    topic: &str,
    (name, schema): (&str, String),
) -> McapResult<u16> {
    let schema = inner.add_schema(name, "ros2msg", schema.as_bytes())?;
    // rosbag2 requires this key, empty for the default
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
    inner.add_channel(schema, topic, "cdr", &metadata)
}
