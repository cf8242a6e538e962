//! Sine and cosine of angles close to one whose sine and cosine are known.

use super::number::Number;

/// Farthest angle that the series serves, rad; its error there is below 1e-17.
pub(super) const REACH_RAD: f64 = 0.02;

/// An angle with its sine and cosine.
#[derive(Clone, Copy, Debug)]
pub(in crate::simulate) struct NearAngle<N = f64> {
    pub(super) angle: N,
    pub(super) sin: N,
    pub(super) cos: N,
}

impl NearAngle {
    pub(in crate::simulate) fn new(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self { angle, sin, cos }
    }

    /// Sine and cosine of an angle: the rotation from the known angle by a series where that is near.
    #[inline(always)]
    pub(in crate::simulate) fn sin_cos(&self, angle: f64) -> (f64, f64) {
        if self.reaches(angle) { self.rotated(angle) } else { libm::sincos(angle) }
    }

    /// Returns whether the series serves for an angle.
    #[inline(always)]
    pub(super) fn reaches(&self, angle: f64) -> bool {
        (angle - self.angle).abs() <= REACH_RAD
    }

    /// Makes an angle the known one if it has gone half the way out of reach.
    #[inline(always)]
    pub(super) fn follow(&mut self, angle: f64) {
        let near = (angle - self.angle).abs() <= 0.5 * REACH_RAD;
        if !near {
            *self = Self::new(angle);
        }
    }
}

impl<N: Number> NearAngle<N> {
    /// Sine and cosine of an angle within reach.
    #[inline(always)]
    pub(super) fn rotated(&self, angle: N) -> (N, N) {
        let c = |value: f64| angle.constant(value);
        let turn = angle - self.angle;
        let square = turn * turn;
        let sin =
            turn * (c(1.0) - square * (c(1.0 / 6.0) - square * (c(1.0 / 120.0) - square * c(1.0 / 5040.0))));
        // 1 − cos, so that no digits are lost.
        let fall = square * (c(0.5) - square * (c(1.0 / 24.0) - square * c(1.0 / 720.0)));
        (self.sin + (self.cos * sin - self.sin * fall), self.cos - (self.sin * sin + self.cos * fall))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_functions_everywhere() {
        for start in [-3.0, -0.7, 0.0, 1e-3, 0.5, 1.6, 9.0] {
            let near = NearAngle::new(start);
            for turn in [0.0, 1e-9, -3e-4, 0.01, -0.02, 0.0201, 2.0] {
                let (sin, cos) = near.sin_cos(start + turn);
                let exact = f64::sin_cos(start + turn);
                assert!((sin - exact.0).abs() < 3e-16 && (cos - exact.1).abs() < 3e-16, "{start} {turn}");
            }
        }
    }

    #[test]
    fn following_keeps_every_angle_in_reach() {
        let mut near = NearAngle::new(0.0);
        let mut centres = 0;
        for step in 0..1000 {
            let angle = 0.003 * f64::from(step);
            let before = near.angle;
            near.follow(angle);
            centres += usize::from(near.angle != before);
            assert!(near.reaches(angle + 0.5 * REACH_RAD - 1e-12));
        }
        // 3 rad in stretches of a little more than 0.01 rad.
        assert!((200..=300).contains(&centres), "{centres}");
        near.follow(f64::NAN);
        assert!(near.angle.is_nan());
    }
}
