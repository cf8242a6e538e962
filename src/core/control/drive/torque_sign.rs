//! Whether each motor turns the way its torque is meant to turn it.
//!
//! Within 80 ms of arming one motor after the other gets a small torque forward for 10 ms and back for 10 ms, on top
//! of what the controller commands. Each encoder shows how far it went under both torques: qᵢ(t) = q₀ + q̇₀ t + ½ c
//! t² + a ∬ Tᵢ + b ∬ Tⱼ, where c is the gravity of those milliseconds, and a and b are compared with the model's
//! [`Response`]. Friction makes a smaller and never negative, so its sign is clear before its size is.

use super::regression::least_squares;
use super::stage::StopReason;
use super::torque_scale::{LATE_S, STALE_S};
use super::wheel_watch::Response;
use crate::model::{Motor, RobotModel, TICK_S};
use crate::record::Readings;

/// Time from arming to the first torque, s, by which the motors are on; and each pulse, s.
const START_S: f64 = 0.03;
const PULSE_S: f64 = 0.01;
/// Time after the last pulse until the verdict, s: the delay of the torque, and its reading.
const SETTLE_S: f64 = 0.006;
/// Way that a pulse aims at, rad, and the friction that it has to overcome, in multiples of the static one.
const WAY_RAD: f64 = 1.5e-3;
const FRICTION_FACTOR: f64 = 1.5;
/// Largest torque of a pulse, fraction of the limit.
const GREATEST_FRACTION: f64 = 0.3;
/// Fractions of the model's response beyond which a motor turns the wrong way, surely the right one, or the right one
/// late.
const WRONG: f64 = -0.15;
const RIGHT: f64 = 0.15;
const LATE: f64 = 0.15;
const DEVIATIONS: f64 = 3.0;
/// Tries on the ground, where a robot that is still held may not move; and time between two, s.
const TRIES: u32 = 3;
/// Delays beyond the model's that are tried, ticks.
const LATE_TICKS: usize = 6;
const MOST_TICKS: usize = 30;
const NEXT_S: f64 = 0.25;

/// The pulses, and what came of them.
#[derive(Clone, Debug)]
pub(super) struct TorqueSign {
    response: Response,
    pulse_nm: f64,
    start_s: f64,
    tries_left: u32,
    rows: Vec<Row>,
    motion: [Motion; 2],
    last_s: f64,
    /// Whether a tick or a reading of this try was late: torques that act later than they are sent look reversed.
    is_late: bool,
}

/// Time since the first pulse, s, motor angles, rad, and integral of each torque once and twice.
#[derive(Clone, Copy, Debug)]
struct Row {
    since_s: f64,
    angle_rad: [f64; 2],
    way: [f64; 2],
}

#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    speed: f64,
    way: f64,
}

impl TorqueSign {
    pub(super) fn new(robot: &RobotModel, balancing: bool, torque_limit_nm: f64) -> Self {
        let response = if balancing { Response::on_ground(robot) } else { Response::in_air(robot) };
        let static_nm = robot.friction.into_iter().flatten().fold(0.0_f64, |most, curve| {
            most.max(curve.parameters().static_nm).max(curve.parameters().coulomb_nm)
        });
        let pulse_nm = FRICTION_FACTOR * static_nm + WAY_RAD / (response.own * PULSE_S * PULSE_S);
        Self {
            response,
            pulse_nm: pulse_nm.min(GREATEST_FRACTION * torque_limit_nm),
            start_s: START_S,
            tries_left: if balancing { TRIES } else { 1 },
            rows: Vec::with_capacity(64),
            motion: [Motion::default(); 2],
            last_s: 0.0,
            is_late: false,
        }
    }

    /// What is added to both torques at a time since arming, N m.
    pub(super) fn nudge_nm(&self, time_s: f64) -> [f64; 2] {
        let since = time_s - self.start_s;
        if self.tries_left == 0 || since < 0.0 {
            return [0.0; 2];
        }
        // Half a tick of room, so that each pulse has as many ticks as the other.
        match ((since + 0.5 * TICK_S) / PULSE_S) as u32 {
            0 => [self.pulse_nm, 0.0],
            1 => [-self.pulse_nm, 0.0],
            2 => [0.0, self.pulse_nm],
            3 => [0.0, -self.pulse_nm],
            _ => [0.0; 2],
        }
    }

    /// Takes the readings of a tick, how old the motors' are, and the torques that acted since the last; a motor that
    /// turns the wrong way, once.
    pub(super) fn step(
        &mut self,
        time_s: f64,
        (readings, age_s): (&Readings, f64),
        acted_nm: [f64; 2],
    ) -> Option<StopReason> {
        let since_s = time_s - self.start_s;
        let passed_s = if self.rows.is_empty() { TICK_S } else { time_s - self.last_s };
        self.last_s = time_s;
        if self.tries_left == 0 || since_s < 0.0 {
            return None;
        }
        self.is_late |= passed_s > LATE_S || age_s > STALE_S;
        for (motion, torque_nm) in self.motion.iter_mut().zip(acted_nm) {
            let change = torque_nm * passed_s;
            motion.way += (motion.speed + 0.5 * change) * passed_s;
            motion.speed += change;
        }
        let way = self.motion.map(|motion| motion.way);
        self.rows.push(Row { since_s, angle_rad: readings.motor_angle_rad, way });
        if since_s < 4.0 * PULSE_S + SETTLE_S {
            return None;
        }
        let found = if std::mem::take(&mut self.is_late) { None } else { self.found() };
        self.rows.clear();
        self.motion = [Motion::default(); 2];
        self.start_s += NEXT_S;
        self.tries_left -= 1;
        let [left, right] = found?;
        let reversed = Motor::BOTH.into_iter().zip([left, right]).find(|(_, f)| f.own.is_below(WRONG));
        if let Some((motor, _)) = reversed {
            return Some(StopReason::TorqueReversed { motor });
        }
        // Friction of a robot that rolls may hide most of one motor's answer to its pulse.
        let mean = Factor {
            value: f64::midpoint(left.difference.value, right.difference.value),
            deviation: 0.5 * left.difference.deviation.hypot(right.difference.deviation),
        };
        if mean.is_below(WRONG) {
            return Some(StopReason::TorquesSwapped);
        }
        if [left, right].iter().all(|factors| factors.own.value - DEVIATIONS * factors.own.deviation > RIGHT)
        {
            self.tries_left = 0;
        }
        None
    }

    /// Responses of both motors; `None` if right ones to torques that act later than the model says fit better, because
    /// a pulse that is late looks like a reversed one.
    fn found(&self) -> Option<[Factors; 2]> {
        let residual = |factors: &[Factors; 2]| factors[0].residual + factors[1].residual;
        let is_right = |factors: &[Factors; 2]| {
            factors.iter().all(|factors| factors.own.value.min(factors.difference.value) > LATE)
        };
        let on_time = self.with_delay(0)?;
        let late = (LATE_TICKS..=MOST_TICKS).step_by(2).filter_map(|ticks| self.with_delay(ticks));
        let best = late.filter(is_right).map(|factors| residual(&factors)).fold(f64::INFINITY, f64::min);
        (best >= residual(&on_time)).then_some(on_time)
    }

    fn with_delay(&self, ticks: usize) -> Option<[Factors; 2]> {
        Some([self.factors(0, ticks)?, self.factors(1, ticks)?])
    }

    /// Response of a motor as fractions of the model's, to torques that act so many ticks later.
    fn factors(&self, motor: usize, delay_ticks: usize) -> Option<Factors> {
        let first = self.rows.first()?.angle_rad[motor];
        let rows = self.rows.iter().enumerate().map(|(index, row)| {
            let way = index.checked_sub(delay_ticks).map_or([0.0; 2], |earlier| self.rows[earlier].way);
            let regressors = [way[motor], way[1 - motor], 1.0, row.since_s, row.since_s * row.since_s];
            (regressors, row.angle_rad[motor] - first)
        });
        let fit = least_squares(rows)?;
        let Response { own, other } = self.response;
        let deviation = fit.deviation[0].hypot(fit.deviation[1]) / (own - other);
        Some(Factors {
            own: Factor { value: fit.value[0] / own, deviation: fit.deviation[0] / own },
            residual: fit.residual,
            difference: Factor { value: (fit.value[0] - fit.value[1]) / (own - other), deviation },
        })
    }
}

/// A motor's response to its torque, and that less the one to the other motor's torque.
#[derive(Clone, Copy, Debug)]
struct Factors {
    own: Factor,
    residual: f64,
    difference: Factor,
}

#[derive(Clone, Copy, Debug)]
struct Factor {
    value: f64,
    deviation: f64,
}

impl Factor {
    fn is_below(self, bound: f64) -> bool {
        self.value + DEVIATIONS * self.deviation < bound
    }
}
