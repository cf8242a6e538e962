//! A single motor or carriage on a bench.

use super::Effect;
use crate::friction::Stribeck;

/// A single axis on a bench.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisModel {
    /// Moving mass and its friction.
    pub parameters: AxisParameters,
    /// Lowest and highest speed of the motion from which its friction was told, rad/s or m/s; `None` if nobody said.
    pub fitted_speed_range: Option<[f64; 2]>,
    /// Further effects; errors of the parameters above are corrected there instead.
    pub effects: Vec<Effect>,
}

impl AxisModel {
    /// An axis without further effects.
    pub fn new(parameters: AxisParameters) -> Self {
        Self { parameters, fitted_speed_range: None, effects: Vec::new() }
    }
}

/// Motor or axis on a bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisParameters {
    /// A motor shaft.
    Rotary {
        /// Inertia about the shaft, kg m².
        inertia_kg_m2: f64,
        /// Load = this × sin(angle), angle 0 hanging down, N m; 0 for a balanced shaft.
        gravity_torque_nm: f64,
        /// Friction on the shaft.
        friction: Option<Stribeck>,
    },
    /// A carriage.
    Linear {
        /// Moved mass, kg.
        mass_kg: f64,
        /// Friction; its fields hold N, N s/m and m/s in place of N m, N m s/rad and rad/s.
        friction: Option<Stribeck>,
    },
}
