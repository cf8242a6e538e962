//! Sine and cosine of angles close to one whose sine and cosine are known.

/// Farthest angle that the series serves, rad; its error there is below 1e-17.
const REACH_RAD: f64 = 0.02;

/// An angle with its sine and cosine.
#[derive(Clone, Copy, Debug)]
pub(in crate::simulate) struct NearAngle {
    angle: f64,
    sin: f64,
    cos: f64,
}

impl NearAngle {
    pub(in crate::simulate) fn new(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self { angle, sin, cos }
    }

    /// Sine and cosine of an angle: the rotation from the known angle by a series where that is near.
    #[inline(always)]
    pub(in crate::simulate) fn sin_cos(&self, angle: f64) -> (f64, f64) {
        let turn = angle - self.angle;
        if turn.abs() > REACH_RAD || turn.is_nan() {
            return libm::sincos(angle);
        }
        let square = turn * turn;
        let sin = turn * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square / 5040.0)));
        // 1 − cos, so that no digits are lost.
        let fall = square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)));
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
}
