//! Speed of one motor with its wheel in the air (Figures 6, 7).

use serde::Serialize;

use crate::friction::Feedforward;
use crate::model::TICK_S;

/// Gains of the speed control, as the paper's kp and ki.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedGains {
    /// kp, N m s/rad.
    pub kp: f64,
    /// ki, N m/rad.
    pub ki: f64,
}

impl SpeedGains {
    /// The paper's first pair (Figures 6a, 7a).
    pub const PAPER: Self = Self { kp: 0.5, ki: 0.05 };

    /// For constant speeds: with a crossover of 80 rad/s the shaft turns at 0.1 rad/s although friction falls
    /// with speed there, 4 ms of delay cost 0.3 rad of phase, and an error is gone within 0.1 s.
    pub fn firm(inertia_kg_m2: f64) -> Self {
        Self { kp: 80.0 * inertia_kg_m2, ki: 1600.0 * inertia_kg_m2 }
    }

    /// Keeps the mean speed near its target and leaves the shaft to an excitation.
    pub fn loose(inertia_kg_m2: f64) -> Self {
        Self { kp: 20.0 * inertia_kg_m2, ki: 20.0 * inertia_kg_m2 }
    }

    /// Crossover frequency of the loop with an inertia, rad/s: |kp + ki/(jω)| = I ω.
    pub(crate) fn crossover_rad_s(self, inertia_kg_m2: f64) -> f64 {
        let (p, i) = (self.kp / inertia_kg_m2, self.ki / inertia_kg_m2);
        (0.5 * (p * p + (p * p * p * p + 4.0 * i * i).sqrt())).sqrt()
    }

    /// Phase margin of the loop with an inertia and a delay, half a tick of which is the hold's, rad: not above
    /// 0 where the loop is unstable, π without any gain.
    pub(crate) fn phase_margin_rad(self, inertia_kg_m2: f64, delay_s: f64) -> f64 {
        let crossover = self.crossover_rad_s(inertia_kg_m2);
        if crossover == 0.0 {
            return std::f64::consts::PI;
        }
        libm::atan2(self.kp * crossover, self.ki) - crossover * (delay_s + 0.5 * TICK_S)
    }
}

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

/// State of [`SpeedPi`].
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
    ///
    /// ```
    /// use flqr_core::control::{SpeedPi, SpeedPiState};
    ///
    /// let control =
    ///     SpeedPi { proportional_nm_s_rad: 0.1, integral_nm_rad: 1.0, feedforward: None, torque_limit_nm: 0.3 };
    /// let mut state = SpeedPiState::default();
    /// assert!((control.step(&mut state, 2.0, 0.0, 0.001) - 0.2).abs() < 0.01);
    /// assert_eq!(control.step(&mut state, 9.0, 0.0, 0.001), 0.3); // limited
    /// ```
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
