//! Channels of an MCAP file and the messages on them.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::time::Duration;

use ::mcap::records::MessageHeader;
use ::mcap::write::NoSeek;
use ::mcap::{McapError, WriteOptions};

use super::protobuf::Message;
use super::topics::{self, Schema};
use crate::link::jy901::Packet;
use crate::link::{Direction, FrameId, FrameKind, StampedFrame};

/// Writes an MCAP file: no compression, all messages as protocol buffers.
pub(super) struct McapWriter<W: Write> {
    out: ::mcap::Writer<NoSeek<W>>,
    channels: BTreeMap<String, Channel>,
    message: Message,
}

/// Beginning of the name that a file gives the library that wrote it.
const LIBRARY: &str = "flqr ";
/// Bytes up to that name: magic, opcode, length of the record, empty profile, length of the name.
const BEFORE_LIBRARY: usize = 8 + 1 + 8 + 4 + 4;

/// Returns whether a file that begins with these bytes was written by flqr.
pub fn is_opening(bytes: &[u8]) -> bool {
    let library = bytes.get(BEFORE_LIBRARY..BEFORE_LIBRARY + LIBRARY.len());
    bytes.starts_with(::mcap::MAGIC) && library == Some(LIBRARY.as_bytes())
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    messages: u32,
}

impl<W: Write> McapWriter<W> {
    pub(super) fn new(out: W) -> io::Result<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .disable_seeking(true)
            .library(format!("{LIBRARY}{}", env!("CARGO_PKG_VERSION")));
        let out = options.create(NoSeek::new(out)).map_err(io_error)?;
        Ok(Self { out, channels: BTreeMap::new(), message: Message::default() })
    }

    /// Numbers on a topic; the same fields each time.
    pub(super) fn numbers<N: AsRef<str>>(
        &mut self,
        time: Duration,
        topic: &str,
        fields: &[N],
        values: impl Iterator<Item = f64>,
    ) -> io::Result<()> {
        self.message.clear();
        for (field, value) in (1..).zip(values.take(fields.len())) {
            self.message.push_double(field, value);
        }
        self.write(time, topic, || {
            let fields: Vec<String> = fields.iter().map(|field| field.as_ref().to_owned()).collect();
            topics::numbers(&topics::type_name(topic), &fields)
        })
    }

    pub(super) fn frame(
        &mut self,
        time: Duration,
        interface: &str,
        stamped: &StampedFrame,
    ) -> io::Result<()> {
        let frame = &stamped.frame;
        self.message.clear();
        self.message.push_uint(1, u64::from(frame.id().raw()));
        let flags = [
            matches!(frame.id(), FrameId::Extended(_)),
            frame.kind() == FrameKind::Remote,
            frame.kind() == FrameKind::Error,
            stamped.direction == Direction::Sent,
        ];
        for (field, flag) in (2..).zip(flags) {
            self.message.push_uint(field, u64::from(flag));
        }
        self.message.push_uint(6, u64::from(frame.length()));
        self.message.push_bytes(7, frame.bytes());
        self.write(time, &format!("/can/{interface}"), topics::frame)
    }

    /// Returns the measurement of an IMU packet, if any.
    pub(super) fn packet(&mut self, time: Duration, packet: &Packet) -> io::Result<()> {
        let Some((topic, fields, values)) = topics::of_packet(packet) else { return Ok(()) };
        self.numbers(time, topic, fields, values.into_iter())
    }

    /// A line of text; its first word says how grave it is.
    pub(super) fn event(&mut self, time: Duration, text: &str) -> io::Result<()> {
        const LEVELS: [(&str, u64); 2] = [("stop:", 4), ("warning:", 3)];
        const INFO: u64 = 2;
        let level = LEVELS.iter().find(|(word, _)| text.starts_with(word)).map_or(INFO, |(_, level)| *level);
        let mut timestamp = Message::default();
        timestamp.push_uint(1, time.as_secs());
        timestamp.push_uint(2, u64::from(time.subsec_nanos()));
        self.message.clear();
        self.message.push_bytes(1, timestamp.bytes());
        self.message.push_uint(2, level);
        self.message.push_bytes(3, text.as_bytes());
        self.message.push_bytes(4, b"flqr");
        self.write(time, "/events", topics::log)
    }

    fn write(&mut self, time: Duration, topic: &str, schema: impl FnOnce() -> Schema) -> io::Result<()> {
        let channel = match self.channels.get_mut(topic) {
            Some(channel) => channel,
            None => {
                let Schema { name, descriptors } = schema();
                let schema = self.out.add_schema(&name, "protobuf", &descriptors).map_err(io_error)?;
                let id =
                    self.out.add_channel(schema, topic, "protobuf", &BTreeMap::new()).map_err(io_error)?;
                self.channels.entry(topic.to_owned()).or_insert(Channel { id, messages: 0 })
            }
        };
        let nanos = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages,
            log_time: nanos,
            publish_time: nanos,
        };
        channel.messages = channel.messages.wrapping_add(1);
        self.out.write_to_known_channel(&header, self.message.bytes()).map_err(io_error)
    }

    /// Ends the file; gives the number of messages on each topic.
    pub(super) fn finish(mut self) -> io::Result<BTreeMap<String, u32>> {
        self.out.finish().map_err(io_error)?;
        Ok(self.channels.into_iter().map(|(topic, channel)| (topic, channel.messages)).collect())
    }
}

/// The system's own error where it was one.
fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
