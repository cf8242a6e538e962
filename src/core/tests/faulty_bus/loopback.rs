//! Two ends of a bus in memory.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use flqr_core::link::{Bus, BusError, Direction, Frame, StampedFrame};

/// Most frames under way to one end.
const CAPACITY: usize = 4096;

/// One end of a bus in memory: what one end sends, the other receives at the same time.
#[derive(Debug)]
pub(crate) struct Loopback {
    outgoing: Line,
    incoming: Line,
}

type Line = Arc<Mutex<VecDeque<StampedFrame>>>;

impl Loopback {
    /// Both ends of a bus.
    pub(crate) fn pair() -> (Self, Self) {
        let (there, back) = (Line::default(), Line::default());
        (
            Self { outgoing: Arc::clone(&there), incoming: Arc::clone(&back) },
            Self { outgoing: back, incoming: there },
        )
    }
}

impl Bus for Loopback {
    fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError> {
        let mut line = locked(&self.outgoing);
        if line.len() == CAPACITY {
            return Err(BusError::Full { name: "loopback".to_owned() });
        }
        line.push_back(StampedFrame { time: now, direction: Direction::Received, frame: *frame });
        Ok(())
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        Ok(locked(&self.incoming).pop_front_if(|frame| frame.time <= now))
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        Ok(())
    }
}

fn locked(line: &Line) -> MutexGuard<'_, VecDeque<StampedFrame>> {
    // A queue is whole at any time, whoever may have panicked.
    line.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flqr_core::link::FrameId;

    fn frame(number: u16) -> Frame {
        Frame::full(FrameId::Standard(0x141), [0, 0, 0, 0, 0, 0, (number >> 8) as u8, number as u8])
    }

    #[test]
    fn what_one_end_sends_the_other_receives_in_order_and_not_before() {
        let (mut host, mut robot) = Loopback::pair();
        let at = Duration::from_millis;
        host.send(at(1), &frame(1)).unwrap();
        host.send(at(3), &frame(2)).unwrap();
        robot.send(at(2), &frame(3)).unwrap();
        assert_eq!(robot.receive(at(0)), Ok(None));
        let heard =
            |end: &mut Loopback, now| end.receive(now).unwrap().map(|heard| (heard.time, heard.frame));
        assert_eq!(heard(&mut robot, at(2)), Some((at(1), frame(1))));
        assert_eq!(heard(&mut robot, at(2)), None);
        assert_eq!(heard(&mut robot, at(4)), Some((at(3), frame(2))));
        assert_eq!(heard(&mut host, at(4)), Some((at(2), frame(3))));
        assert_eq!(heard(&mut host, at(4)), None);
    }

    #[test]
    fn a_line_that_nobody_reads_is_full_at_last() {
        let (mut host, mut robot) = Loopback::pair();
        let sent =
            (0..10_000).take_while(|&number| host.send(Duration::ZERO, &frame(number)).is_ok()).count();
        assert_eq!(sent, CAPACITY);
        assert!(robot.receive(Duration::ZERO).unwrap().is_some());
        assert_eq!(host.send(Duration::ZERO, &frame(0)), Ok(()));
    }
}
