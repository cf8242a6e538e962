//! The ground under one wheel along its own path: level, ramps, steps and bridges.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, finite, positive, within};

/// Steepest ground, as rise over path: 45°.
const STEEPEST: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Ground as points of distance and height, joined by straight lines, level before the first and behind
/// the last; without points level at height 0. Distance is what the wheel's middle has rolled along its
/// path, as x is. Each corner is rounded over the tyre's contact patch, so that the wheel's path has a
/// continuous slope and curvature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ground {
    /// [distance, height] of each point, m, by rising distance.
    pub points_m: Vec<[f64; 2]>,
    /// Length over which a corner is rounded, m. Default: 0.03 (assumed: a tyre of 63 mm radius pressed in
    /// by 2 mm, 2 √(2 · 63 · 2) mm); less where the next corner is nearer.
    pub contact_patch_m: f64,
}

impl Default for Ground {
    fn default() -> Self {
        Self::flat()
    }
}

impl Ground {
    /// Level at height 0.
    pub const fn flat() -> Self {
        Self { points_m: Vec::new(), contact_patch_m: 0.03 }
    }

    /// A slope between levels: from height 0 at `start_m` to `height_m` after `length_m` of path.
    pub fn ramp(start_m: f64, length_m: f64, height_m: f64) -> Self {
        Self { points_m: vec![[start_m, 0.0], [start_m + length_m, height_m]], ..Self::default() }
    }

    /// An edge of `height_m` at `at_m`, up or down (height below 0), as the middle of a wheel crosses it:
    /// over the chord of the arc that it describes about the edge. Heights beyond the wheel's radius are
    /// too steep to roll over.
    pub fn step(at_m: f64, height_m: f64, wheel_radius_m: f64) -> Self {
        let reach = (height_m.abs() * (2.0 * wheel_radius_m - height_m.abs())).max(0.0).sqrt();
        let chord = libm::hypot(reach, height_m);
        // A wheel rises before the edge and falls behind it.
        let start = if height_m > 0.0 { at_m - reach } else { at_m };
        Self::ramp(start, chord, height_m)
    }

    /// A bridge: up over `ramp_m` of path, a deck of `deck_m` at `height_m`, and down again. Under one
    /// wheel only it is the single-sided bridge, which makes the robot roll.
    ///
    /// ```
    /// use flqr_core::model::Ground;
    ///
    /// let bridge = Ground::bridge(1.0, 0.5, 1.0, 0.05);
    /// assert!(bridge.height_m(0.0) == 0.0 && (bridge.height_m(2.0) - 0.05).abs() < 1e-12);
    /// ```
    pub fn bridge(start_m: f64, ramp_m: f64, deck_m: f64, height_m: f64) -> Self {
        let [up, down, end] = [start_m + ramp_m, start_m + ramp_m + deck_m, start_m + 2.0 * ramp_m + deck_m];
        Self {
            points_m: vec![[start_m, 0.0], [up, height_m], [down, height_m], [end, 0.0]],
            ..Self::default()
        }
    }

    /// Returns whether the ground is level at height 0 everywhere.
    pub fn is_flat(&self) -> bool {
        self.points_m.iter().all(|&[_, height]| height == 0.0)
    }

    /// Height of the ground, m.
    pub fn height_m(&self, distance_m: f64) -> f64 {
        let path = GroundPath::new(self);
        path.under(distance_m, path.piece_at(distance_m)).height
    }

    /// Refuses points that are not finite or not by rising distance, grounds steeper than 45° and a
    /// contact patch that is not above 0.
    pub fn validate(&self) -> Result<(), ParameterError> {
        positive("contact_patch_m", self.contact_patch_m)?;
        for &[distance, height] in &self.points_m {
            finite("points_m", distance)?;
            finite("points_m", height)?;
        }
        for pair in self.points_m.windows(2) {
            let [start, end] = [pair[0], pair[1]];
            if end[0] <= start[0] {
                let allowed = "at a greater distance than the previous point";
                return Err(ParameterError { name: "points_m", value: end[0], allowed: allowed.into() });
            }
            let slope = (end[1] - start[1]) / (end[0] - start[0]);
            within(
                "points_m",
                slope,
                -STEEPEST..=STEEPEST,
                "at most 45° steep: a rise of at most 0.707 m per metre",
            )?;
        }
        Ok(())
    }
}

/// Ground under a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Under {
    /// Height, m.
    pub(crate) height: f64,
    /// Rise for each metre of path: the sine of the slope.
    pub(crate) slope: f64,
    /// Change of that for each metre of path, 1/m.
    pub(crate) bend: f64,
}

/// The path of a wheel's middle over a ground, ready for evaluation.
#[derive(Clone, Debug)]
pub(crate) struct GroundPath {
    /// By rising start; the first reaches back without end, the last on without end.
    pieces: Vec<Piece>,
}

/// A straight line (no change of slope) or a corner.
#[derive(Clone, Copy, Debug)]
struct Piece {
    start: f64,
    height: f64,
    slope: f64,
    slope_change: f64,
    length: f64,
    /// 0 for a straight line.
    per_length: f64,
}

impl GroundPath {
    pub(crate) fn new(ground: &Ground) -> Self {
        let points = &ground.points_m;
        let before = points.first().map_or(0.0, |point| point[1]);
        let mut path = Self { pieces: vec![Piece::straight(f64::NEG_INFINITY, before, 0.0)] };
        // Half of the way to the next corner on either side is a corner's to use.
        let room = |i: usize| points.get(i + 1).map_or(f64::INFINITY, |next| next[0] - points[i][0]);
        let slope = |i: usize| points.get(i + 1).map_or(0.0, |next| (next[1] - points[i][1]) / room(i));
        let mut before = 0.0;
        for (i, &[distance, height]) in points.iter().enumerate() {
            let behind = if i == 0 { f64::INFINITY } else { room(i - 1) };
            let half = 0.5 * ground.contact_patch_m.min(behind).min(room(i));
            let after = slope(i);
            path.pieces.push(Piece::corner(
                distance - half,
                height - half * before,
                before,
                after,
                2.0 * half,
            ));
            path.pieces.push(Piece::straight(distance + half, height + half * after, after));
            before = after;
        }
        path
    }

    /// Index of the piece at a distance.
    pub(crate) fn piece_at(&self, distance: f64) -> usize {
        self.pieces.partition_point(|piece| piece.start <= distance).saturating_sub(1)
    }

    /// Ground under the wheel near a segment.
    #[inline(always)]
    pub(crate) fn under(&self, distance: f64, near: usize) -> Under {
        let mut index = near;
        while index + 1 < self.pieces.len() && self.pieces[index + 1].start <= distance {
            index += 1;
        }
        while index > 0 && self.pieces[index].start > distance {
            index -= 1;
        }
        self.pieces[index].under(distance)
    }
}

impl Piece {
    fn straight(start: f64, height: f64, slope: f64) -> Self {
        Self { start, height, slope, slope_change: 0.0, length: 0.0, per_length: 0.0 }
    }

    fn corner(start: f64, height: f64, before: f64, after: f64, length: f64) -> Self {
        Self { start, height, slope: before, slope_change: after - before, length, per_length: 1.0 / length }
    }

    /// The slope follows 10u³ − 15u⁴ + 6u⁵ over a corner, which meets both lines in height, slope, curvature
    /// and its change: an integrator of order 4 keeps its order.
    #[inline(always)]
    fn under(&self, distance: f64) -> Under {
        // The first piece is level and starts nowhere.
        let way = if self.slope == 0.0 && self.slope_change == 0.0 { 0.0 } else { distance - self.start };
        let u = way * self.per_length;
        let square = u * u;
        let cube = square * u;
        Under {
            height: self.height
                + self.slope * way
                + self.slope_change * self.length * cube * (u * 2.5 - square * (3.0 - u)),
            slope: self.slope + self.slope_change * cube * (10.0 - u * (15.0 - 6.0 * u)),
            bend: self.slope_change * self.per_length * 30.0 * square * (1.0 - u) * (1.0 - u),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grounds() -> Vec<Ground> {
        vec![
            Ground::default(),
            Ground::ramp(0.2, 0.5, 0.06),
            Ground::step(1.0, 0.01, 0.065),
            Ground::step(1.0, -0.02, 0.065),
            Ground::bridge(0.3, 0.4, 0.5, 0.05),
            // Corners nearer than a contact patch.
            Ground {
                points_m: vec![[0.0, 0.01], [0.02, 0.015], [0.03, 0.01], [0.6, 0.1]],
                ..Ground::default()
            },
        ]
    }

    #[test]
    fn slope_is_the_derivative_of_height_and_bend_that_of_slope() {
        for ground in grounds() {
            ground.validate().unwrap();
            let path = GroundPath::new(&ground);
            let at = |distance: f64| path.under(distance, 0);
            let step = 1e-6;
            for i in -500..2000 {
                let distance = f64::from(i) * 1e-3 + 1e-4;
                let [low, high] = [at(distance - step), at(distance + step)];
                let here = at(distance);
                let error = (high.height - low.height) / (2.0 * step) - here.slope;
                assert!(error.abs() < 1e-8, "slope off by {error} at {distance} m of {ground:?}");
                let error = (high.slope - low.slope) / (2.0 * step) - here.bend;
                assert!(error.abs() < 1e-3, "bend off by {error} at {distance} m of {ground:?}");
            }
        }
    }

    #[test]
    fn points_away_from_corners_are_met_exactly() {
        let bridge = Ground::bridge(0.3, 0.4, 0.5, 0.05);
        for (distance, height) in
            [(-9.0, 0.0), (0.2, 0.0), (0.5, 0.025), (0.9, 0.05), (1.4, 0.025), (9.0, 0.0)]
        {
            assert!((bridge.height_m(distance) - height).abs() < 1e-15, "at {distance} m");
        }
        // At a corner half of the slope has been taken up over half of the patch.
        assert!(bridge.height_m(0.3) > 0.0 && bridge.height_m(0.3) < 0.03 * 0.125 / 4.0);
    }

    #[test]
    fn wheel_on_a_step_rises_before_the_edge_and_falls_behind_it() {
        let reach = (0.01_f64 * (2.0 * 0.065 - 0.01)).sqrt();
        let up = Ground::step(1.0, 0.01, 0.065);
        assert!(up.height_m(1.0 - reach - 0.02) == 0.0 && (up.height_m(1.02) - 0.01).abs() < 1e-15);
        let down = Ground::step(1.0, -0.01, 0.065);
        assert!(down.height_m(0.98) == 0.0 && (down.height_m(1.02 + reach) + 0.01).abs() < 1e-15);
    }

    #[test]
    fn impossible_grounds_are_refused() {
        for points_m in [
            vec![[0.0, 0.0], [0.0, 0.1]],
            vec![[1.0, 0.0], [0.0, 0.0]],
            vec![[0.0, 0.0], [0.1, 0.2]],
            vec![[0.0, f64::NAN]],
        ] {
            assert!(
                Ground { points_m: points_m.clone(), ..Ground::default() }.validate().is_err(),
                "{points_m:?}"
            );
        }
        assert!(Ground { contact_patch_m: 0.0, ..Ground::default() }.validate().is_err());
    }

    #[test]
    fn ground_survives_a_file() {
        let ground = Ground::bridge(0.3, 0.4, 0.5, 0.05);
        let text = toml::to_string(&ground).unwrap();
        assert_eq!(toml::from_str::<Ground>(&text).unwrap(), ground);
        assert!(toml::from_str::<Ground>("point_m = []").is_err());
    }
}
