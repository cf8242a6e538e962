//! Parameters beyond the planar model: both wheels apart, and the turning body.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, not_negative, positive};

/// Keys of the model file's `[chassis]` table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Chassis {
    /// Distance between the wheels, m. Default: 0.40 (assumed).
    pub track_width_m: f64,
    /// Body about the vertical through its centre of mass, kg m². Default: 0.15 (assumed: 12.5 kg in a
    /// box 0.3 m wide and 0.24 m long, M (a² + b²)/12).
    pub yaw_inertia_kg_m2: f64,
}

impl Default for Chassis {
    fn default() -> Self {
        Self { track_width_m: 0.40, yaw_inertia_kg_m2: 0.15 }
    }
}

impl Chassis {
    /// Refuses widths and inertias that are not finite and above zero.
    pub fn validate(&self) -> Result<(), ParameterError> {
        positive("track_width_m", self.track_width_m)?;
        positive("yaw_inertia_kg_m2", self.yaw_inertia_kg_m2)
    }
}

/// Torque about the vertical that keeps the heading, keys of the model file's `[yaw_hold]` table:
/// −stiffness · ψ − damping · ψ̇, carried by both motors in equal and opposite shares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YawHold {
    /// Torque of one motor for each radian off the heading, N m/rad.
    pub stiffness_nm_rad: f64,
    /// Torque of one motor for each rad/s of yaw rate, N m s/rad.
    pub damping_nm_s_rad: f64,
}

impl YawHold {
    /// Refuses gains that are not finite or below zero.
    pub fn validate(&self) -> Result<(), ParameterError> {
        not_negative("stiffness_nm_rad", self.stiffness_nm_rad)?;
        not_negative("damping_nm_s_rad", self.damping_nm_s_rad)
    }
}
