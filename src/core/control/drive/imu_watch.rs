//! Whether the IMU can be believed.

use std::collections::VecDeque;
use std::time::Duration;

use super::stage::{ImuValue, StopReason};
use super::watch::age_s;
use crate::link::ImuReading;
use crate::model::{SafetyLimits, State};

/// Equal readings in a row from which on an IMU may be frozen: at a low rate two or three may be equal by chance.
const LEAST_EQUAL_READINGS: u32 = 5;
/// Time over which the IMU's rate is counted, and the most readings in it.
const RATE_WINDOW: Duration = Duration::from_secs(1);
const LEAST_RATE_SPAN_S: f64 = 0.8;
const MOST_READINGS: usize = 2048;
/// Time constants over which pitch and rate, and pitch and gravity are compared, s.
const PITCH_MEMORY_S: f64 = 1.0;
const GRAVITY_MEMORY_S: f64 = 1.0;
/// Fraction of `pitch_mismatch_rad` that the other value may turn by while one value stands still to the last bit.
const STUCK_FRACTION: f64 = 0.3;
/// Longest time between two readings over which the rate is integrated, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Readings in a row that have to disagree: a single one may be damaged.
const DISAGREEING: u32 = 2;

/// What was received of the IMU, and when.
///
/// It is frozen where pitch, pitch rate and the direction of acceleration stay the same to the last bit, at five
/// readings in a row and for longer than `imu_frozen_s`. Angles and rates of a quiet IMU do repeat (a JY901 takes its
/// rate as 0 at standstill); its accelerations, whose noise of about 1 mg is 2 steps, never all stand still. So without
/// acceleration it can only be told of a robot that moves: one that balances, not one with its wheels in the air.
///
/// Pitch and pitch rate are independent readings of one motion: the change of the pitch less the integrated rate,
/// forgotten with a time constant of 1 s, stays within noise, lag × rate and bias × 1 s. One that stands still to the
/// last bit while the other one moves is recognised earlier, because then noise and lag cannot be the reason.
#[derive(Clone, Debug)]
pub(super) struct ImuWatch {
    pub(super) last: Option<ImuReading>,
    /// First of the readings that are equal to the last one, and how many they are.
    equal: (Duration, u32),
    heard: VecDeque<Duration>,
    /// Change of the pitch less the integrated rate, rad, and for how many readings it has been too large.
    mismatch_rad: f64,
    disagreeing: u32,
    /// Of the pitch, and of the pitch rate.
    stuck: [Stuck; 2],
}

/// Equal readings of one value, and the rotation that the other value shows meanwhile.
#[derive(Clone, Copy, Debug, Default)]
struct Stuck {
    repeats: u32,
    rotation_rad: f64,
    /// Largest magnitude of the rotation: a body that is rocked comes back to where it was.
    largest_rad: f64,
}

impl ImuWatch {
    pub(super) fn new() -> Self {
        Self {
            last: None,
            equal: (Duration::ZERO, 0),
            heard: VecDeque::with_capacity(256),
            mismatch_rad: 0.0,
            disagreeing: 0,
            stuck: [Stuck::default(); 2],
        }
    }

    pub(super) fn hear(&mut self, reading: &ImuReading, limits: &SafetyLimits) {
        if self.last.is_some_and(|last| last.time > reading.time) {
            return;
        }
        let values = |r: &ImuReading| (r.pitch_rad, r.pitch_rate_rad_s, r.tilt_rad);
        match self.last {
            Some(last) if values(&last) == values(reading) => self.equal.1 += 1,
            Some(last) => {
                self.equal = (reading.time, 1);
                self.compare(&last, reading, limits);
            }
            None => self.equal = (reading.time, 1),
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

    fn compare(&mut self, last: &ImuReading, reading: &ImuReading, limits: &SafetyLimits) {
        let dt_s = age_s(reading.time, last.time);
        if dt_s > LONGEST_GAP_S {
            (self.mismatch_rad, self.disagreeing, self.stuck) = (0.0, 0, [Stuck::default(); 2]);
            return;
        }
        let change = near_zero(reading.pitch_rad - last.pitch_rad);
        let turned = f64::midpoint(last.pitch_rate_rad_s, reading.pitch_rate_rad_s) * dt_s;
        self.mismatch_rad = libm::exp(-dt_s / PITCH_MEMORY_S) * (self.mismatch_rad + change - turned);
        let disagrees = self.mismatch_rad.abs() > limits.pitch_mismatch_rad;
        self.disagreeing = if disagrees { self.disagreeing + 1 } else { 0 };
        let same = [reading.pitch_rad == last.pitch_rad, reading.pitch_rate_rad_s == last.pitch_rate_rad_s];
        for (stuck, same) in self.stuck.iter_mut().zip(same) {
            *stuck = if same { stuck.longer(change - turned) } else { Stuck::default() };
        }
    }

    /// Readings a second, over the last second; none before most of one has passed.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let (first, last) = self.heard.front().zip(self.heard.back())?;
        let span_s = (*last - *first).as_secs_f64();
        (span_s > LEAST_RATE_SPAN_S).then(|| (self.heard.len() - 1) as f64 / span_s)
    }

    pub(super) fn silent(&self, now: Duration, limits: &SafetyLimits) -> Option<StopReason> {
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

    /// Pitch and pitch rate that contradict each other.
    pub(super) fn inconsistent(&self, limits: &SafetyLimits) -> Option<StopReason> {
        let stuck =
            [ImuValue::Pitch, ImuValue::PitchRate].into_iter().zip(self.stuck).find_map(|(value, stuck)| {
                let too_far = stuck.largest_rad > STUCK_FRACTION * limits.pitch_mismatch_rad;
                (stuck.repeats + 1 >= LEAST_EQUAL_READINGS && too_far)
                    .then_some(StopReason::ImuStuck { value, turned_rad: stuck.largest_rad })
            });
        let mismatch_rad = self.mismatch_rad;
        stuck.or_else(|| {
            (self.disagreeing >= DISAGREEING).then_some(StopReason::PitchMismatch { mismatch_rad })
        })
    }
}

impl Stuck {
    /// Same with one more equal reading.
    fn longer(self, rotation_rad: f64) -> Self {
        let sum = self.rotation_rad + rotation_rad;
        Self { repeats: self.repeats + 1, rotation_rad: sum, largest_rad: self.largest_rad.max(sum.abs()) }
    }
}

/// Pitch against the direction of gravity, of a robot that balances.
///
/// An accelerating robot feels gravity tilted backward by ẍ/g. The mean of an acceleration, forgotten with a time
/// constant, is the speed less its own mean over that constant, so the encoders tell how much of the tilt it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct GravityWatch {
    gravity_m_s2: f64,
    height_m: f64,
    last: Option<Duration>,
    /// Means of tilt less pitch, rad, and of the speed of the body's centre of mass, m/s.
    apart_rad: f64,
    speed_m_s: f64,
    mismatch_rad: f64,
}

impl GravityWatch {
    pub(super) fn new(gravity_m_s2: f64, height_m: f64) -> Self {
        Self { gravity_m_s2, height_m, last: None, apart_rad: 0.0, speed_m_s: 0.0, mismatch_rad: 0.0 }
    }

    /// Begins anew with the next reading.
    pub(super) fn restart(&mut self) {
        *self = Self::new(self.gravity_m_s2, self.height_m);
    }

    /// Takes the newest reading of an IMU, and the state by the encoders.
    pub(super) fn hear(&mut self, imu: &ImuReading, state: &State) {
        let Some(tilt_rad) = imu.tilt_rad.filter(|_| self.last.is_none_or(|last| last < imu.time)) else {
            return;
        };
        let speed = state.x_dot_m_s + self.height_m * state.pitch_rate_rad_s;
        let Some(last) = self.last.replace(imu.time) else {
            self.speed_m_s = speed;
            return;
        };
        let fraction = 1.0 - libm::exp(-age_s(imu.time, last) / GRAVITY_MEMORY_S);
        self.apart_rad += fraction * (near_zero(tilt_rad - imu.pitch_rad) - self.apart_rad);
        self.speed_m_s += fraction * (speed - self.speed_m_s);
        let acceleration_m_s2 = (speed - self.speed_m_s) / GRAVITY_MEMORY_S;
        self.mismatch_rad = self.apart_rad + acceleration_m_s2 / self.gravity_m_s2;
    }

    pub(super) fn problem(&self, limits: &SafetyLimits) -> Option<StopReason> {
        let mismatch_rad = self.mismatch_rad;
        (mismatch_rad.abs() > limits.gravity_mismatch_rad)
            .then_some(StopReason::GravityMismatch { mismatch_rad })
    }
}

/// An angle within half a turn from 0.
pub(super) fn near_zero(angle_rad: f64) -> f64 {
    libm::remainder(angle_rad, std::f64::consts::TAU)
}
