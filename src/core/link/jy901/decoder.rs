//! Packets out of a stream of bytes.

use std::collections::VecDeque;
use std::time::Duration;

use super::{PACKET_BYTES, Packet};

/// Finds packets in a stream. Whatever is not an intact packet is counted: of the bytes between two intact
/// packets, each eleven are one corrupted packet, and the rest is stray; so 11 × (intact + corrupted) + stray,
/// and at most 10 bytes that wait for more, are all bytes that came.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    window: [u8; PACKET_BYTES],
    filled: usize,
    /// Bytes given up since the last intact packet.
    given_up: usize,
    ready: VecDeque<(Duration, Packet)>,
    intact: u64,
    corrupted: u64,
    stray: u64,
}

impl Decoder {
    /// A decoder that has received nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes in bytes that have come by `now`.
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use flqr_core::link::jy901::{Decoder, Packet};
    ///
    /// let packet = Packet::angle([0.1, 0.0, 0.0], 0);
    /// let mut decoder = Decoder::new();
    /// decoder.push(Duration::ZERO, &[0xFF, 0x00]); // bytes outside of any packet
    /// decoder.push(Duration::ZERO, &packet.encode());
    /// assert_eq!(decoder.next(), Some((Duration::ZERO, packet)));
    /// ```
    pub fn push(&mut self, now: Duration, bytes: &[u8]) {
        for byte in bytes {
            self.window[self.filled] = *byte;
            self.filled += 1;
            self.settle(now);
        }
    }

    /// Takes a packet out of the window or gives bytes up, until the window may begin a packet and has room.
    fn settle(&mut self, now: Duration) {
        if self.filled == PACKET_BYTES
            && let Some(packet) = Packet::decode(&self.window)
        {
            self.ready.push_back((now, packet));
            self.intact += 1;
            self.filled = 0;
            self.given_up = 0;
            return;
        }
        while self.filled == PACKET_BYTES
            || (self.filled > 0 && !Packet::may_begin(&self.window[..self.filled]))
        {
            self.give_up_a_byte();
        }
    }

    fn give_up_a_byte(&mut self) {
        self.window.copy_within(1..self.filled, 0);
        self.filled -= 1;
        self.given_up += 1;
        self.stray += 1;
        if self.given_up == PACKET_BYTES {
            self.given_up = 0;
            self.stray -= PACKET_BYTES as u64;
            self.corrupted += 1;
        }
    }

    /// The next intact packet and when its last byte was received.
    #[expect(clippy::should_implement_trait, reason = "none now may be one later: this is no iterator")]
    pub fn next(&mut self) -> Option<(Duration, Packet)> {
        self.ready.pop_front()
    }

    /// Packets that came intact.
    pub fn intact(&self) -> u64 {
        self.intact
    }

    /// Packets that came corrupted.
    pub fn corrupted(&self) -> u64 {
        self.corrupted
    }

    /// Bytes that belonged to no packet.
    pub fn stray(&self) -> u64 {
        self.stray
    }
}
