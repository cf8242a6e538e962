//! Geometry of the side view: a plane seen from the robot's right, x to the right, z upward.
//!
//! The way along the ground is drawn as horizontal distance, which lengthens a ramp of 10° by 1.5 %.

use egui::{Pos2, Rect, Vec2, pos2, vec2};
use flqr_core::model::{Ground, RobotParameters};
use flqr_core::simulate::Pose;

/// Width of the body over its height, as it is drawn.
const BODY_ASPECT: f64 = 0.6;
/// Free height over the robot and depth of the ground, as fractions of the robot's height.
const MARGIN_TOP: f64 = 0.25;
const MARGIN_BOTTOM: f64 = 0.3;
/// The robot may be this much smaller than it could be, so that the whole travel is seen;
const LEAST_SCALE: f64 = 0.35;
/// where that is not enough, it is this much smaller and followed.
const FOLLOWING_SCALE: f64 = 0.55;

/// Metres to points of the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    rect: Rect,
    /// Point at the bottom centre, m.
    center_m: f64,
    bottom_m: f64,
    /// Points per metre.
    scale: f64,
    /// Sine and cosine of the slope.
    slope: (f64, f64),
}

/// Contents of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subject {
    /// Least and greatest x of all runs, m.
    pub(super) travel_m: [f64; 2],
    /// From the ground to the top of the body, m.
    pub(super) height_m: f64,
    /// Slope of the ground, rad.
    pub(super) slope_rad: f64,
}

impl Camera {
    /// Fits the whole travel where the robot stays large enough; otherwise follows `x_m`.
    pub(super) fn new(rect: Rect, subject: &Subject, x_m: f64, ground_m: f64) -> Self {
        let (width, height) = (f64::from(rect.width().max(1.0)), f64::from(rect.height().max(1.0)));
        let margins = 1.0 + MARGIN_TOP + MARGIN_BOTTOM;
        let closest = height / (subject.height_m * margins);
        let [low, high] = subject.travel_m;
        let whole = width / (high - low + 1.6 * subject.height_m);
        let (scale, center_m, ground_m) = if whole >= closest * LEAST_SCALE {
            (whole.min(closest), 0.5 * (low + high), 0.0)
        } else {
            (closest * FOLLOWING_SCALE, x_m, ground_m)
        };
        let bottom_m = ground_m - MARGIN_BOTTOM / margins * height / scale;
        Self { rect, center_m, bottom_m, scale, slope: subject.slope_rad.sin_cos() }
    }

    /// Position of a point: `x` along and `z` above the plane of the ground.
    pub(super) fn at(&self, x: f64, z: f64) -> Pos2 {
        let (sin, cos) = self.slope;
        let along = x - self.center_m;
        let (x, z) = (along * cos - z * sin, along * sin + z * cos);
        pos2(
            self.rect.center().x + (x * self.scale) as f32,
            self.rect.bottom() - ((z - self.bottom_m) * self.scale) as f32,
        )
    }

    /// A length in points.
    pub(super) fn length(&self, metres: f64) -> f32 {
        (metres * self.scale) as f32
    }

    /// Least and greatest x that can be seen, m.
    pub(super) fn visible(&self) -> [f64; 2] {
        let half = 0.5 * f64::from(self.rect.width()) / (self.scale * self.slope.1);
        let more = half * self.slope.0.abs() * 2.0;
        [self.center_m - half - more, self.center_m + half + more]
    }
}

/// A block of the body's mass and inertia about its centre of mass, as half width and half height, m; no
/// lower than just above the ground.
pub(super) fn body_half_size(parameters: &RobotParameters) -> [f64; 2] {
    let squares = 12.0 * parameters.body_inertia_kg_m2 / parameters.body_mass_kg;
    let height = (squares / (1.0 + BODY_ASPECT * BODY_ASPECT)).sqrt();
    let highest = parameters.com_height_m.abs() + 0.7 * parameters.wheel_radius_m;
    let half = (0.5 * height).min(highest).max(0.3 * parameters.wheel_radius_m);
    [BODY_ASPECT * 0.5 * height.max(2.0 * half), half]
}

/// From the ground to the top of the upright body, m.
pub(super) fn robot_height_m(parameters: &RobotParameters) -> f64 {
    let top = parameters.com_height_m + body_half_size(parameters)[1];
    parameters.wheel_radius_m + top.max(parameters.wheel_radius_m)
}

/// The robot at one moment, in metres of the plane.
pub(super) struct Figure {
    /// Middle of the left (far) and the right (near) wheel.
    pub(super) wheels: [[f64; 2]; 2],
    pub(super) axle: [f64; 2],
    pub(super) com: [f64; 2],
    /// Corners of the body.
    pub(super) body: [[f64; 2]; 4],
    /// Turn of the wheels, forward positive, rad.
    pub(super) turn_rad: f64,
}

impl Figure {
    pub(super) fn new(parameters: &RobotParameters, pose: &Pose) -> Self {
        let x = pose.state.x_m;
        let radius = parameters.wheel_radius_m;
        let wheels = pose.ground_height_m.map(|height| [x, height + radius]);
        let axle = [x, 0.5 * (wheels[0][1] + wheels[1][1])];
        let (sin, cos) = pose.state.pitch_rad.sin_cos();
        // Along the body and, forward, across it.
        let point = |across: f64, along: f64| {
            [axle[0] + along * sin + across * cos, axle[1] + along * cos - across * sin]
        };
        let [half_width, half_height] = body_half_size(parameters);
        let com = parameters.com_height_m;
        let (low, high) = (com - half_height, com + half_height);
        Self {
            wheels,
            axle,
            com: point(0.0, com),
            body: [
                point(-half_width, low),
                point(half_width, low),
                point(half_width, high),
                point(-half_width, high),
            ],
            turn_rad: x / radius,
        }
    }
}

/// The ground's outline between two x, m.
pub(super) fn outline(ground: &Ground, [low, high]: [f64; 2]) -> Vec<[f64; 2]> {
    let points = &ground.points_m;
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return vec![[low, 0.0], [high, 0.0]];
    };
    let mut line = vec![[low.min(first[0]), first[1]]];
    line.extend(points);
    line.push([high.max(last[0]), last[1]]);
    line
}

/// Round values between two others, about `count` of them, and the decimals they need.
pub(super) fn ruler([low, high]: [f64; 2], count: f64) -> (Vec<f64>, usize) {
    let rough = (high - low) / count.max(1.0);
    if !(rough.is_finite() && rough > 0.0) {
        return (Vec::new(), 0);
    }
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(10.0 * power);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    ((first..=last).map(|mark| mark as f64 * step).collect(), decimals)
}

/// A spoke's end at the rim, on the screen.
pub(super) fn spoke(radius: f32, turn_rad: f64) -> Vec2 {
    let (sin, cos) = turn_rad.sin_cos();
    vec2(sin as f32, -cos as f32) * radius
}

#[cfg(test)]
mod tests {
    use flqr_core::model::State;
    use flqr_core::model_file::presets;

    use super::*;

    fn parameters() -> RobotParameters {
        presets::paper().robot().unwrap().parameters
    }

    fn pose(x_m: f64, pitch_rad: f64) -> Pose {
        Pose { state: State { x_m, pitch_rad, ..State::default() }, ..Pose::default() }
    }

    fn subject(travel_m: [f64; 2]) -> Subject {
        Subject { travel_m, height_m: robot_height_m(&parameters()), slope_rad: 0.0 }
    }

    const RECT: Rect = Rect { min: Pos2::ZERO, max: pos2(360.0, 220.0) };

    #[test]
    fn the_tilt_is_to_scale_and_forward_is_right() {
        for pitch in [-0.5, 0.0, 0.1, 0.8] {
            let figure = Figure::new(&parameters(), &pose(0.3, pitch));
            let camera = Camera::new(RECT, &subject([0.0, 0.5]), 0.3, 0.0);
            let [axle, com] = [figure.axle, figure.com].map(|[x, z]| camera.at(x, z));
            let drawn = f64::from(com.x - axle.x).atan2(f64::from(axle.y - com.y));
            assert!((drawn - pitch).abs() < 1e-4, "{drawn} drawn of {pitch}");
            let length = f64::from(com.distance(axle) / camera.length(1.0));
            assert!((length - parameters().com_height_m).abs() < 1e-4);
        }
    }

    #[test]
    fn the_drawn_body_has_the_models_inertia_where_the_ground_leaves_room() {
        let [half_width, half_height] = body_half_size(&parameters());
        let inertia = parameters().body_mass_kg * (half_width.powi(2) + half_height.powi(2)) / 3.0;
        assert!((inertia - parameters().body_inertia_kg_m2).abs() < 0.1 * inertia, "{inertia}");
    }

    #[test]
    fn a_short_travel_is_seen_as_a_whole_and_a_long_one_is_followed() {
        for (travel, x) in [([-0.1, 0.1], 0.1), ([0.0, 0.9], 0.0), ([0.0, 40.0], 27.0)] {
            let subject = subject(travel);
            let camera = Camera::new(RECT, &subject, x, 0.0);
            for corner in Figure::new(&parameters(), &pose(x, 0.0)).body {
                assert!(RECT.contains(camera.at(corner[0], corner[1])), "{travel:?}");
            }
            assert!(f64::from(camera.length(subject.height_m)) > 0.3 * 220.0, "large enough: {travel:?}");
            assert!(RECT.contains(camera.at(x, 0.0)), "{travel:?}");
        }
    }

    #[test]
    fn marks_of_the_ruler_are_round() {
        assert_eq!(ruler([-0.13, 0.31], 5.0).0.len(), 5);
        assert_eq!(ruler([0.0, 0.0], 5.0).0.len(), 0);
        assert_eq!(ruler([0.0, 3.1], 4.0), (vec![0.0, 1.0, 2.0, 3.0], 0));
    }
}
