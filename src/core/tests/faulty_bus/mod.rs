//! A bus with faults, to try what has to live with them.

#![allow(dead_code, reason = "each test uses a part of it")]

#[cfg(test)]
mod loopback;

use std::collections::VecDeque;
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use flqr_core::link::{Bus, BusError, Direction, Frame, FrameKind, StampedFrame};

/// Time for which a frame is held back so that later ones overtake it.
const HELD_BACK: Duration = Duration::from_millis(2);

/// How often a frame meets a fault, either way; probabilities from 0 to 1. Default: no faults.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FaultRates {
    /// It is lost.
    pub(crate) loss: f64,
    /// It comes twice.
    pub(crate) duplication: f64,
    /// It comes 2 ms later, and those behind it before it.
    pub(crate) reordering: f64,
    /// One bit of its data is flipped.
    pub(crate) bit_flip: f64,
    /// It begins a stall: it and all behind it, in its direction, come after `stall_for`, in order.
    pub(crate) stall: f64,
    /// Length of a stall.
    pub(crate) stall_for: Duration,
    /// Longest delay; each frame has its own, from none to this, but none overtakes another.
    pub(crate) delay: Duration,
}

/// What has been done to the frames of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FaultCounts {
    /// Frames that came to the faulty bus.
    pub(crate) frames: u64,
    /// Frames that it has handed on, duplicates included.
    pub(crate) handed_on: u64,
    /// Lost.
    pub(crate) lost: u64,
    /// Doubled.
    pub(crate) duplicated: u64,
    /// Held back for later ones to overtake.
    pub(crate) held_back: u64,
    /// With a bit flipped.
    pub(crate) flipped: u64,
    /// Stalls begun.
    pub(crate) stalls: u64,
}

/// A bus around another one that loses, doubles, holds back, damages and delays frames both ways. Same seed,
/// frames and times, same faults.
#[derive(Debug)]
pub(crate) struct Faulty<B> {
    bus: B,
    rates: FaultRates,
    sending: Lane,
    receiving: Lane,
}

impl<B: Bus> Faulty<B> {
    /// A bus with the given faults around another one.
    pub(crate) fn new(bus: B, rates: FaultRates, seed: u64) -> Self {
        Self { bus, rates, sending: Lane::new(seed, 0), receiving: Lane::new(seed, 1) }
    }

    /// Other faults from now on.
    pub(crate) fn set_rates(&mut self, rates: FaultRates) {
        self.rates = rates;
    }

    /// What has been done to the frames that were sent.
    pub(crate) fn sent(&self) -> FaultCounts {
        self.sending.counts
    }

    /// What has been done to the frames that were received.
    pub(crate) fn received(&self) -> FaultCounts {
        self.receiving.counts
    }

    /// The bus within.
    pub(crate) fn inner(&mut self) -> &mut B {
        &mut self.bus
    }

    /// Hands on what is due of the frames that were sent.
    fn flush(&mut self, now: Duration) -> Result<(), BusError> {
        while let Some(due) = self.sending.due(now) {
            self.bus.send(now, &due.frame)?;
        }
        Ok(())
    }
}

impl<B: Bus> Bus for Faulty<B> {
    fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError> {
        let sent = StampedFrame { time: now, direction: Direction::Sent, frame: *frame };
        self.sending.take(sent, &self.rates);
        self.flush(now)
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        self.flush(now)?;
        while let Some(heard) = self.bus.receive(now)? {
            self.receiving.take(heard, &self.rates);
        }
        Ok(self.receiving.due(now))
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), BusError> {
        self.bus.wait(timeout)
    }
}

/// Frames of one direction under way.
#[derive(Debug)]
struct Lane {
    random: ChaCha8Rng,
    /// In the order in which they are due.
    under_way: VecDeque<StampedFrame>,
    /// When the last frame that keeps the order is due.
    last_due: Duration,
    counts: FaultCounts,
}

impl Lane {
    fn new(seed: u64, stream: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self { random, under_way: VecDeque::new(), last_due: Duration::ZERO, counts: FaultCounts::default() }
    }

    fn take(&mut self, mut taken: StampedFrame, rates: &FaultRates) {
        self.counts.frames += 1;
        let [lost, doubled, held_back, flipped, stalled] =
            [rates.loss, rates.duplication, rates.reordering, rates.bit_flip, rates.stall]
                .map(|probability| self.happens(probability));
        let delay = rates.delay.mul_f64(self.share());
        if lost {
            self.counts.lost += 1;
            return;
        }
        if flipped {
            self.flip(&mut taken.frame);
        }
        let stall = if stalled { rates.stall_for } else { Duration::ZERO };
        self.counts.stalls += u64::from(stalled);
        taken.time = (taken.time + delay + stall).max(self.last_due);
        if held_back {
            self.counts.held_back += 1;
            taken.time += HELD_BACK;
        } else {
            self.last_due = taken.time;
        }
        self.counts.duplicated += u64::from(doubled);
        for _ in 0..=u8::from(doubled) {
            let place = self.under_way.partition_point(|other| other.time <= taken.time);
            self.under_way.insert(place, taken);
        }
    }

    fn due(&mut self, now: Duration) -> Option<StampedFrame> {
        let due = self.under_way.pop_front_if(|frame| frame.time <= now);
        self.counts.handed_on += u64::from(due.is_some());
        due
    }

    fn flip(&mut self, frame: &mut Frame) {
        let mut bytes = frame.bytes().to_vec();
        let place = self.random.next_u64() as usize;
        if bytes.is_empty() || frame.kind() != FrameKind::Data {
            return;
        }
        let byte = place / 8 % bytes.len();
        bytes[byte] ^= 1 << (place % 8);
        self.counts.flipped += 1;
        *frame = Frame::data(frame.id(), &bytes).expect("as many bytes as before");
    }

    fn happens(&mut self, probability: f64) -> bool {
        self.share() < probability
    }

    /// In [0, 1).
    fn share(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flqr_core::link::FrameId;
    use loopback::Loopback;

    const FRAMES: u64 = 20_000;

    fn at(tick: u64) -> Duration {
        Duration::from_millis(tick)
    }

    fn frame(number: u64) -> Frame {
        Frame::full(FrameId::Standard(0x141), number.to_be_bytes())
    }

    fn number(frame: &Frame) -> u64 {
        u64::from_be_bytes(frame.bytes().try_into().unwrap())
    }

    /// Sends a frame each millisecond both ways, and tells what the far and the near end received and when.
    fn run(rates: FaultRates, seed: u64) -> (Faulty<Loopback>, [Vec<(u64, u64)>; 2]) {
        let (near, mut far) = Loopback::pair();
        let mut faulty = Faulty::new(near, rates, seed);
        let mut heard = [Vec::new(), Vec::new()];
        for tick in 0..FRAMES + 1000 {
            let now = at(tick);
            if tick < FRAMES {
                faulty.send(now, &frame(tick)).unwrap();
                far.send(now, &frame(tick)).unwrap();
            }
            while let Some(back) = faulty.receive(now).unwrap() {
                assert!(back.time <= now);
                heard[1].push((number(&back.frame), tick));
            }
            while let Some(there) = far.receive(now).unwrap() {
                heard[0].push((number(&there.frame), tick));
            }
        }
        (faulty, heard)
    }

    #[test]
    fn without_faults_nothing_changes() {
        let (faulty, heard) = run(FaultRates::default(), 1);
        let all: Vec<_> = (0..FRAMES).map(|number| (number, number)).collect();
        assert_eq!(heard, [all.clone(), all]);
        let counts = FaultCounts { frames: FRAMES, handed_on: FRAMES, ..FaultCounts::default() };
        assert_eq!([faulty.sent(), faulty.received()], [counts; 2]);
    }

    #[test]
    fn each_fault_is_as_frequent_as_said_and_counted() {
        type Count = fn(&FaultCounts) -> u64;
        let none = FaultRates::default();
        let cases: [(FaultRates, Count); 4] = [
            (FaultRates { loss: 0.01, ..none }, |counts| counts.lost),
            (FaultRates { duplication: 0.01, ..none }, |counts| counts.duplicated),
            (FaultRates { reordering: 0.01, ..none }, |counts| counts.held_back),
            (FaultRates { bit_flip: 0.01, ..none }, |counts| counts.flipped),
        ];
        for (rates, count) in cases {
            let (faulty, heard) = run(rates, 1);
            for (counts, heard) in [faulty.sent(), faulty.received()].iter().zip(&heard) {
                // 200 expected, with a standard deviation of 14.
                assert!((150..250).contains(&count(counts)), "{counts:?}");
                assert_eq!(heard.len() as u64, counts.handed_on);
                assert_eq!(counts.handed_on, FRAMES - counts.lost + counts.duplicated);
                let backward = heard.windows(2).filter(|pair| pair[1].0 <= pair[0].0).count() as u64;
                match rates {
                    FaultRates { bit_flip: 0.01, .. } => {
                        let odd = heard.iter().filter(|(number, tick)| number != tick);
                        assert!(odd.clone().all(|(number, tick)| (number ^ tick).count_ones() == 1));
                        assert_eq!(odd.count() as u64, counts.flipped);
                    }
                    FaultRates { reordering: 0.01, .. } | FaultRates { duplication: 0.01, .. } => {
                        // One that is held back next to another one does not show twice.
                        assert!(backward <= count(counts) && backward > count(counts) * 9 / 10, "{backward}");
                    }
                    _ => assert_eq!(backward, 0),
                }
            }
        }
    }

    #[test]
    fn delays_and_stalls_keep_the_order_and_end() {
        let rates = FaultRates {
            delay: Duration::from_millis(5),
            stall: 0.001,
            stall_for: Duration::from_millis(50),
            ..FaultRates::default()
        };
        let (faulty, heard) = run(rates, 1);
        for (counts, heard) in [faulty.sent(), faulty.received()].iter().zip(&heard) {
            assert!(heard.iter().map(|(number, _)| *number).eq(0..FRAMES));
            let latest = heard.iter().map(|(number, tick)| tick - number).max().unwrap();
            // Two stalls in a row are possible, three are not likely.
            assert!((50..=160).contains(&latest) && counts.stalls > 5, "{latest} ms, {counts:?}");
        }
    }

    #[test]
    fn same_seed_same_faults() {
        let rates = FaultRates {
            loss: 0.1,
            duplication: 0.1,
            reordering: 0.1,
            bit_flip: 0.1,
            ..FaultRates::default()
        };
        let heard = |seed| run(rates, seed).1;
        let first = heard(1);
        assert_eq!(first, heard(1));
        assert_ne!(first, heard(2));
        assert_ne!(first[0], first[1]);
    }
}
