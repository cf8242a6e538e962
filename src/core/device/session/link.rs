//! What the control loop hears and sends through: a wire with its threads, a robot in memory, or a recording.

use std::time::Duration;

use super::player::Player;
use super::types::SessionOrder;
use super::wire::{Inbox, Wire};
use crate::link::{Emulator, Frame};

/// What was heard since the last tick.
#[derive(Default)]
pub(super) struct Heard {
    pub(super) inbox: Inbox,
}

/// The way to the robot.
pub(super) enum Link {
    Wire(Wire),
    /// A robot in memory, moved on by the control loop itself.
    Emulated(Box<Emulator>),
    /// A recording, which is played by a loop of its own.
    Replay(Box<Player>),
}

impl Link {
    /// Takes what has come by `now`.
    pub(super) fn collect(&mut self, now: Duration, heard: &mut Heard) {
        match self {
            Self::Wire(wire) => wire.collect(&mut heard.inbox),
            Self::Replay(_) => {}
            Self::Emulated(robot) => {
                robot.advance(now);
                heard.inbox.frames.clear();
                heard.inbox.frames.extend(std::iter::from_fn(|| robot.frames(now)));
                heard.inbox.imu.clear();
                let bytes = robot.imu_bytes(now);
                if !bytes.is_empty() {
                    heard.inbox.imu.push((now, bytes));
                }
            }
        }
    }

    /// Sends a frame; `false` where it was not taken.
    pub(super) fn send(&mut self, now: Duration, frame: Frame) -> bool {
        match self {
            Self::Wire(wire) => wire.send(frame),
            Self::Emulated(robot) => {
                robot.receive(now, &frame);
                !robot.bus_is_off()
            }
            Self::Replay(_) => false,
        }
    }

    /// The motors have torque from now on, or not any more; `false` where that could not be told.
    pub(super) fn note_driving(&self, driving: bool) -> bool {
        if let Self::Wire(wire) = self { wire.note_driving(driving) } else { true }
    }

    /// Orders to the robot behind the link.
    pub(super) fn order(&mut self, order: &SessionOrder) {
        match (self, order) {
            (Self::Emulated(robot), SessionOrder::Push { force_n, duration_s }) => {
                robot.push(*force_n, *duration_s);
            }
            (Self::Replay(player), order) => player.order(order),
            // Nothing that a wire could do.
            _ => {}
        }
    }

    /// Why nothing can be heard or sent just now.
    pub(super) fn problem(&self) -> Option<String> {
        match self {
            Self::Wire(wire) => wire.problem(),
            Self::Emulated(robot) => robot.bus_is_off().then(|| "bus off".to_owned()),
            Self::Replay(_) => None,
        }
    }

    /// What may be wrong where nothing is heard.
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
            Self::Emulated(_) => [0; 3],
            Self::Replay(player) => [0, player.counts().damaged, 0],
        }
    }
}
