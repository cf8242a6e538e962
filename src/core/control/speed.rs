//! Speed of one motor with its wheel in the air (Figures 6, 7).

use crate::friction::Feedforward;

/// PI control of a motor's speed in torque mode, with optional friction feedforward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedPi {
    /// kp, N m s/rad.
    pub proportional_nm_s_rad: f64,
    /// ki, N m/rad.
    pub integral_nm_rad: f64,
    /// Friction that is fed forward at the measured speed (Eq. 29).
    pub feedforward: Option<Feedforward>,
    /// Largest torque, N m; infinite if unlimited.
    pub torque_limit_nm: f64,
}

/// What [`SpeedPi`] remembers from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpeedPiState {
    /// Integral of the speed's error, rad.
    pub integral_rad: f64,
}

impl SpeedPi {
    /// Torque of the motor, N m: kp e + ki ∫e dt + τ_f(q̇) with e = target − measured, within the limit; 0,
    /// and nothing remembered of the tick, where a measurement is not a number.
    ///
    /// Against windup the integral stands still at the limit, unless the error leads away from it.
    pub fn step(&self, state: &mut SpeedPiState, target_rad_s: f64, measured_rad_s: f64, dt_s: f64) -> f64 {
        let error = target_rad_s - measured_rad_s;
        let friction = self.feedforward.map_or(0.0, |feedforward| feedforward.torque_nm(measured_rad_s));
        let torque = |integral_rad: f64| {
            self.proportional_nm_s_rad * error + self.integral_nm_rad * integral_rad + friction
        };
        let limit = self.torque_limit_nm.max(0.0);
        let next_rad = state.integral_rad + error * dt_s;
        let asked = torque(next_rad);
        if !asked.is_finite() {
            return 0.0;
        }
        let winds_up = asked.abs() > limit && asked * error > 0.0;
        if !winds_up {
            state.integral_rad = next_rad;
        }
        torque(state.integral_rad).clamp(-limit, limit)
    }
}
