//! What the control loop hears and sends through: a wire with its threads, a robot in memory, or a recording.

use std::time::Duration;

use super::player::Player;
use super::types::SessionOrder;
use super::wire::{Inbox, Wire};
use crate::emulator::Emulator;
use crate::link::{Direction, Frame, StampedFrame};

/// What was received since the last tick.
#[derive(Default)]
pub(super) struct Heard {
    pub(super) inbox: Inbox,
}

/// The way to the robot.
pub(super) enum Link {
    Wire(Wire),
    /// A robot in memory, moved on by the control loop itself, and the frames that it has taken.
    Emulated(Box<Emulator>, Vec<StampedFrame>),
    /// A recording, which is played by a separate loop.
    Replay(Box<Player>),
}

impl Link {
    /// Takes what has come by `now`.
    pub(super) fn collect(&mut self, now: Duration, heard: &mut Heard) {
        match self {
            Self::Wire(wire) => wire.collect(&mut heard.inbox),
            Self::Replay(_) => {}
            Self::Emulated(robot, sent) => {
                robot.advance(now);
                let inbox = &mut heard.inbox;
                inbox.clear();
                inbox.sent.append(sent);
                inbox.frames.extend(std::iter::from_fn(|| robot.frames(now)));
                let bytes = robot.imu_bytes(now);
                if !bytes.is_empty() {
                    inbox.imu.push(now, &bytes);
                }
            }
        }
    }

    /// Hands a frame over for sending; `false` where it was not taken. [`Link::collect`] gives it once it was sent.
    pub(super) fn send(&mut self, now: Duration, frame: Frame) -> bool {
        match self {
            Self::Wire(wire) => wire.send(now, frame),
            Self::Emulated(robot, sent) => {
                robot.receive(now, &frame);
                let taken = !robot.bus_is_off();
                if taken {
                    sent.push(StampedFrame { time: now, direction: Direction::Sent, frame });
                }
                taken
            }
            Self::Replay(_) => false,
        }
    }

    /// For how long a frame has been waiting to be sent because a thread of this program comes late.
    pub(super) fn backlog(&mut self, now: Duration) -> Duration {
        if let Self::Wire(wire) = self { wire.backlog(now) } else { Duration::ZERO }
    }

    /// Sends what waits, and nothing from then on.
    pub(super) fn finish_sending(&mut self) {
        if let Self::Wire(wire) = self {
            wire.finish_sending();
        }
    }

    /// Tells the sending thread whether the motors may have torque.
    pub(super) fn set_hot(&self, hot: bool) {
        if let Self::Wire(wire) = self {
            wire.set_hot(hot);
        }
    }

    /// Frames that still wait are not sent any more.
    pub(super) fn forget_waiting(&self) {
        if let Self::Wire(wire) = self {
            wire.forget_waiting();
        }
    }

    /// Orders to the robot behind the link.
    pub(super) fn order(&mut self, order: &SessionOrder) {
        match (self, order) {
            (Self::Emulated(robot, _), SessionOrder::Push { force_n, duration_s }) => {
                robot.push(*force_n, *duration_s);
            }
            (Self::Replay(player), order) => player.order(order),
            // Nothing that a wire could do.
            _ => {}
        }
    }

    /// Why nothing can be received or sent just now.
    pub(super) fn problem(&self) -> Option<String> {
        match self {
            Self::Wire(wire) => wire.problem(),
            Self::Emulated(robot, _) => robot.bus_is_off().then(|| "bus off".to_owned()),
            Self::Replay(_) => None,
        }
    }

    /// What may be wrong where nothing is received.
    pub(super) fn hint(&self) -> Option<String> {
        if let Self::Wire(wire) = self { wire.imu_problem().or_else(|| wire.health().hint()) } else { None }
    }

    /// Frames that were dropped before they were read, errors, and times that the bus came back.
    pub(super) fn losses(&self) -> [u64; 3] {
        match self {
            Self::Wire(wire) => {
                let health = wire.health();
                [health.dropped(), health.errors(), health.reconnects()]
            }
            Self::Emulated(..) => [0; 3],
            Self::Replay(player) => [0, player.counts().damaged, 0],
        }
    }
}
