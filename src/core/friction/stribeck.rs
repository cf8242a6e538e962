//! The Stribeck curve with its six parameters (Eq. 28).

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, finite, not_negative, positive, within};

/// Parameters of Eq. 28 for one rotary motor, keys as in the model file's `[friction.*]` tables.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StribeckParameters {
    /// f_c: level of sliding friction, N m.
    pub coulomb_nm: f64,
    /// f_s: level at which the resting shaft breaks away, N m.
    pub static_nm: f64,
    /// f_v: viscous coefficient, N m s/rad.
    pub viscous_nm_s_rad: f64,
    /// v_s: speed over which static friction fades into sliding friction, rad/s.
    pub stribeck_speed_rad_s: f64,
    /// ξ: shape of that fading, without unit.
    pub stribeck_exponent: f64,
    /// f_p: constant offset, N m.
    pub offset_nm: f64,
}

impl StribeckParameters {
    /// No friction at all.
    pub const NONE: Self = Self {
        coulomb_nm: 0.0,
        static_nm: 0.0,
        viscous_nm_s_rad: 0.0,
        stribeck_speed_rad_s: 1.0,
        stribeck_exponent: 1.0,
        offset_nm: 0.0,
    };
}

/// A Stribeck curve whose parameters have been checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stribeck {
    parameters: StribeckParameters,
}

impl Stribeck {
    /// Checks the parameters: levels and viscous coefficient not negative, speed and exponent above zero
    /// (at zero Eq. 28 is singular or f_s has no effect), exponent at most 10.
    ///
    /// ```
    /// use flqr_core::friction::{Stribeck, StribeckParameters};
    ///
    /// let friction = Stribeck::new(StribeckParameters { coulomb_nm: 0.2, static_nm: 0.3, ..StribeckParameters::NONE })?;
    /// assert!((friction.torque_nm(50.0) - 0.2).abs() < 1e-12);
    /// assert_eq!(friction.torque_nm(-50.0), -friction.torque_nm(50.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(parameters: StribeckParameters) -> Result<Self, ParameterError> {
        not_negative("coulomb_nm", parameters.coulomb_nm)?;
        not_negative("static_nm", parameters.static_nm)?;
        not_negative("viscous_nm_s_rad", parameters.viscous_nm_s_rad)?;
        positive("stribeck_speed_rad_s", parameters.stribeck_speed_rad_s)?;
        within(
            "stribeck_exponent",
            parameters.stribeck_exponent,
            f64::MIN_POSITIVE..=10.0,
            "above 0, at most 10",
        )?;
        finite("offset_nm", parameters.offset_nm)?;
        Ok(Self { parameters })
    }

    /// The six parameters.
    pub fn parameters(&self) -> &StribeckParameters {
        &self.parameters
    }

    /// τ_f(q̇), N m (Eq. 28); f_p at q̇ = 0.
    pub fn torque_nm(&self, motor_speed_rad_s: f64) -> f64 {
        let p = &self.parameters;
        let direction = if motor_speed_rad_s == 0.0 { 0.0 } else { motor_speed_rad_s.signum() };
        self.amplitude_nm(motor_speed_rad_s) * direction
            + p.viscous_nm_s_rad * motor_speed_rad_s
            + p.offset_nm
    }

    /// f_c + (f_s − f_c) exp(−(|q̇|/v_s)^ξ), N m: Eq. 28 without direction, viscous part and offset.
    pub fn amplitude_nm(&self, motor_speed_rad_s: f64) -> f64 {
        let p = &self.parameters;
        let ratio = motor_speed_rad_s.abs() / p.stribeck_speed_rad_s;
        let fading = libm::exp(-libm::pow(ratio, p.stribeck_exponent));
        p.coulomb_nm + (p.static_nm - p.coulomb_nm) * fading
    }

    /// dτ_f/dq̇, N m s/rad; at q̇ = 0 its limit from above, which may be infinite.
    pub fn slope_nm_s_rad(&self, motor_speed_rad_s: f64) -> f64 {
        let p = &self.parameters;
        let drop = p.static_nm - p.coulomb_nm;
        if drop == 0.0 {
            return p.viscous_nm_s_rad;
        }
        let ratio = motor_speed_rad_s.abs() / p.stribeck_speed_rad_s;
        let exponent = p.stribeck_exponent;
        let steepness = exponent * libm::pow(ratio, exponent - 1.0) / p.stribeck_speed_rad_s;
        p.viscous_nm_s_rad - drop * libm::exp(-libm::pow(ratio, exponent)) * steepness
    }

    /// The torques that hold a resting shaft, N m: [f_p − f_s, f_p + f_s].
    pub fn stick_range_nm(&self) -> std::ops::RangeInclusive<f64> {
        let p = &self.parameters;
        p.offset_nm - p.static_nm..=p.offset_nm + p.static_nm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Left motor of the paper's Table 4.
    const LEFT: StribeckParameters = StribeckParameters {
        coulomb_nm: 0.0338,
        static_nm: 0.0761,
        viscous_nm_s_rad: 4.9e-4,
        stribeck_speed_rad_s: 1.612,
        stribeck_exponent: 0.2310,
        offset_nm: -0.0016,
    };

    /// Values of Eq. 28 computed with 40 digits (mpmath) for the left motor.
    #[test]
    fn curve_agrees_with_forty_digit_reference() {
        let curve = Stribeck::new(LEFT).unwrap();
        for (speed, expected) in
            [(0.2, 0.05511002006936824), (-5.0, -0.04939129942245844), (50.0, 0.06133636013915115)]
        {
            let found: f64 = curve.torque_nm(speed);
            assert!((found - expected).abs() < 1e-16, "at {speed} rad/s: {found} for {expected}");
        }
    }

    #[test]
    fn at_rest_the_value_is_the_offset_and_the_slope_follows_the_exponent() {
        let curve =
            |stribeck_exponent| Stribeck::new(StribeckParameters { stribeck_exponent, ..LEFT }).unwrap();
        assert_eq!(curve(0.5).torque_nm(0.0), LEFT.offset_nm);
        assert_eq!(curve(0.5).slope_nm_s_rad(0.0), f64::NEG_INFINITY);
        assert_eq!(
            curve(1.0).slope_nm_s_rad(0.0),
            LEFT.viscous_nm_s_rad - (LEFT.static_nm - LEFT.coulomb_nm) / LEFT.stribeck_speed_rad_s
        );
        assert_eq!(curve(2.0).slope_nm_s_rad(0.0), LEFT.viscous_nm_s_rad);
    }

    #[test]
    fn slope_is_the_derivative_of_the_curve() {
        let curve = Stribeck::new(LEFT).unwrap();
        for speed in [-20.0, -0.3, 0.05, 1.0, 40.0] {
            let step = 1e-6 * f64::abs(speed);
            let difference = (curve.torque_nm(speed + step) - curve.torque_nm(speed - step)) / (2.0 * step);
            let slope = curve.slope_nm_s_rad(speed);
            assert!((difference - slope).abs() < 1e-6 * slope.abs().max(1e-3), "{difference} {slope}");
        }
    }

    #[test]
    fn singular_parameters_are_refused() {
        for broken in [
            StribeckParameters { stribeck_speed_rad_s: 0.0, ..LEFT },
            StribeckParameters { stribeck_exponent: 0.0, ..LEFT },
            StribeckParameters { coulomb_nm: -0.1, ..LEFT },
            StribeckParameters { offset_nm: f64::NAN, ..LEFT },
        ] {
            assert!(Stribeck::new(broken).is_err(), "{broken:?}");
        }
    }
}
