//! Whether IMU and encoders count the same way, from a robot that is rocked on its wheels.
//!
//! With the wheels on the ground and not rolling, a body that leans forward by Δθ turns each motor, whose angle is the
//! wheel's less the body's, by Δq = −Δθ. The slope of q over θ tells the rest: +1 where a direction is reversed, and
//! four times too much or too little where the encoder's steps are those of another batch.

/// Readings fade from the regression with this time constant, s: rocking that went wrong is soon forgotten.
const MEMORY_S: f64 = 4.0;
/// Least deviation of the pitch, rad: that of a swing of 0.05 rad from end to end.
const LEAST_DEVIATION_RAD: f64 = 0.05 / 2.0 / std::f64::consts::SQRT_2;
/// Least correlation of motor angle and pitch.
const LEAST_CORRELATION: f64 = 0.9;

/// What the slope of a motor's angle over the pitch says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Slope {
    /// The body has not been rocked far enough.
    Unknown,
    /// About −1.
    Right,
    /// About +1.
    Reversed,
    /// About ±4 or ±1/4.
    EncoderScale(f64),
    /// The motor does not turn with the body: rolling wheels, or wheels in the air.
    Unclear,
}

/// Regression of both motor angles over the pitch, newest readings first in weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Rocking {
    weight: f64,
    pitch: f64,
    pitch_squared: f64,
    angle: [f64; 2],
    angle_squared: [f64; 2],
    product: [f64; 2],
}

impl Rocking {
    /// Takes readings that are `dt_s` later than those before.
    pub(super) fn add(&mut self, dt_s: f64, pitch_rad: f64, angle_rad: [f64; 2]) {
        let keep = libm::exp(-dt_s / MEMORY_S);
        let fade = |sum: &mut f64, value: f64| *sum = keep * *sum + value;
        fade(&mut self.weight, 1.0);
        fade(&mut self.pitch, pitch_rad);
        fade(&mut self.pitch_squared, pitch_rad * pitch_rad);
        for (motor, angle) in angle_rad.into_iter().enumerate() {
            fade(&mut self.angle[motor], angle);
            fade(&mut self.angle_squared[motor], angle * angle);
            fade(&mut self.product[motor], pitch_rad * angle);
        }
    }

    /// What both slopes say.
    pub(super) fn slopes(&self) -> [Slope; 2] {
        [0, 1].map(|motor| self.slope(motor))
    }

    fn slope(&self, motor: usize) -> Slope {
        if self.weight == 0.0 {
            return Slope::Unknown;
        }
        let covariance = |product: f64, a: f64, b: f64| (product - a * b / self.weight) / self.weight;
        let pitch = covariance(self.pitch_squared, self.pitch, self.pitch);
        if pitch < LEAST_DEVIATION_RAD * LEAST_DEVIATION_RAD {
            return Slope::Unknown;
        }
        let angle = covariance(self.angle_squared[motor], self.angle[motor], self.angle[motor]);
        let both = covariance(self.product[motor], self.pitch, self.angle[motor]);
        let slope = both / pitch;
        if both.abs() < LEAST_CORRELATION * (pitch * angle).sqrt() {
            return Slope::Unclear;
        }
        match slope.abs() {
            0.6..1.6 if slope < 0.0 => Slope::Right,
            0.6..1.6 => Slope::Reversed,
            0.2..0.3 | 3.2..4.8 => Slope::EncoderScale(slope.abs()),
            _ => Slope::Unclear,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slopes after `seconds` of rocking by ± `swing` rad every 3 s, with motors that turn by `slopes` times the
    /// pitch, over a robot that rolls at `rolling` rad/s.
    fn rocked(swing: f64, slopes: [f64; 2], rolling: f64, seconds: f64) -> [Slope; 2] {
        let mut rocking = Rocking::default();
        for tick in 0..(seconds * 200.0) as u32 {
            let time = f64::from(tick) / 200.0;
            let pitch = swing * (std::f64::consts::TAU * time / 3.0).sin();
            rocking.add(0.005, pitch, slopes.map(|slope| 0.3 + slope * pitch + rolling * time));
        }
        rocking.slopes()
    }

    #[test]
    fn slopes_name_what_is_reversed() {
        use Slope::{EncoderScale, Reversed, Right, Unclear, Unknown};
        let tells = |found: Slope, expected: Slope| match (found, expected) {
            (EncoderScale(a), EncoderScale(b)) => (a - b).abs() < 0.01,
            _ => found == expected,
        };
        for (swing, slopes, rolling, expected) in [
            (0.1, [-1.0, -1.0], 0.0, [Right, Right]),
            (0.03, [-1.0, -1.0], 0.0, [Right, Right]),
            (0.02, [-1.0, -1.0], 0.0, [Unknown, Unknown]),
            (0.1, [1.0, 1.0], 0.0, [Reversed, Reversed]),
            (0.1, [-1.0, 1.0], 0.0, [Right, Reversed]),
            (0.1, [-0.25, -4.0], 0.0, [EncoderScale(0.25), EncoderScale(4.0)]),
            (0.1, [0.0, -1.0], 0.0, [Unclear, Right]),
            (0.1, [-1.0, -1.0], 0.3, [Unclear, Unclear]),
        ] {
            let found = rocked(swing, slopes, rolling, 9.0);
            let right = found.into_iter().zip(expected).all(|(found, expected)| tells(found, expected));
            assert!(right, "{swing} {slopes:?} {rolling}: {found:?}");
        }
    }
}
