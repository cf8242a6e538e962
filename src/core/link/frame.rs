//! Classic CAN frames.

use std::time::Duration;

/// Identifier of a frame; the lower one wins the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FrameId {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

impl FrameId {
    /// A standard identifier; none above 0x7FF.
    pub fn standard(id: u16) -> Option<Self> {
        (id <= 0x7FF).then_some(Self::Standard(id))
    }

    /// An extended identifier; none above 0x1FFF_FFFF.
    pub fn extended(id: u32) -> Option<Self> {
        (id <= 0x1FFF_FFFF).then_some(Self::Extended(id))
    }

    /// The number alone.
    pub fn raw(self) -> u32 {
        match self {
            Self::Standard(id) => u32::from(id),
            Self::Extended(id) => id,
        }
    }
}

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameKind {
    /// Data.
    Data,
    /// A request for data; it has a length but no data.
    Remote,
    /// An error that the interface reports; its identifier is a set of error classes (Linux, `can/error.h`).
    Error,
}

/// A classic CAN frame with at most 8 bytes. Bytes beyond the length are 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Frame {
    id: FrameId,
    kind: FrameKind,
    length: u8,
    bytes: [u8; 8],
}

impl Frame {
    /// A data frame; none where there are more than 8 bytes.
    ///
    /// ```
    /// use flqr_core::link::{Frame, FrameId};
    ///
    /// let id = FrameId::standard(0x141).ok_or("not a standard identifier")?;
    /// let frame = Frame::data(id, &[0x9C, 0, 0, 0, 0, 0, 0, 0]).ok_or("too many bytes")?;
    /// assert_eq!((frame.id().raw(), frame.length()), (0x141, 8));
    /// assert_eq!(Frame::data(id, &[0; 9]), None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn data(id: FrameId, data: &[u8]) -> Option<Self> {
        Self::of(id, FrameKind::Data, data)
    }

    /// A remote frame; `None` if the length is above 8.
    pub fn remote(id: FrameId, length: u8) -> Option<Self> {
        (length <= 8).then_some(Self { id, kind: FrameKind::Remote, length, bytes: [0; 8] })
    }

    /// An error frame as SocketCAN delivers it: error classes, and 8 bytes that detail them.
    pub fn error(classes: u32, details: [u8; 8]) -> Option<Self> {
        Self::of(FrameId::extended(classes)?, FrameKind::Error, &details)
    }

    /// A data frame of 8 bytes.
    pub fn full(id: FrameId, bytes: [u8; 8]) -> Self {
        Self { id, kind: FrameKind::Data, length: 8, bytes }
    }

    fn of(id: FrameId, kind: FrameKind, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id, kind, length: data.len() as u8, bytes })
    }

    /// Identifier.
    pub fn id(&self) -> FrameId {
        self.id
    }

    /// What it is.
    pub fn kind(&self) -> FrameKind {
        self.kind
    }

    /// Length that it states, 0 to 8.
    pub fn length(&self) -> u8 {
        self.length
    }

    /// Its bytes; none in a remote frame.
    pub fn bytes(&self) -> &[u8] {
        if self.kind == FrameKind::Remote { &[] } else { &self.bytes[..usize::from(self.length)] }
    }
}

/// Which way a frame went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From the bus.
    Received,
    /// To the bus, by this program.
    Sent,
}

/// A frame with its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StampedFrame {
    /// When, on the clock of whoever stamped it: since the start of a session, or of 1970 in a file.
    pub time: Duration,
    /// Which way it went.
    pub direction: Direction,
    /// The frame.
    pub frame: Frame,
}
