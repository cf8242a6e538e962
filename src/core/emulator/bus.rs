//! The way to an emulated robot in the same program.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::Emulator;
use crate::link::{Bus, BusError, Frame, StampedFrame};

/// The bus of an emulated robot. Its IMU is read from the robot itself, which is shared.
#[derive(Clone, Debug)]
pub struct EmulatedBus {
    robot: Arc<Mutex<Emulator>>,
}

impl EmulatedBus {
    /// The bus of this robot.
    pub fn new(robot: Arc<Mutex<Emulator>>) -> Self {
        Self { robot }
    }

    /// The robot at a time, if its bus works.
    fn at(&self, now: Duration) -> Result<MutexGuard<'_, Emulator>, BusError> {
        let mut robot = self.robot.lock().unwrap_or_else(PoisonError::into_inner);
        robot.advance(now);
        if robot.bus_is_off() {
            let reason = "the bus is off: short circuit or different bit rates".to_owned();
            return Err(BusError::Failed { name: "emulated".to_owned(), reason });
        }
        Ok(robot)
    }
}

impl Bus for EmulatedBus {
    fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError> {
        self.at(now)?.receive(now, frame);
        Ok(())
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        Ok(self.at(now)?.frames(now))
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        Ok(())
    }
}
