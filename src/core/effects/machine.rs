//! Machine that effects act on.

use crate::model::{AxisModel, AxisParameters, MachineKind, RobotModel, RobotParameters};

/// The declared numbers that the size of an effect depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Its kind.
    pub kind: MachineKind,
    /// The robot's parameters; of a bench only the wheel's.
    pub parameters: RobotParameters,
}

impl Machine {
    /// A robot on its wheels.
    pub fn robot(robot: &RobotModel) -> Self {
        Self { kind: MachineKind::Robot, parameters: robot.parameters }
    }

    /// One wheel of a robot in the air.
    pub fn wheel_in_air(robot: &RobotModel) -> Self {
        Self { kind: MachineKind::Rotary, parameters: robot.parameters }
    }

    /// A motor or a carriage.
    pub fn axis(axis: &AxisModel) -> Self {
        let (kind, moved) = match axis.parameters {
            AxisParameters::Rotary { inertia_kg_m2, .. } => (MachineKind::Rotary, inertia_kg_m2),
            AxisParameters::Linear { mass_kg, .. } => (MachineKind::Linear, mass_kg),
        };
        Self { kind, parameters: RobotParameters { wheel_inertia_kg_m2: moved, ..NO_BODY } }
    }

    /// (M + 2m) g: weight of all of a robot, N.
    pub fn weight_n(&self) -> f64 {
        let p = &self.parameters;
        (p.body_mass_kg + 2.0 * p.wheel_mass_kg) * p.gravity_m_s2
    }
}

/// A lone shaft.
const NO_BODY: RobotParameters = RobotParameters {
    body_mass_kg: 0.0,
    wheel_mass_kg: 0.0,
    wheel_inertia_kg_m2: 0.0,
    wheel_radius_m: 1.0,
    com_height_m: 0.0,
    body_inertia_kg_m2: 0.0,
    gravity_m_s2: crate::model::STANDARD_GRAVITY_M_S2,
};
