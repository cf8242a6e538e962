//! When a driven robot has to be stopped.
//!
//! Each watch fires at the first step later than its time in `[safety]`, thus within that time and one tick.

use std::collections::VecDeque;
use std::time::Duration;

use super::exchange::Inputs;
use super::stage::StopReason;
use crate::link::{ImuReading, MotorEvent, MotorHealth, MotorState};
use crate::robot::{Motor, SafetyLimits, State, TICK_S};

/// Equal readings in a row from which on an IMU may be frozen: at a low rate two or three may be equal by chance.
const LEAST_EQUAL_READINGS: u32 = 5;
/// Time over which the IMU's rate is counted, and the most readings in it.
const RATE_WINDOW: Duration = Duration::from_secs(1);
const MOST_READINGS: usize = 2048;

/// What was heard of one motor, and when.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MotorWatch {
    pub(super) state: Option<MotorState>,
    pub(super) health: Option<MotorHealth>,
    /// When another controller was heard to command it.
    pub(super) commanded: Option<Duration>,
}

/// What was heard of the IMU, and when.
///
/// It is frozen where pitch, pitch rate and the direction of acceleration stay the same to the last bit, at five
/// readings in a row and for longer than `imu_frozen_s`. Angles and rates of a quiet IMU do repeat (a JY901 takes its
/// rate as 0 at rest); its accelerations, whose noise of about 1 mg is 2 steps, never all stand still. So without
/// acceleration it can only be told of a robot that moves: one that balances, not one with its wheels in the air.
#[derive(Clone, Debug)]
pub(super) struct ImuWatch {
    pub(super) last: Option<ImuReading>,
    /// First of the readings that are equal to the last one, and how many they are.
    equal: (Duration, u32),
    heard: VecDeque<Duration>,
}

/// Everything that is heard of the robot.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    pub(super) motors: [MotorWatch; 2],
    pub(super) imu: ImuWatch,
    /// Whether a reading of this step was no number.
    not_finite: bool,
}

impl Watch {
    pub(super) fn new() -> Self {
        let heard = VecDeque::with_capacity(256);
        Self {
            motors: [MotorWatch::default(); 2],
            imu: ImuWatch { last: None, equal: (Duration::ZERO, 0), heard },
            not_finite: false,
        }
    }

    /// Takes what was heard; readings that are no numbers are only noted.
    pub(super) fn hear(&mut self, inputs: &Inputs<'_>) {
        self.not_finite = false;
        for event in inputs.motors {
            if is_finite(event) { self.hear_motor(event) } else { self.not_finite = true }
        }
        for reading in inputs.imu {
            if is_finite_reading(reading) { self.imu.hear(reading) } else { self.not_finite = true }
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
            MotorEvent::Health(motor, health) => self.motors[motor as usize].health = Some(health),
            MotorEvent::Asked { motor, time, .. } => self.motors[motor as usize].commanded = Some(time),
            MotorEvent::Acknowledged { .. } | MotorEvent::TurnsLost { .. } => {}
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
        let motors = Motor::BOTH.into_iter();
        let of_motors =
            motors.zip(&self.motors).find_map(|(motor, watch)| watch.problem(motor, now, limits, on_since));
        of_motors.or_else(|| self.imu.silent(now, limits))
    }
}

impl MotorWatch {
    fn problem(
        &self,
        motor: Motor,
        now: Duration,
        limits: &SafetyLimits,
        on_since: Duration,
    ) -> Option<StopReason> {
        let silent_s = self.state.map_or(f64::INFINITY, |state| age_s(now, state.time));
        if silent_s > limits.motor_timeout_s {
            return Some(StopReason::MotorSilent { motor, silent_s });
        }
        let temperature_c = self.temperature_c().unwrap_or(0.0);
        if temperature_c > limits.temperature_c {
            return Some(StopReason::MotorHot { motor, temperature_c });
        }
        let health = self.health?;
        if !health.errors.is_none() {
            return Some(StopReason::MotorError { motor, errors: health.errors });
        }
        if health.on == Some(false) && health.time > on_since {
            return Some(StopReason::MotorOff { motor });
        }
        let voltage_v = health.voltage_v;
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

impl ImuWatch {
    fn hear(&mut self, reading: &ImuReading) {
        if self.last.is_some_and(|last| last.time > reading.time) {
            return;
        }
        let values = |r: &ImuReading| (r.pitch_rad, r.pitch_rate_rad_s, r.tilt_rad);
        match &self.last {
            Some(last) if values(last) == values(reading) => self.equal.1 += 1,
            _ => self.equal = (reading.time, 1),
        }
        self.last = Some(*reading);
        if self.heard.len() == MOST_READINGS {
            self.heard.pop_front();
        }
        self.heard.push_back(reading.time);
        while self.heard.front().is_some_and(|&first| first + RATE_WINDOW < reading.time) {
            self.heard.pop_front();
        }
    }

    /// Readings a second, over the last second; none before there are two.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let (first, last) = self.heard.front().zip(self.heard.back())?;
        let span_s = (*last - *first).as_secs_f64();
        (span_s > 0.0).then(|| (self.heard.len() - 1) as f64 / span_s)
    }

    fn silent(&self, now: Duration, limits: &SafetyLimits) -> Option<StopReason> {
        let silent_s = self.last.map_or(f64::INFINITY, |last| age_s(now, last.time));
        (silent_s > limits.imu_timeout_s).then_some(StopReason::ImuSilent { silent_s })
    }

    /// For how long the very same reading has come, if that is longer than allowed.
    pub(super) fn frozen(&self, now: Duration, limits: &SafetyLimits, balancing: bool) -> Option<StopReason> {
        let last = self.last?;
        let (since, count) = self.equal;
        let frozen_s = age_s(now, since);
        let can_tell = balancing || last.tilt_rad.is_some();
        let frozen = can_tell && count >= LEAST_EQUAL_READINGS && frozen_s > limits.imu_frozen_s;
        frozen.then_some(StopReason::ImuFrozen { frozen_s })
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

fn age_s(now: Duration, time: Duration) -> f64 {
    now.saturating_sub(time).as_secs_f64()
}

fn is_finite(event: &MotorEvent) -> bool {
    match event {
        MotorEvent::State(_, state) => {
            // Its temperature may not be known.
            [state.angle_rad, state.speed_rad_s, state.current_a].iter().all(|v| v.is_finite())
        }
        MotorEvent::Health(_, health) => health.temperature_c.is_finite() && health.voltage_v.is_finite(),
        MotorEvent::Acknowledged { .. } | MotorEvent::TurnsLost { .. } => true,
        MotorEvent::Asked { current_a, .. } => current_a.is_finite(),
    }
}

fn is_finite_reading(reading: &ImuReading) -> bool {
    reading.pitch_rad.is_finite()
        && reading.pitch_rate_rad_s.is_finite()
        && reading.tilt_rad.is_none_or(f64::is_finite)
}
