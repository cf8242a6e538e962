//! Whether the motors do what they are asked for.
//!
//! Sources disagree on the steps of the current command by a factor of 1.986, and the two windings' torque constants
//! differ by 2.53. So the torques that were asked for are compared with the motion of the encoders, which resolve it
//! better than any other sensor: with both motors turning one way,
//! d²q̄/dt² = f b ΣT + a θ + v q̄̇ + const, where b is the model's response to a torque and f the factor that is
//! looked for. Gravity on the pitch (a), friction that changes with speed (v) and its level (const) are left free, so
//! that an unknown payload or friction does not enter; b itself hardly changes with the load, because mass and inertia
//! grow together in numerator and denominator.
//!
//! All signals go through the same second-order low-pass at 40 rad/s, behind which the second derivative of a
//! quantised encoder is usable, and a high-pass at 3 rad/s, which takes the constant away. Where a motor stops or
//! turns over, friction jumps: all filters begin anew.

use nalgebra::{Matrix3, Vector3};

use crate::control::Readings;
use crate::model_file::RobotModel;
use crate::robot::TICK_S;

/// Corner of the low-pass and of the high-pass, rad/s.
const LOW_RAD_S: f64 = 40.0;
const HIGH_RAD_S: f64 = 3.0;
/// Slowest speed at which a motor counts as turning, rad/s: beyond the noise of its reading.
const TURNING_RAD_S: f64 = 0.1;
/// Ticks that the filters take to forget how they began: 3 / 40 rad/s.
const BEGINNING_TICKS: u32 = 75;
/// Ticks between two samples, and samples that tell as much as one: the low-pass ties neighbours together.
const SAMPLE_TICKS: u32 = 5;
const TIED_SAMPLES: f64 = 10.0;
/// Share of the past that a sample leaves: forgotten within 3 s of turning.
const KEPT: f64 = 1.0 - 0.005 / 3.0;
/// Least independent samples before anything is said: a quarter of a second of turning.
const LEAST_SAMPLES: f64 = 5.0;
/// Factors that are let pass, and deviations that the estimate has to lie outside.
const ALLOWED: std::ops::RangeInclusive<f64> = 0.7..=1.45;
const DEVIATIONS: f64 = 5.0;

/// A signal behind both filters.
#[derive(Clone, Copy, Debug, Default)]
struct Filtered {
    first: f64,
    second: f64,
    mean: f64,
}

impl Filtered {
    const LOW: f64 = LOW_RAD_S * TICK_S;
    const HIGH: f64 = HIGH_RAD_S * TICK_S;

    fn begin(value: f64) -> Self {
        Self { first: value, second: value, mean: value }
    }

    fn next(&mut self, value: f64) -> f64 {
        self.first += Self::LOW * (value - self.first);
        self.second += Self::LOW * (self.first - self.second);
        self.high(self.second)
    }

    fn high(&mut self, value: f64) -> f64 {
        self.mean += Self::HIGH * (value - self.mean);
        value - self.mean
    }
}

/// The regression.
#[derive(Clone, Debug)]
pub(super) struct TorqueScale {
    /// Acceleration of both motors under 1 N m in all, rad/s².
    response: f64,
    ticks: u32,
    angle: Filtered,
    signals: [Filtered; 3],
    information: Matrix3<f64>,
    moment: Vector3<f64>,
    square: f64,
    samples: f64,
}

impl TorqueScale {
    pub(super) fn new(robot: &RobotModel, balancing: bool) -> Self {
        let response = if balancing {
            let b = robot.parameters.linear_model().b;
            b[(1, 0)] / robot.parameters.wheel_radius_m - b[(3, 0)]
        } else {
            0.5 / robot.parameters.wheel_inertia_kg_m2
        };
        Self {
            response,
            ticks: 0,
            angle: Filtered::default(),
            signals: [Filtered::default(); 3],
            information: Matrix3::zeros(),
            moment: Vector3::zeros(),
            square: 0.0,
            samples: 0.0,
        }
    }

    /// Takes the readings of a tick and the torques that acted then; a factor that is surely wrong.
    pub(super) fn step(&mut self, readings: &Readings, torque_nm: [f64; 2]) -> Option<f64> {
        let [left, right] = readings.motor_speed_rad_s;
        let turning = left * right > 0.0 && left.abs().min(right.abs()) > TURNING_RAD_S;
        if !turning {
            self.ticks = 0;
            return None;
        }
        let angle = f64::midpoint(readings.motor_angle_rad[0], readings.motor_angle_rad[1]);
        let speed = f64::midpoint(left, right);
        let drive = self.response * (torque_nm[0] + torque_nm[1]);
        let values = [drive, readings.pitch_rad, speed];
        if self.ticks == 0 {
            // As if it had always turned at this speed.
            let behind = speed / LOW_RAD_S;
            self.angle = Filtered { first: angle - behind, second: angle - 2.0 * behind, mean: 0.0 };
            self.signals = values.map(Filtered::begin);
        }
        self.ticks += 1;
        let regressors = self.filtered(values);
        let acceleration = self.acceleration(angle);
        if self.ticks < BEGINNING_TICKS || !self.ticks.is_multiple_of(SAMPLE_TICKS) {
            return None;
        }
        self.learn(&regressors, acceleration);
        self.wrong_factor()
    }

    fn filtered(&mut self, values: [f64; 3]) -> Vector3<f64> {
        Vector3::from_fn(|row, _| self.signals[row].next(values[row]))
    }

    fn acceleration(&mut self, angle: f64) -> f64 {
        let filter = &mut self.angle;
        filter.first += Filtered::LOW * (angle - filter.first);
        filter.second += Filtered::LOW * (filter.first - filter.second);
        let second_derivative = LOW_RAD_S * LOW_RAD_S * (angle - 2.0 * filter.first + filter.second);
        filter.high(second_derivative)
    }

    fn learn(&mut self, regressors: &Vector3<f64>, acceleration: f64) {
        self.information = KEPT * self.information + regressors * regressors.transpose();
        self.moment = KEPT * self.moment + regressors * acceleration;
        self.square = KEPT * self.square + acceleration * acceleration;
        self.samples = KEPT * self.samples + 1.0;
    }

    fn wrong_factor(&self) -> Option<f64> {
        let independent = self.samples / TIED_SAMPLES;
        let (factor, deviation) = self.estimate()?;
        let margin = DEVIATIONS * deviation;
        let outside = factor + margin < *ALLOWED.start() || factor - margin > *ALLOWED.end();
        (independent >= LEAST_SAMPLES && outside).then_some(factor)
    }

    /// The factor and its standard deviation.
    pub(super) fn estimate(&self) -> Option<(f64, f64)> {
        // A signal that has not moved, such as the pitch of a robot with its wheels in the air, takes no part.
        let floor = Matrix3::from_diagonal(&self.information.diagonal().map(|d| 1e-9 * d + 1e-12));
        let inverse = (self.information + floor).try_inverse()?;
        let solution = inverse * self.moment;
        let rest = (self.square - solution.dot(&self.moment)).max(0.0);
        let variance = rest / (self.samples - 3.0).max(1.0) * inverse[(0, 0)] * TIED_SAMPLES;
        Some((solution[0], variance.max(0.0).sqrt()))
    }
}
