//! Newton's laws for the whole robot: from where it is and what acts on it to its accelerations.

use super::super::planar::Forcing;
use super::super::planar::near_angle::NearAngle;
use super::Pose;
use super::body::Body;
use super::motion::Motion;
use super::terrain::{Footing, Place, Terrain};
use crate::model::Ground;
use crate::model::{Chassis, RobotParameters, State, Surroundings, Tether};

/// Constants of the motion.
#[derive(Clone, Debug)]
pub(super) struct Laws {
    radius_m: f64,
    per_radius: f64,
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
    first_moment_squared: f64,
    /// M l², kg m².
    second_moment: f64,
    /// Inertia about the vertical when upright, kg m².
    yawing: f64,
    /// M g l, N m.
    weight_nm: f64,
    /// Angle of the centre of mass in front of the body's axis, with its sine and cosine.
    com_angle: f64,
    com_direction: (f64, f64),
    /// Offset of a wheel's distance from r (q + lean), m: motor angles are 0 upright at x = 0.
    origin_m: f64,
    tether: Option<Tether>,
    /// `None` on level ground.
    terrain: Option<Terrain>,
}

/// Inputs during one call, with the angles at its start.
#[derive(Clone, Copy)]
pub(super) struct Loads {
    pub(super) torque_nm: [f64; 2],
    push_n: f64,
    push_height_m: f64,
    /// Horizontal force and torque on the body of the effects, the push included in the force.
    along_n: f64,
    about_nm: f64,
    lean: NearAngle,
    yaw: NearAngle,
    pieces: [usize; 2],
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
    /// Speed up the slope, m/s.
    pub(super) uphill: f64,
}

impl Loads {
    /// Same with the contributions of effects: torques inside both motors, a force at the axle and a torque on the
    /// body.
    pub(super) fn with(&self, motors_nm: [f64; 2], axle_n: f64, body_nm: f64) -> Self {
        Self {
            torque_nm: [0, 1].map(|i: usize| self.torque_nm[i] + motors_nm[i]),
            along_n: self.along_n + axle_n,
            about_nm: self.about_nm + body_nm,
            ..*self
        }
    }
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
    pub(super) fn new(
        parameters: &RobotParameters,
        chassis: &Chassis,
        surroundings: &Surroundings,
        grounds: [&Ground; 2],
    ) -> Self {
        let RobotParameters {
            wheel_mass_kg: wheel,
            wheel_inertia_kg_m2: spin,
            wheel_radius_m: radius,
            gravity_m_s2: gravity,
            ..
        } = *parameters;
        let body = Body::new(parameters, chassis.yaw_inertia_kg_m2, surroundings.payload);
        let track_m = chassis.track_width_m;
        let one_wheel = wheel + spin / (radius * radius);
        let first_moment = body.mass_kg * body.com_distance_m;
        let second_moment = first_moment * body.com_distance_m;
        let pitching = body.pitch_inertia_kg_m2 + second_moment;
        let half_track = 0.5 * track_m;
        let slope = libm::sincos(surroundings.slope_rad);
        let even = slope.0 == 0.0 && grounds.iter().all(|ground| ground.is_flat());
        Self {
            radius_m: radius,
            per_radius: 1.0 / radius,
            per_track: 1.0 / track_m,
            yaw_gear: half_track / radius,
            translating: body.mass_kg + 2.0 * one_wheel,
            pitching,
            // Without the cancellation of the two products.
            determinant: 2.0 * one_wheel * pitching + body.mass_kg * body.pitch_inertia_kg_m2,
            first_moment,
            first_moment_squared: first_moment * first_moment,
            second_moment,
            // Each wheel about its diameter: half of its spin, as of a disc.
            yawing: body.yaw_inertia_kg_m2 + 2.0 * one_wheel * half_track * half_track + spin,
            weight_nm: first_moment * gravity,
            com_angle: body.com_angle_rad,
            com_direction: libm::sincos(body.com_angle_rad),
            origin_m: -radius * (body.com_angle_rad + surroundings.slope_rad),
            tether: surroundings.tether,
            terrain: (!even).then(|| Terrain::new(grounds, slope, track_m, &body, wheel, gravity)),
        }
    }

    /// The motion of a robot in a state, with heading 0 and without yaw rate.
    pub(super) fn motion(&self, start: &State) -> Motion {
        Motion {
            angle: [start.x_m / self.radius_m - start.pitch_rad; 2],
            speed: [start.x_dot_m_s / self.radius_m - start.pitch_rate_rad_s; 2],
            lean: start.pitch_rad + self.slope_ahead(0.0) + self.com_angle,
            lean_rate: start.pitch_rate_rad_s,
            uphill: start.x_m,
        }
    }

    pub(super) fn pose(&self, at: &Motion) -> Pose {
        let (x_dot_m_s, yaw_rate_rad_s) = self.forward_and_yaw(at);
        let [left, right] = self.distances(at);
        let yaw_rad = self.yaw(at);
        let state = State {
            x_m: 0.5 * (left + right),
            x_dot_m_s,
            pitch_rad: at.lean - self.com_angle - self.slope_ahead(yaw_rad),
            pitch_rate_rad_s: at.lean_rate,
        };
        let (roll_rad, ground_height_m) = self
            .terrain
            .as_ref()
            .map_or((0.0, [0.0; 2]), |t| t.roll_and_heights([left, right], yaw_rad, at.uphill));
        Pose { state, yaw_rad, yaw_rate_rad_s, roll_rad, ground_height_m }
    }

    fn slope_ahead(&self, yaw: f64) -> f64 {
        self.terrain.as_ref().map_or(0.0, |terrain| terrain.slope_ahead(yaw))
    }

    pub(super) fn loads(&self, forcing: &Forcing, at: &Motion) -> Loads {
        Loads {
            torque_nm: forcing.torque_nm,
            push_n: forcing.push_n,
            push_height_m: forcing.push_height_m,
            along_n: forcing.push_n,
            about_nm: 0.0,
            lean: NearAngle::new(at.lean),
            // Heading matters on a slope only.
            yaw: NearAngle::new(if self.is_sloped() { self.yaw(at) } else { 0.0 }),
            pieces: self.terrain.as_ref().map_or([0; 2], |terrain| terrain.pieces_at(self.distances(at))),
        }
    }

    /// Heading, rad.
    #[inline(always)]
    fn yaw(&self, at: &Motion) -> f64 {
        self.radius_m * self.per_track * (at.angle[1] - at.angle[0])
    }

    /// Ways of both wheels along their paths, m.
    #[inline(always)]
    fn distances(&self, at: &Motion) -> [f64; 2] {
        [0, 1].map(|i: usize| self.radius_m * (at.angle[i] + at.lean) + self.origin_m)
    }

    /// Speeds of both wheels along their paths, m/s.
    #[inline(always)]
    fn wheel_speeds(&self, at: &Motion) -> [f64; 2] {
        [0, 1].map(|i: usize| self.radius_m * (at.speed[i] + at.lean_rate))
    }

    /// Speed of the axle's middle, m/s, and yaw rate, rad/s.
    #[inline(always)]
    fn forward_and_yaw(&self, at: &Motion) -> (f64, f64) {
        let [left, right] = self.wheel_speeds(at);
        (0.5 * (left + right), (right - left) * self.per_track)
    }

    /// Sine and cosine of the body's own axis from those of the line to its centre of mass.
    #[inline(always)]
    fn body_axis(&self, (sin, cos): (f64, f64)) -> (f64, f64) {
        let (s, c) = self.com_direction;
        (sin * c - cos * s, cos * c + sin * s)
    }

    #[inline(always)]
    fn place(&self, at: &Motion, lean: (f64, f64), yaw: (f64, f64)) -> Place {
        Place { distance: self.distances(at), wheel_speed: self.wheel_speeds(at), lean, yaw }
    }

    fn is_sloped(&self) -> bool {
        self.terrain.as_ref().is_some_and(|terrain| !terrain.is_level())
    }

    /// Returns whether the ground is one level plane.
    pub(super) fn is_even(&self) -> bool {
        self.terrain.is_none()
    }

    #[inline(always)]
    fn footing<const UNEVEN: bool>(&self, loads: &Loads, at: &Motion, lean: (f64, f64)) -> (Footing, f64) {
        let Some(terrain) = self.terrain.as_ref().filter(|_| UNEVEN) else {
            let about = self.weight_nm * lean.0;
            return (Footing { tilt: (0.0, 1.0), tilt_rate: 0.0, along: 0.0, about, turning: 0.0 }, 0.0);
        };
        let yaw = if terrain.is_level() { (0.0, 1.0) } else { loads.yaw.sin_cos(self.yaw(at)) };
        let (forward, _) = self.forward_and_yaw(at);
        (terrain.footing(&self.place(at, lean, yaw), loads.pieces), forward * yaw.1)
    }

    /// Accelerations where the robot is; on level ground the ground need not be asked (not `UNEVEN`).
    #[inline(always)]
    pub(super) fn response<const UNEVEN: bool>(&self, loads: &Loads, at: &Motion) -> Response {
        let lean = loads.lean.sin_cos(at.lean);
        let (forward, yaw_rate) = self.forward_and_yaw(at);
        let (footing, uphill) = self.footing::<UNEVEN>(loads, at, lean);
        // Against the path, which the ground may tilt.
        let (sin, cos) = (
            lean.0 * footing.tilt.1 + lean.1 * footing.tilt.0,
            lean.1 * footing.tilt.1 - lean.0 * footing.tilt.0,
        );
        let (rate, spin) = (at.lean_rate, yaw_rate * yaw_rate);
        let moment_sin = self.first_moment * sin;
        let moment_cos = self.first_moment * cos;
        let swing = self.second_moment * sin * cos;

        let (pull_along, pull_about) = self.tether_pull(at, lean);
        let push_about = loads.push_height_m * self.body_axis((sin, cos)).1 * loads.push_n;
        let along = moment_sin * (rate * rate + spin) + loads.along_n + footing.along + pull_along;
        let about = swing * spin
            + moment_sin * forward * footing.tilt_rate
            + footing.about
            + push_about
            + pull_about
            + loads.about_nm;
        let turning =
            footing.turning - (moment_sin * forward + swing * (2.0 * rate + footing.tilt_rate)) * yaw_rate;

        // A v̇ + C θ̈ = along, C v̇ + D θ̈ = about; A D − C² without its cancellation when upright
        let inverse = 1.0 / (self.determinant + self.first_moment_squared * (sin * sin));
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
            uphill,
        }
    }

    /// Force of the tether along the path, N, and its moment on the pitch, N m.
    #[inline(always)]
    fn tether_pull(&self, at: &Motion, lean: (f64, f64)) -> (f64, f64) {
        let Some(tether) = &self.tether else { return (0.0, 0.0) };
        let axis = self.body_axis(lean);
        let force = -tether.stiffness_n_m * self.stretch(tether, at, axis);
        (force, force * tether.height_m * axis.1)
    }

    /// Length of the tether beyond its slack, m; its sign is the side of the anchor that the robot is on.
    #[inline(always)]
    fn stretch(&self, tether: &Tether, at: &Motion, body_axis: (f64, f64)) -> f64 {
        let [left, right] = self.distances(at);
        let away = 0.5 * (left + right) + tether.height_m * body_axis.0 - tether.anchor_m;
        (away.abs() - tether.slack_m).max(0.0).copysign(away)
    }

    /// Sine and cosine of the path's slope against the plane.
    pub(super) fn tilt(&self, at: &Motion) -> (f64, f64) {
        self.terrain.as_ref().map_or((0.0, 1.0), |terrain| terrain.tilt(self.distances(at)))
    }

    /// Kinetic and potential energy, J: 0 when upright at standstill on level ground at height 0 without payload.
    pub(super) fn energy_j(&self, at: &Motion) -> f64 {
        let lean = libm::sincos(at.lean);
        let place = self.place(at, lean, libm::sincos(self.yaw(at)));
        let potential = match &self.terrain {
            Some(terrain) => terrain.energy_j(&place, at.uphill),
            None => self.weight_nm * (lean.1 - 1.0),
        };
        let stretch = |tether: &Tether| self.stretch(tether, at, self.body_axis(lean));
        let tether =
            self.tether.as_ref().map_or(0.0, |tether| 0.5 * tether.stiffness_n_m * stretch(tether).powi(2));
        let (tilt_sin, tilt_cos) = self.tilt(at);
        let (sin, cos) = (lean.0 * tilt_cos + lean.1 * tilt_sin, lean.1 * tilt_cos - lean.0 * tilt_sin);
        let (forward, yaw_rate) = self.forward_and_yaw(at);
        let rate = at.lean_rate;
        potential
            + tether
            + 0.5 * self.translating * forward * forward
            + self.first_moment * cos * forward * rate
            + 0.5 * self.pitching * rate * rate
            + 0.5 * (self.yawing + self.second_moment * sin * sin) * yaw_rate * yaw_rate
    }
}
