//! Whether the motors do what they are asked for.
//!
//! Sources disagree on the steps of the current command by a factor of 1.986, and the two windings' torque constants
//! differ by 2.53. Quiet balancing cannot tell: torques are then as small as the friction, which holds the motors most
//! of the time. So soon after arming both motors get the same nudge on top of what the controller asks for, one way for
//! 40 ms and back for 40 ms, and the encoders tell how far it went:
//! q̄(t) = q₀ + q̇₀ t + ½ c t² + f ∬ b ΣT, where b is the model's response to a torque, c the gravity and friction of
//! those 80 ms, and f the factor that is looked for. What the controller asked for meanwhile is part of ΣT. An unknown
//! payload changes b little, because mass and inertia grow together in numerator and denominator.

use std::ops::RangeInclusive;

use nalgebra::{Matrix4, Vector4};

use crate::control::Readings;
use crate::model_file::RobotModel;
use crate::robot::TICK_S;

/// Time from arming to the nudge, s: on the ground, for the robot to be let go and to settle; in the air, for the
/// motors to be on.
const START_GROUND_S: f64 = 1.0;
const START_AIR_S: f64 = 0.25;
/// Each way of the nudge, s, and the change of the motors' speed that it aims at, rad/s.
const HALF_S: f64 = 0.04;
const SPEED_RAD_S: f64 = 0.6;
/// Least torque of the nudge, several times the friction of such motors, N m; and greatest share of the limit.
const LEAST_NM: f64 = 0.5;
const GREATEST_SHARE: f64 = 0.5;
/// Factors that are let pass, and deviations that the estimate has to lie outside.
const ALLOWED: RangeInclusive<f64> = 0.7..=1.45;
const DEVIATIONS: f64 = 3.0;
/// Standard deviation above which nothing is said.
const LARGEST_DEVIATION: f64 = 0.1;

/// The nudge, and what came of it.
#[derive(Clone, Debug)]
pub(super) struct TorqueScale {
    /// Acceleration of both motors under 1 N m in all, rad/s².
    response: f64,
    start_s: f64,
    nudge_nm: f64,
    /// Time since the nudge began, s, and mean motor angle, rad; drive's integral once and twice.
    rows: Vec<(f64, f64, f64)>,
    speed: f64,
    way: f64,
    done: bool,
}

impl TorqueScale {
    pub(super) fn new(robot: &RobotModel, balancing: bool, torque_limit_nm: f64) -> Self {
        let response = if balancing {
            let b = robot.parameters.linear_model().b;
            b[(1, 0)] / robot.parameters.wheel_radius_m - b[(3, 0)]
        } else {
            0.5 / robot.parameters.wheel_inertia_kg_m2
        };
        let nudge_nm = (SPEED_RAD_S / (2.0 * response * HALF_S)).max(LEAST_NM);
        Self {
            response,
            start_s: if balancing { START_GROUND_S } else { START_AIR_S },
            nudge_nm: nudge_nm.min(GREATEST_SHARE * torque_limit_nm),
            rows: Vec::new(),
            speed: 0.0,
            way: 0.0,
            done: false,
        }
    }

    /// Time since arming at which nothing is added any more, s.
    pub(super) fn end_s(&self) -> f64 {
        self.start_s + 2.0 * HALF_S
    }

    /// What is added to both torques at a time since arming, N m.
    pub(super) fn nudge_nm(&self, time_s: f64) -> f64 {
        let since = time_s - self.start_s;
        if (0.0..HALF_S).contains(&since) {
            self.nudge_nm
        } else if (HALF_S..2.0 * HALF_S).contains(&since) {
            -self.nudge_nm
        } else {
            0.0
        }
    }

    /// Takes the readings of a tick and the torques that acted since the last; the factor and its standard deviation,
    /// once.
    pub(super) fn step(
        &mut self,
        time_s: f64,
        readings: &Readings,
        acted_nm: [f64; 2],
    ) -> Option<(f64, f64)> {
        let since = time_s - self.start_s;
        if self.done || since < 0.0 {
            return None;
        }
        let change = self.response * (acted_nm[0] + acted_nm[1]) * TICK_S;
        self.way += (self.speed + 0.5 * change) * TICK_S;
        self.speed += change;
        let angle = f64::midpoint(readings.motor_angle_rad[0], readings.motor_angle_rad[1]);
        self.rows.push((since, angle, self.way));
        self.done = since > 2.0 * HALF_S;
        if self.done { self.estimate() } else { None }
    }

    /// Least squares over the nudge.
    fn estimate(&self) -> Option<(f64, f64)> {
        let &(_, first, _) = self.rows.first()?;
        // Time in shares of the nudge and way in shares of its greatest, so that all columns are of one size.
        let way = self.rows.iter().fold(0.0_f64, |most, row| most.max(row.2.abs()));
        let (mut information, mut moment, mut square) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
        for (since, angle, done) in &self.rows {
            let time = since / (2.0 * HALF_S);
            let row = Vector4::new(done / way, 1.0, time, time * time);
            let moved = angle - first;
            information += row * row.transpose();
            moment += row * moved;
            square += moved * moved;
        }
        let inverse = information.try_inverse()?;
        let solution = inverse * moment;
        let rest = (square - solution.dot(&moment)).max(0.0);
        let variance = rest / (self.rows.len() as f64 - 4.0).max(1.0) * inverse[(0, 0)];
        Some((solution[0] / way, variance.max(0.0).sqrt() / way))
    }
}

/// Whether a factor is surely beyond what payload and friction can do.
pub(super) fn is_wrong((factor, deviation): (f64, f64)) -> bool {
    let margin = DEVIATIONS * deviation;
    deviation < LARGEST_DEVIATION && (factor + margin < *ALLOWED.start() || factor - margin > *ALLOWED.end())
}
