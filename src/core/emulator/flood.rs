//! Frames that fill a bus.

use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::link::{Direction, Frame, FrameId, StampedFrame};

/// Random stream of a seed; those below are the simulated robot's.
const STREAM: u64 = 16;

/// Frames of other devices on the bus, as many a second as requested: data of 8 bytes, of which the first four
/// count the frames from 0 (little-endian) and the others are random; identifiers 0x200 to 0x23F, and in every
/// eighth 29 bits long.
#[derive(Clone, Debug)]
pub(super) struct Flood {
    rate_hz: u64,
    sent: u32,
    random: ChaCha8Rng,
}

impl Flood {
    pub(super) fn new(rate_hz: u32, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(STREAM);
        Self { rate_hz: u64::from(rate_hz), sent: 0, random }
    }

    /// The frames from this tick of 1 ms to the next, evenly spread.
    pub(super) fn frames(&mut self, tick: u64) -> impl Iterator<Item = StampedFrame> {
        let by = |tick: u64| tick * self.rate_hz / 1000;
        let count = (by(tick + 1) - by(tick)) as u32;
        (0..count).map(move |number| StampedFrame {
            time: Duration::from_millis(tick) + Duration::from_millis(1) * number / count,
            direction: Direction::Received,
            frame: self.next(),
        })
    }

    fn next(&mut self) -> Frame {
        let [a, b, c, d] = self.sent.to_le_bytes();
        let [e, f, g, h] = self.random.next_u32().to_le_bytes();
        let low = self.random.next_u32() % 64;
        let id = match self.sent % 8 {
            7 => FrameId::Extended(0x18DA_0000 + low),
            _ => FrameId::Standard(0x200 + low as u16),
        };
        self.sent = self.sent.wrapping_add(1);
        Frame::full(id, [a, b, c, d, e, f, g, h])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_once_at_the_asked_rate() {
        for rate_hz in [1, 7, 999, 8000, 8001] {
            let mut flood = Flood::new(rate_hz, 1);
            let sent: Vec<StampedFrame> =
                (0..3000).flat_map(|tick| flood.frames(tick).collect::<Vec<_>>()).collect();
            assert_eq!(sent.len() as u32, 3 * rate_hz);
            assert!(sent.windows(2).all(|pair| pair[0].time < pair[1].time));
            for (frame, number) in sent.iter().zip(0_u32..) {
                assert_eq!(frame.frame.bytes()[..4], number.to_le_bytes());
            }
        }
    }
}
