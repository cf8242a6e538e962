//! An emulated robot in real time, on ports that other programs open.

use std::time::Duration;

use super::clock::Clock;
use super::open::{BusPair, open_bus};
use super::open_error::OpenError;
use super::pacer::hurry;
use super::pty::Pty;
use super::session::Source;
use crate::emulator::{EmulatedAdapter, Emulator};
use crate::link::StampedFrame;

/// Bytes of the IMU that may wait to be read: more are those of a port that nobody has open.
const IMU_WAITING: u32 = 2048;
/// An adapter whose client takes nothing for so long has lost it.
const CLIENT_GONE: Duration = Duration::from_secs(2);

/// Which ports an emulated robot is to have.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EmulatorPorts {
    /// Its motors on this CAN interface.
    pub can: Option<String>,
    /// Its motors behind an SLCAN adapter on a pseudo-terminal.
    pub slcan: bool,
    /// Its IMU on a pseudo-terminal.
    pub imu: bool,
}

/// What has gone over the ports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmulatorCounts {
    /// Frames of the robot's bus: replies, and what others send.
    pub frames: u64,
    /// Of these, lines to the SLCAN port that were dropped because nobody took them.
    pub slcan_dropped: u64,
    /// Of these, frames that the CAN interface did not take.
    pub can_refused: u64,
    /// Times that a client of the SLCAN port went away without closing.
    pub clients_lost: u64,
}

/// The ports of an emulated robot.
pub struct EmulatorServer {
    clock: Clock,
    can: Option<BusPair>,
    slcan: Option<(Pty, EmulatedAdapter)>,
    imu: Option<Pty>,
    counts: EmulatorCounts,
    released: Duration,
}

impl EmulatorServer {
    /// Opens the ports.
    ///
    /// # Errors
    /// [`OpenError`]: what is missing, and the remedy.
    pub fn open(ports: &EmulatorPorts) -> Result<Self, OpenError> {
        let clock = Clock::start();
        let can = ports
            .can
            .as_ref()
            .map(|interface| open_bus(&Source::Can { interface: interface.clone() }, false, &clock));
        let pty = |name, wanted: bool| wanted.then(|| Pty::open(name)).transpose();
        Ok(Self {
            clock,
            can: can.transpose()?,
            slcan: pty("slcan", ports.slcan)?.map(|pty| (pty, EmulatedAdapter::default())),
            imu: pty("imu", ports.imu)?,
            counts: EmulatorCounts::default(),
            released: Duration::ZERO,
        })
    }

    /// Name of the port that speaks SLCAN.
    pub fn slcan_port(&self) -> Option<&str> {
        self.slcan.as_ref().map(|(pty, _)| pty.name())
    }

    /// Name of the port that the IMU is on.
    pub fn imu_port(&self) -> Option<&str> {
        self.imu.as_ref().map(Pty::name)
    }

    /// Runs the robot in real time until `ended` says so, which hears the time about once a millisecond.
    pub fn run(&mut self, robot: &mut Emulator, ended: &mut dyn FnMut(Duration) -> bool) -> EmulatorCounts {
        // Real motors answer however busy the computer is.
        hurry();
        let start = self.clock.now().saturating_sub(robot.time());
        let mut received = Vec::new();
        loop {
            let now = self.clock.now().saturating_sub(start);
            if ended(now) {
                return self.counts;
            }
            robot.advance(now);
            self.hear(now, robot, &received);
            self.tell(now, robot);
            let left = (start + robot.next_frame_at()).saturating_sub(self.clock.now());
            self.wait(left, &mut received);
        }
    }

    /// Takes in what has come.
    fn hear(&mut self, now: Duration, robot: &mut Emulator, slcan: &[u8]) {
        if let Some((pty, adapter)) = &mut self.slcan {
            let mut answers = Vec::new();
            adapter.receive(now, slcan, robot, &mut answers);
            pty.write(now, answers);
        }
        if let Some(BusPair { reader, .. }) = &mut self.can {
            // An interface that has gone is looked for by the bus itself.
            while let Ok(Some(heard)) = reader.receive(now) {
                robot.receive(now, &heard.frame);
            }
        }
        if let Some(pty) = &mut self.imu {
            let mut bytes = Vec::new();
            pty.read(Duration::ZERO, &mut bytes);
            robot.imu_receive(now, &bytes);
        }
    }

    /// Sends what is due.
    fn tell(&mut self, now: Duration, robot: &mut Emulator) {
        let mut lines = Vec::new();
        let mut count = 0;
        while let Some(frame) = robot.frames(now) {
            count += 1;
            self.send(now, &frame);
            if let Some((_, adapter)) = &self.slcan {
                adapter.hear(&frame, &mut lines);
            }
        }
        self.counts.frames += count;
        if let Some((pty, adapter)) = &mut self.slcan {
            adapter.report(now, robot.bus_is_off(), &mut lines);
            if !pty.write(now, lines) {
                self.counts.slcan_dropped += count;
            }
            if pty.stuck_for(now) > CLIENT_GONE {
                self.counts.clients_lost += 1;
                adapter.close();
                pty.forget_client();
            } else if !adapter.is_open() && now >= self.released + Duration::from_secs(1) {
                self.released = now;
                pty.release();
            }
        }
        if let Some(pty) = &mut self.imu {
            if pty.unread() > IMU_WAITING || pty.stuck_for(now) > CLIENT_GONE {
                pty.forget_client();
            }
            pty.write(now, robot.imu_bytes(now));
        }
    }

    fn send(&mut self, now: Duration, frame: &StampedFrame) {
        let writer = self.can.as_mut().and_then(|can| can.writer.as_mut());
        if writer.is_some_and(|writer| writer.send(now, &frame.frame).is_err()) {
            self.counts.can_refused += 1;
        }
    }

    /// Waits for bytes or frames, at most so long.
    fn wait(&mut self, left: Duration, received: &mut Vec<u8>) {
        received.clear();
        let waited = match (&mut self.slcan, &mut self.can) {
            (Some((pty, _)), _) => {
                pty.read(left, received);
                true
            }
            (None, Some(can)) => can.reader.wait(left).is_ok(),
            (None, None) => false,
        };
        if !waited {
            self.clock.sleep_until(self.clock.now() + left);
        }
    }
}
