//! Newton's laws for the whole robot: from where it is and what acts on it to its accelerations.

use super::super::planar::Forcing;
use super::super::planar::near_angle::NearAngle;
use super::motion::Motion;
use crate::robot::RobotParameters;

/// What does not change as the robot moves.
#[derive(Clone, Debug)]
pub(super) struct Laws {
    pub(super) radius_m: f64,
    per_radius: f64,
    pub(super) track_m: f64,
    per_track: f64,
    /// b/2r: motor speed of each wheel, outward one forward, for 1 rad/s of yaw.
    yaw_gear: f64,
    /// M + 2m + 2I/r², kg.
    translating: f64,
    /// J + M l², kg m².
    pitching: f64,
    /// (M + 2m + 2I/r²)(J + M l²) − M² l², kg² m²: of the mass matrix when upright.
    determinant: f64,
    /// M l, kg m.
    first_moment: f64,
    /// M l², kg m².
    second_moment: f64,
    /// Inertia about the vertical when upright, kg m².
    yawing: f64,
    /// M g l, N m.
    weight_nm: f64,
}

/// What acts during one call, with the angles at its start.
pub(super) struct Loads {
    pub(super) torque_nm: [f64; 2],
    push_n: f64,
    push_height_m: f64,
    lean: NearAngle,
}

/// Accelerations without any torque on the shafts, and what 1 N m there adds to them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    /// Mean of both q̈, rad/s², and half of right less left.
    mean: f64,
    half_difference: f64,
    /// Pitch, rad/s².
    lean: f64,
    /// rad/s² for 1 N m of the sum of both torques.
    mean_per_sum: f64,
    lean_per_sum: f64,
    /// rad/s² for 1 N m of right less left.
    half_difference_per_difference: f64,
}

impl Response {
    /// Torques that keep both q̈ = 0, N m.
    #[inline(always)]
    pub(super) fn holding_both(&self) -> [f64; 2] {
        let half_sum = -0.5 * self.mean / self.mean_per_sum;
        let half_difference = -0.5 * self.half_difference / self.half_difference_per_difference;
        [half_sum - half_difference, half_sum + half_difference]
    }

    /// Torque that keeps q̈ = 0 of one motor (0 left, 1 right) under the other's, N m.
    #[inline(always)]
    pub(super) fn holding_one(&self, motor: usize, other_nm: f64) -> f64 {
        let side = if motor == 0 { -1.0 } else { 1.0 };
        let across = self.mean_per_sum - self.half_difference_per_difference;
        -(self.mean + side * self.half_difference + across * other_nm) / self.own()
    }

    /// rad/s² of one motor for 1 N m on its own shaft.
    #[inline(always)]
    pub(super) fn own(&self) -> f64 {
        self.mean_per_sum + self.half_difference_per_difference
    }

    /// q̈ of both motors under torques on their shafts, rad/s².
    #[inline(always)]
    pub(super) fn motor_accelerations(&self, shaft_nm: [f64; 2]) -> [f64; 2] {
        let mean = self.mean + self.mean_per_sum * (shaft_nm[0] + shaft_nm[1]);
        let half_difference =
            self.half_difference + self.half_difference_per_difference * (shaft_nm[1] - shaft_nm[0]);
        [mean - half_difference, mean + half_difference]
    }

    /// Pitch acceleration under torques on the shafts, rad/s².
    #[inline(always)]
    pub(super) fn lean_acceleration(&self, shaft_nm: [f64; 2]) -> f64 {
        self.lean + self.lean_per_sum * (shaft_nm[0] + shaft_nm[1])
    }
}

impl Laws {
    pub(super) fn new(parameters: &RobotParameters, track_m: f64, yaw_inertia: f64) -> Self {
        let RobotParameters {
            body_mass_kg: body,
            wheel_mass_kg: wheel,
            wheel_inertia_kg_m2: spin,
            wheel_radius_m: radius,
            com_height_m: height,
            body_inertia_kg_m2: pitch_inertia,
            gravity_m_s2: gravity,
        } = *parameters;
        let one_wheel = wheel + spin / (radius * radius);
        let first_moment = body * height;
        let second_moment = first_moment * height;
        let half_track = 0.5 * track_m;
        Self {
            radius_m: radius,
            per_radius: 1.0 / radius,
            track_m,
            per_track: 1.0 / track_m,
            yaw_gear: half_track / radius,
            translating: body + 2.0 * one_wheel,
            pitching: pitch_inertia + second_moment,
            // Without the cancellation of the two products.
            determinant: 2.0 * one_wheel * (pitch_inertia + second_moment) + body * pitch_inertia,
            first_moment,
            second_moment,
            // Each wheel about its diameter: half of its spin, as of a disc.
            yawing: yaw_inertia + 2.0 * one_wheel * half_track * half_track + spin,
            weight_nm: first_moment * gravity,
        }
    }

    pub(super) fn loads(&self, forcing: &Forcing, at: &Motion) -> Loads {
        Loads {
            torque_nm: forcing.torque_nm,
            push_n: forcing.push_n,
            push_height_m: forcing.push_height_m,
            lean: NearAngle::new(at.lean),
        }
    }

    /// Speeds of both wheels along their paths, m/s.
    #[inline(always)]
    pub(super) fn wheel_speeds(&self, at: &Motion) -> [f64; 2] {
        [self.radius_m * (at.speed[0] + at.lean_rate), self.radius_m * (at.speed[1] + at.lean_rate)]
    }

    /// Speed of the axle's middle, m/s, and yaw rate, rad/s.
    #[inline(always)]
    pub(super) fn forward_and_yaw(&self, at: &Motion) -> (f64, f64) {
        let [left, right] = self.wheel_speeds(at);
        (0.5 * (left + right), (right - left) * self.per_track)
    }

    #[inline(always)]
    pub(super) fn response(&self, loads: &Loads, at: &Motion) -> Response {
        let (sin, cos) = loads.lean.sin_cos(at.lean);
        let (forward, yaw_rate) = self.forward_and_yaw(at);
        let (rate, spin) = (at.lean_rate, yaw_rate * yaw_rate);
        let moment_sin = self.first_moment * sin;
        let moment_cos = self.first_moment * cos;
        let swing = self.second_moment * sin * cos;

        let along = moment_sin * (rate * rate + spin) + loads.push_n;
        let about = self.weight_nm * sin + swing * spin + loads.push_height_m * cos * loads.push_n;
        let turning = -(moment_sin * forward + 2.0 * swing * rate) * yaw_rate;

        // A v̇ + C θ̈ = along, C v̇ + D θ̈ = about; A D − C² without its cancellation when upright
        let inverse =
            1.0 / (self.determinant + self.first_moment * self.first_moment * (1.0 - cos) * (1.0 + cos));
        let yaw_inverse = 1.0 / (self.yawing + self.second_moment * sin * sin);
        let forward_accel = (self.pitching * along - moment_cos * about) * inverse;
        let lean = (self.translating * about - moment_cos * along) * inverse;
        // 1 N m on a shaft: 1/r along, −1 about.
        let forward_per_sum = (self.pitching * self.per_radius + moment_cos) * inverse;
        let lean_per_sum = -(self.translating + moment_cos * self.per_radius) * inverse;
        Response {
            mean: forward_accel * self.per_radius - lean,
            half_difference: self.yaw_gear * turning * yaw_inverse,
            lean,
            mean_per_sum: forward_per_sum * self.per_radius - lean_per_sum,
            lean_per_sum,
            half_difference_per_difference: self.yaw_gear * self.yaw_gear * yaw_inverse,
        }
    }

    /// Kinetic and potential energy, J, 0 when upright at rest.
    pub(super) fn energy_j(&self, at: &Motion) -> f64 {
        let (sin, cos) = libm::sincos(at.lean);
        let (forward, yaw_rate) = self.forward_and_yaw(at);
        let rate = at.lean_rate;
        0.5 * self.translating * forward * forward
            + self.first_moment * cos * forward * rate
            + 0.5 * self.pitching * rate * rate
            + 0.5 * (self.yawing + self.second_moment * sin * sin) * yaw_rate * yaw_rate
            + self.weight_nm * (cos - 1.0)
    }
}
