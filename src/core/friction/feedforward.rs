//! Friction feedforward u' = u + τ_f(q̇) (Eq. 29), usable at standstill.

use serde::{Deserialize, Serialize};

use super::Stribeck;
use crate::parameter::{ParameterError, positive, within};

/// Feedforward of the identified curve. The paper does not specify q̇ ≈ 0, where a quantised speed
/// dithers and sign(q̇) would chatter; so the direction is smoothed and the whole scaled below one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compensation {
    /// Fraction of the friction that is compensated, 0 to 1.5, without unit.
    pub ratio: f64,
    /// Speed over which the direction turns from −1 to 1: sign(q̇) becomes tanh(q̇ / speed), rad/s.
    pub smoothing_speed_rad_s: f64,
}

impl Compensation {
    /// Refuses a ratio outside of 0 to 1.5 and a smoothing speed that is not above zero.
    pub fn validate(&self) -> Result<(), ParameterError> {
        within("ratio", self.ratio, 0.0..=1.5, "from 0 to 1.5")?;
        positive("smoothing_speed_rad_s", self.smoothing_speed_rad_s)
    }
}

/// Feedforward torque of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedforward {
    curve: Stribeck,
    compensation: Compensation,
}

impl Feedforward {
    /// Joins a curve and a checked compensation.
    pub fn new(curve: Stribeck, compensation: Compensation) -> Result<Self, ParameterError> {
        compensation.validate()?;
        Ok(Self { curve, compensation })
    }

    /// The curve that is fed forward.
    pub fn curve(&self) -> &Stribeck {
        &self.curve
    }

    /// Ratio and smoothing speed.
    pub fn compensation(&self) -> &Compensation {
        &self.compensation
    }

    /// Torque to add to the controller's, N m. At q̇ = 0 it is ratio · f_p with the finite slope
    /// ratio · (f_s / smoothing speed + f_v).
    ///
    /// ```
    /// use flqr_core::friction::{Compensation, Feedforward, Stribeck, StribeckParameters};
    ///
    /// let curve = Stribeck::new(StribeckParameters { coulomb_nm: 0.2, static_nm: 0.2, ..StribeckParameters::NONE })?;
    /// let feedforward = Feedforward::new(curve, Compensation { ratio: 0.8, smoothing_speed_rad_s: 0.1 })?;
    /// assert_eq!(feedforward.torque_nm(0.0), 0.0);
    /// assert!((feedforward.torque_nm(10.0) - 0.16).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn torque_nm(&self, motor_speed_rad_s: f64) -> f64 {
        let p = self.curve.parameters();
        let direction = libm::tanh(motor_speed_rad_s / self.compensation.smoothing_speed_rad_s);
        let friction = self.curve.amplitude_nm(motor_speed_rad_s) * direction
            + p.viscous_nm_s_rad * motor_speed_rad_s
            + p.offset_nm;
        self.compensation.ratio * friction
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::StribeckParameters;

    #[test]
    fn far_above_the_smoothing_speed_it_is_the_ratio_of_the_curve() {
        let curve = Stribeck::new(StribeckParameters {
            coulomb_nm: 0.0406,
            static_nm: 0.0617,
            viscous_nm_s_rad: 4.3e-4,
            stribeck_speed_rad_s: 2.253,
            stribeck_exponent: 0.2772,
            offset_nm: 0.0014,
        })
        .unwrap();
        let feedforward =
            Feedforward::new(curve, Compensation { ratio: 0.9, smoothing_speed_rad_s: 0.02 }).unwrap();
        for speed in [-10.0, 1.0, 30.0] {
            assert!((feedforward.torque_nm(speed) - 0.9 * curve.torque_nm(speed)).abs() < 1e-15);
        }
        assert_eq!(feedforward.torque_nm(0.0), 0.9 * 0.0014);
        assert!(feedforward.torque_nm(0.01) > feedforward.torque_nm(-0.01));
    }
}
