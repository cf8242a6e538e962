//! When a driven robot has to be stopped.
//!
//! Each watch fires at the first step later than its time in `[safety]`, thus within that time and one tick.

use std::time::Duration;

use super::exchange::Inputs;
use super::imu_watch::ImuWatch;
use super::stage::StopReason;
use crate::link::{ImuReading, MotorEvent, MotorHealth, MotorState};
use crate::model::{Motor, SafetyLimits, State, TICK_S};

/// Longest time without a motor's voltage and errors, which are requested some 22 times a second.
const HEALTH_TIMEOUT: Duration = Duration::from_millis(300);
/// Time from arming until a motor's health surely answers a query that came after the order to switch on.
const ON_SETTLE: Duration = Duration::from_millis(100);
/// Newest round trips of a motor that are remembered: those of about a second.
const ROUND_TRIPS: usize = 24;

/// What was received of one motor, and when.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MotorWatch {
    pub(super) state: Option<MotorState>,
    pub(super) health: Option<MotorHealth>,
    /// When another controller was received last to command it, and the command.
    pub(super) commanded: Option<(Duration, u32)>,
    pub(super) round_trips: RoundTrips,
    /// When it was received again after a silence over which its turns cannot be known.
    turns_lost: Option<Duration>,
}

/// How long a motor's replies took, s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundTrips {
    newest_s: [f64; ROUND_TRIPS],
    count: usize,
}

/// Everything that is received of the robot.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    pub(super) motors: [MotorWatch; 2],
    pub(super) imu: ImuWatch,
    /// Whether a reading of this step was no number.
    not_finite: bool,
}

impl Watch {
    pub(super) fn new() -> Self {
        Self { motors: [MotorWatch::default(); 2], imu: ImuWatch::new(), not_finite: false }
    }

    /// Takes what was received; readings that are no numbers are only noted.
    pub(super) fn hear(&mut self, inputs: &Inputs<'_>, limits: &SafetyLimits) {
        self.not_finite = false;
        for event in inputs.motors {
            if is_finite(event) { self.hear_motor(event) } else { self.not_finite = true }
        }
        for reading in inputs.imu {
            if is_finite_reading(reading) { self.imu.hear(reading, limits) } else { self.not_finite = true }
        }
    }

    fn hear_motor(&mut self, event: &MotorEvent) {
        match *event {
            MotorEvent::State(motor, state) => {
                let last = &mut self.motors[motor as usize].state;
                if last.is_none_or(|last| last.time <= state.time) {
                    *last = Some(state);
                }
            }
            MotorEvent::Health(motor, health) => {
                let watch = &mut self.motors[motor as usize];
                watch.health = Some(health);
                health.round_trip.into_iter().for_each(|time| watch.round_trips.add(time));
            }
            MotorEvent::Commanded { motor, time, command, .. } => {
                self.motors[motor as usize].commanded = Some((time, command));
            }
            MotorEvent::TurnsLost { motor, time, .. } => self.motors[motor as usize].turns_lost = Some(time),
            MotorEvent::Switched { .. } => {}
        }
    }

    /// Newest reading of each motor.
    pub(super) fn states(&self) -> [Option<MotorState>; 2] {
        self.motors.map(|motor| motor.state)
    }

    /// Why the motors have to be off, from how they and the control loop are.
    pub(super) fn problem(
        &self,
        now: Duration,
        inputs: &Inputs<'_>,
        limits: &SafetyLimits,
        on_since: Duration,
    ) -> Option<StopReason> {
        if inputs.bus_down {
            return Some(StopReason::BusDown);
        }
        if self.not_finite {
            return Some(StopReason::NotFinite);
        }
        if inputs.late.as_secs_f64() > limits.late_s {
            return Some(StopReason::Late { late_s: inputs.late.as_secs_f64() });
        }
        let times = [now, now.saturating_sub(inputs.late)];
        let motors = Motor::BOTH.into_iter();
        let of_motors =
            motors.zip(&self.motors).find_map(|(motor, watch)| watch.problem(motor, times, limits, on_since));
        of_motors.or_else(|| self.imu.silent(times[1], limits))
    }
}

impl MotorWatch {
    /// Nobody can have been received while the control loop was late: silence counts up to `heard_by`, when it was to
    /// step.
    fn problem(
        &self,
        motor: Motor,
        [now, heard_by]: [Duration; 2],
        limits: &SafetyLimits,
        on_since: Duration,
    ) -> Option<StopReason> {
        let silent_s = self.state.map_or(f64::INFINITY, |state| age_s(heard_by, state.time));
        if silent_s > limits.motor_timeout_s {
            return Some(StopReason::MotorSilent { motor, silent_s });
        }
        if self.turns_lost.is_some_and(|time| time > on_since) {
            return Some(StopReason::TurnsLost { motor });
        }
        if let Some((_, command)) = self.commanded.filter(|(time, _)| *time > on_since) {
            return Some(StopReason::OtherController { motor, command });
        }
        let slow = |round_trip_s: &f64| *round_trip_s > limits.round_trip_s;
        if let Some(round_trip_s) = self.round_trips.upper_quartile_s().filter(slow) {
            return Some(StopReason::RoundTrip { motor, round_trip_s });
        }
        let temperature_c = self.temperature_c().unwrap_or(0.0);
        if temperature_c > limits.temperature_c {
            return Some(StopReason::MotorHot { motor, temperature_c });
        }
        let health = self.health?;
        if now > health.time.max(on_since) + HEALTH_TIMEOUT {
            return Some(StopReason::HealthSilent { motor, silent_s: age_s(now, health.time) });
        }
        if !health.errors.is_none() {
            return Some(StopReason::MotorError { motor, errors: health.errors });
        }
        if health.on == Some(false) && health.time > on_since + ON_SETTLE {
            return Some(StopReason::MotorOff { motor });
        }
        let voltage_v = health.voltage_v?;
        let allowed = limits.least_voltage_v..=limits.greatest_voltage_v;
        (!allowed.contains(&voltage_v)).then_some(StopReason::Voltage { voltage_v })
    }

    /// The newer one of both readings.
    pub(super) fn temperature_c(&self) -> Option<f64> {
        match (self.state, self.health) {
            (Some(state), Some(health)) if health.time > state.time => Some(health.temperature_c),
            (Some(state), _) => Some(state.temperature_c),
            (None, health) => health.map(|health| health.temperature_c),
        }
    }
}

impl RoundTrips {
    fn add(&mut self, round_trip: Duration) {
        self.newest_s[self.count % ROUND_TRIPS] = round_trip.as_secs_f64();
        self.count += 1;
    }

    /// The time that three quarters of the newest replies took at most, s; none before enough of them are there.
    pub(super) fn upper_quartile_s(&self) -> Option<f64> {
        let known = self
            .newest_s
            .get(..self.count.min(ROUND_TRIPS))
            .filter(|known| known.len() >= ROUND_TRIPS / 2)?;
        let mut sorted = [0.0; ROUND_TRIPS];
        let sorted = &mut sorted[..known.len()];
        sorted.copy_from_slice(known);
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.get(known.len() * 3 / 4).copied()
    }
}

/// Why a balancing robot has to be stopped, from where it is and how it moves.
pub(super) fn out_of_bounds(state: &State, limits: &SafetyLimits) -> Option<StopReason> {
    let State { x_m, x_dot_m_s, pitch_rad, .. } = *state;
    if pitch_rad.abs() > limits.tilt_rad {
        return Some(StopReason::Tilt { pitch_rad });
    }
    if x_dot_m_s.abs() > limits.speed_m_s {
        return Some(StopReason::Speed { x_dot_m_s });
    }
    (x_m.abs() > limits.distance_m).then_some(StopReason::Distance { x_m })
}

/// Why motors with their wheels in the air have to be stopped.
pub(super) fn too_fast(motor_speed_rad_s: [f64; 2], limits: &SafetyLimits) -> Option<StopReason> {
    Motor::BOTH.into_iter().zip(motor_speed_rad_s).find_map(|(motor, speed_rad_s)| {
        (speed_rad_s.abs() > limits.motor_speed_rad_s)
            .then_some(StopReason::MotorSpeed { motor, speed_rad_s })
    })
}

/// How late a step is after the one before, beyond the tick between them.
pub(super) fn lateness(now: Duration, last_step: Option<Duration>) -> Duration {
    let tick = Duration::from_secs_f64(TICK_S);
    last_step.map_or(Duration::ZERO, |last| now.saturating_sub(last).saturating_sub(tick))
}

pub(super) fn age_s(now: Duration, time: Duration) -> f64 {
    now.saturating_sub(time).as_secs_f64()
}

fn is_finite(event: &MotorEvent) -> bool {
    match event {
        MotorEvent::State(_, state) => {
            // Its temperature may not be known.
            [state.angle_rad, state.speed_rad_s, state.current_a].iter().all(|v| v.is_finite())
        }
        MotorEvent::Health(_, health) => {
            health.temperature_c.is_finite() && health.voltage_v.is_none_or(f64::is_finite)
        }
        MotorEvent::Switched { .. } | MotorEvent::TurnsLost { .. } => true,
        MotorEvent::Commanded { current_a, .. } => current_a.is_none_or(f64::is_finite),
    }
}

fn is_finite_reading(reading: &ImuReading) -> bool {
    reading.pitch_rad.is_finite()
        && reading.pitch_rate_rad_s.is_finite()
        && reading.tilt_rad.is_none_or(f64::is_finite)
        && reading.yaw_rate_rad_s.is_none_or(f64::is_finite)
}
