//! Gravity on uneven and sloped ground.
//!
//! The ground under each wheel is a height over that wheel's own path; below both lies a plane with a slope
//! up the way x points at heading 0. The forces are the derivatives of the potential energy
//! g cos α [m (z_l + z_r) + M ((z_l + z_r)/2 + l cos θ cos ρ)] + g sin α [(M + 2m) X + M l sin θ cos ψ]
//! with sin ρ = (z_r − z_l)/b the roll against the plane, X the way up the slope and θ from the plane's
//! normal, so that energy is kept exactly.

use super::body::Body;
use crate::model::{Ground, GroundPath, Under};

/// Farthest roll, as its sine: a robot beyond it has fallen over, which this model cannot show.
const FARTHEST_ROLL: f64 = 0.9;

/// Ground that is not one level plane.
#[derive(Clone, Debug)]
pub(super) struct Terrain {
    paths: [GroundPath; 2],
    slope: (f64, f64),
    track_m: f64,
    /// m g cos α and M g cos α, N.
    wheel_weight_n: f64,
    body_weight_n: f64,
    /// M g l cos α, N m.
    lever_nm: f64,
    /// (M + 2m) g sin α, N, and M l g sin α, N m.
    downhill_n: f64,
    downhill_nm: f64,
}

/// Position of the robot on the ground.
pub(super) struct Place {
    pub(super) distance: [f64; 2],
    pub(super) wheel_speed: [f64; 2],
    pub(super) lean: (f64, f64),
    pub(super) yaw: (f64, f64),
}

/// Forces of the ground on the robot.
pub(super) struct Footing {
    /// Sine and cosine of the path's slope, mean of both wheels, and its rate, rad/s.
    pub(super) tilt: (f64, f64),
    pub(super) tilt_rate: f64,
    /// Forces of gravity along the path, N, on the pitch and on the yaw, N m.
    pub(super) along: f64,
    pub(super) about: f64,
    pub(super) turning: f64,
}

impl Terrain {
    /// `slope` as sine and cosine.
    pub(super) fn new(
        grounds: [&Ground; 2],
        slope: (f64, f64),
        track_m: f64,
        body: &Body,
        wheel_mass_kg: f64,
        gravity: f64,
    ) -> Self {
        let (sin, cos) = slope;
        let lever = body.mass_kg * body.com_distance_m * gravity;
        Self {
            paths: grounds.map(GroundPath::new),
            slope,
            track_m,
            wheel_weight_n: wheel_mass_kg * gravity * cos,
            body_weight_n: body.mass_kg * gravity * cos,
            lever_nm: lever * cos,
            downhill_n: (body.mass_kg + 2.0 * wheel_mass_kg) * gravity * sin,
            downhill_nm: lever * sin,
        }
    }

    /// Returns whether the plane below is level.
    pub(super) fn is_level(&self) -> bool {
        self.slope.0 == 0.0
    }

    pub(super) fn pieces_at(&self, distance: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|i| self.paths[i].piece_at(distance[i]))
    }

    #[inline(always)]
    fn roll(&self, under: &[Under; 2]) -> (f64, f64) {
        let sin = ((under[1].height - under[0].height) / self.track_m).clamp(-FARTHEST_ROLL, FARTHEST_ROLL);
        (sin, (1.0 - sin * sin).sqrt())
    }

    #[inline(always)]
    pub(super) fn footing(&self, place: &Place, near: [usize; 2]) -> Footing {
        let under = [0, 1].map(|i: usize| self.paths[i].under(place.distance[i], near[i]));
        let tilt_sin = 0.5 * (under[0].slope + under[1].slope);
        let tilt_cos = (1.0 - tilt_sin * tilt_sin).sqrt();
        let climb = under[0].bend * place.wheel_speed[0] + under[1].bend * place.wheel_speed[1];
        let (lean_sin, lean_cos) = place.lean;
        let (yaw_sin, yaw_cos) = place.yaw;
        let (roll_sin, roll_cos) = self.roll(&under);
        // The body's weight on each wheel, more on the lower one.
        let share = 0.5 * self.body_weight_n + self.wheel_weight_n;
        let shift = self.lever_nm / self.track_m * lean_cos * roll_sin / roll_cos;
        let left = -under[0].slope * (share + shift);
        let right = -under[1].slope * (share - shift);
        Footing {
            tilt: (tilt_sin, tilt_cos),
            tilt_rate: 0.5 * climb / tilt_cos,
            along: left + right - self.downhill_n * yaw_cos,
            about: self.lever_nm * lean_sin * roll_cos - self.downhill_nm * lean_cos * yaw_cos,
            turning: 0.5 * self.track_m * (right - left) + self.downhill_nm * lean_sin * yaw_sin,
        }
    }

    /// Sine and cosine of the path's slope, mean of both wheels.
    pub(super) fn tilt(&self, distance: [f64; 2]) -> (f64, f64) {
        let slope = |i: usize| self.paths[i].under(distance[i], 0).slope;
        let sin = 0.5 * (slope(0) + slope(1));
        (sin, (1.0 - sin * sin).sqrt())
    }

    /// Potential energy, J: 0 upright at X = 0 on the plane.
    pub(super) fn energy_j(&self, place: &Place, uphill: f64) -> f64 {
        let under = [0, 1].map(|i: usize| self.paths[i].under(place.distance[i], 0));
        let heights = under[0].height + under[1].height;
        (self.wheel_weight_n + 0.5 * self.body_weight_n) * heights
            + self.lever_nm * (place.lean.1 * self.roll(&under).1 - 1.0)
            + self.downhill_n * uphill
            + self.downhill_nm * place.lean.0 * place.yaw.1
    }

    /// Roll, rad, and height of the ground under both wheels, m, against the true vertical.
    pub(super) fn roll_and_heights(&self, distance: [f64; 2], yaw: f64, uphill: f64) -> (f64, [f64; 2]) {
        let (slope_sin, slope_cos) = self.slope;
        let under = [0, 1].map(|i: usize| self.paths[i].under(distance[i], 0));
        let across = libm::sin(yaw);
        let (roll_sin, roll_cos) = self.roll(&under);
        let roll = libm::asin((slope_cos * roll_sin + slope_sin * across * roll_cos).clamp(-1.0, 1.0));
        let height = |i: usize, side: f64| {
            slope_cos * under[i].height + slope_sin * (uphill + side * 0.5 * self.track_m * across)
        };
        (roll, [height(0, -1.0), height(1, 1.0)])
    }

    /// Slope of the plane ahead at a heading, rad.
    pub(super) fn slope_ahead(&self, yaw: f64) -> f64 {
        if self.is_level() { 0.0 } else { libm::atan2(self.slope.0 * libm::cos(yaw), self.slope.1) }
    }
}
