//! Counts, rates and newest readings for the status.

use std::time::Duration;

use super::rate::{Peak, Rate};
use super::types::{Counters, ImuStatus, MotorStatus};
use crate::device::Tick;
use crate::link::{Direction, FrameKind, ImuReading, MotorEvent, StampedFrame, bus_load};
use crate::record::Sample;
use crate::record::recording::Row;

/// Everything that is counted.
#[derive(Default)]
pub(super) struct LinkCounters {
    /// Bit rate of the bus, bit/s, where it is known.
    bit_rate: Option<u32>,
    received: Rate,
    bits: Rate,
    lateness: Peak,
    counters: Counters,
    motors: [MotorCounters; 2],
    imu: ImuCounters,
    /// When the robot was last received through the source that was named.
    heard: Option<Duration>,
}

#[derive(Default)]
struct MotorCounters {
    status: MotorStatus,
    rate: Rate,
    heard: Option<Duration>,
    asked: u64,
    answered: u64,
}

#[derive(Default)]
struct ImuCounters {
    status: ImuStatus,
    rate: Rate,
    heard: Option<Duration>,
}

impl LinkCounters {
    pub(super) fn new(bit_rate: Option<u32>) -> Self {
        Self { bit_rate, ..Self::default() }
    }

    /// A frame that was received or sent.
    pub(super) fn frame(&mut self, stamped: &StampedFrame) {
        let StampedFrame { time, direction, frame } = stamped;
        if frame.kind() == FrameKind::Error {
            return;
        }
        self.bits.add(*time, f64::from(bus_load::bits(frame)));
        match direction {
            Direction::Received => {
                self.counters.received += 1;
                self.received.add(*time, 1.0);
            }
            Direction::Sent => self.counters.sent += 1,
        }
    }

    /// A torque that was required of both motors, each of which answers.
    pub(super) fn asked(&mut self) {
        self.motors.iter_mut().for_each(|motor| motor.asked += 1);
    }

    pub(super) fn motor(&mut self, event: &MotorEvent) {
        match event {
            MotorEvent::State(motor, state) => {
                let counted = &mut self.motors[*motor as usize];
                counted.heard = Some(state.time);
                self.heard = self.heard.max(Some(state.time));
                counted.rate.add(state.time, 1.0);
                counted.answered += 1;
                // Either may not be known of a robot that a DBC file describes.
                let known = |value: f64| Some(value).filter(|value| value.is_finite());
                counted.status.temperature_c = known(state.temperature_c);
                counted.status.current_a = known(state.current_a);
            }
            MotorEvent::Health(motor, health) => {
                let counted = &mut self.motors[*motor as usize];
                counted.status.temperature_c = Some(health.temperature_c);
                counted.status.health = Some(*health);
                self.heard = self.heard.max(Some(health.time));
            }
            MotorEvent::Switched { .. } | MotorEvent::Commanded { .. } | MotorEvent::TurnsLost { .. } => {}
        }
    }

    /// A reading of the IMU, and whether it came from the source that was named.
    pub(super) fn imu(&mut self, reading: &ImuReading, from_source: bool) {
        if from_source {
            self.heard = self.heard.max(Some(reading.time));
        }
        self.imu.heard = Some(reading.time);
        self.imu.rate.add(reading.time, 1.0);
        if reading.temperature_c.is_some() {
            self.imu.status.temperature_c = reading.temperature_c;
        }
    }

    /// A tick of the control loop.
    pub(super) fn tick(&mut self, tick: &Tick) {
        // The ticks that it covers are left out; it is itself the one that came late.
        self.counters.late += u64::from(tick.skipped > 0);
    }

    /// By how much a thread of this program comes late just now.
    pub(super) fn lateness(&mut self, now: Duration, late: Duration) {
        self.lateness.add(now, late);
    }

    /// The greatest lateness of the last second.
    pub(super) fn greatest_lateness(&mut self, now: Duration) -> Duration {
        self.lateness.of_last_second(now)
    }

    pub(super) fn lost(&mut self, count: u64) {
        self.counters.lost += count;
    }

    /// Counts that the bus keeps.
    pub(super) fn bus(&mut self, dropped: u64, errors: u64, reconnects: u64) {
        self.counters.dropped = dropped;
        self.counters.errors = errors;
        self.counters.reconnects = reconnects;
    }

    /// Counts that the IMU's decoder keeps.
    pub(super) fn imu_packets(&mut self, intact: u64, corrupted: u64, stray_bytes: u64) {
        let status = &mut self.imu.status;
        (status.packets, status.corrupted, status.stray_bytes) = (intact, corrupted, stray_bytes);
    }

    /// A row of a recording that is replayed: what its frames do not say where there are none.
    pub(super) fn replayed(&mut self, row: &Row) {
        for (motor, temperature_c) in self.motors.iter_mut().zip(row.motor_temperature_c) {
            motor.status.temperature_c = temperature_c.or(motor.status.temperature_c);
        }
    }

    /// A row of the recording.
    pub(super) fn row(&self, sample: &Sample) -> Row {
        let [left, right] = &self.motors;
        let voltage = |motor: &MotorCounters| motor.status.health.and_then(|health| health.voltage_v);
        let round_trip = |motor: &MotorCounters| motor.status.health?.round_trip;
        Row {
            sample: *sample,
            motor_temperature_c: [left.status.temperature_c, right.status.temperature_c],
            bus_voltage_v: voltage(left).or_else(|| voltage(right)),
            round_trip_s: round_trip(left).max(round_trip(right)).map(|time| time.as_secs_f64()),
        }
    }

    /// When the robot was last received through the source that was named.
    pub(super) fn heard(&self) -> Option<Duration> {
        self.heard
    }

    pub(super) fn counters(&mut self, now: Duration, unrecorded: u64) -> Counters {
        self.counters.received_hz = self.received.per_second(now);
        let bits = self.bits.per_second(now);
        self.counters.bus_load = self.bit_rate.map(|rate| bits / f64::from(rate));
        Counters { lost: self.counters.lost + unrecorded, ..self.counters }
    }

    pub(super) fn motor_status(&mut self, now: Duration) -> [MotorStatus; 2] {
        self.motors.each_mut().map(|counted| MotorStatus {
            rate_hz: counted.rate.per_second(now),
            age: counted.heard.map(|heard| now.saturating_sub(heard)),
            // The answers to the newest two may still be under way.
            missed: counted.asked.saturating_sub(counted.answered + 2),
            ..counted.status
        })
    }

    pub(super) fn imu_status(&mut self, now: Duration) -> ImuStatus {
        ImuStatus {
            rate_hz: self.imu.rate.per_second(now),
            age: self.imu.heard.map(|heard| now.saturating_sub(heard)),
            ..self.imu.status
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_is_late_from_a_period_on_however_many_it_covers() {
        let mut counted = LinkCounters::new(None);
        for (late_us, skipped) in [(0, 0), (999, 0), (1000, 1), (50_500, 50), (10, 0)] {
            let (due, late) = (Duration::from_millis(1), Duration::from_micros(late_us));
            counted.tick(&Tick { due, late, skipped });
        }
        assert_eq!(counted.counters(Duration::ZERO, 0).late, 2);
    }

    #[test]
    fn losses_of_all_stages_are_told_apart() {
        let mut counted = LinkCounters::new(None);
        counted.lost(3);
        counted.bus(7, 1, 2);
        counted.bus(9, 1, 2);
        let Counters { dropped, lost, errors, reconnects, .. } = counted.counters(Duration::ZERO, 4);
        assert_eq!([dropped, lost, errors, reconnects], [9, 7, 1, 2]);
    }
}
