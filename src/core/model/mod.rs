//! The domain types: a robot or an axis, its parameters and dynamics, what is declared of its motors, sensors and
//! surroundings, and the weights of its controller. Nothing here reads or writes files: see [`crate::model_file`].

mod actuation;
mod axis;
mod chassis;
mod dynamics;
mod effect;
mod ground;
mod legs;
mod link;
mod machine_kind;
mod motor;
mod parameters;
mod robot;
mod safety;
mod sensors;
mod surroundings;
mod tolerance;
mod weights;

pub use actuation::{Actuation, LONGEST_DELAY_S, MotorLimits};
pub use axis::{AxisModel, AxisParameters};
pub use chassis::{Chassis, YawHold};
pub use dynamics::{Accelerations, Coefficients, LinearModel, RobotParameters, STANDARD_GRAVITY_M_S2, State};
pub use effect::Effect;
pub use ground::Ground;
pub(crate) use ground::{GroundPath, Under};
pub use legs::{HeightNode, HeightTableError, Legs, OverHeight};
pub use link::{LinkSettings, MotorProtocolName, PitchAxis, StateLayout, TorqueCommand, Turn};
pub use machine_kind::MachineKind;
pub use motor::Motor;
pub use parameters::{ModelParameter, PARAMETERS, ParameterPlace, ToleranceGroup};
pub use robot::RobotModel;
pub use safety::{SafetyLimits, StopAction};
pub use sensors::{SensorSettings, TICK_S};
pub use surroundings::{Payload, Surroundings, Tether};
pub use tolerance::Tolerances;
pub(crate) use tolerance::tolerance_keys;
pub use weights::Weights;

/// A loaded model.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Name for people.
    pub name: String,
    /// Machine.
    pub rig: Rig,
    /// Tolerances of its parameters.
    pub tolerance: Tolerances,
}

/// Machine that a model describes.
#[derive(Clone, Debug, PartialEq)]
pub enum Rig {
    /// A wheel-legged robot.
    Robot(Box<RobotModel>),
    /// A single motor or linear axis.
    Axis(AxisModel),
}

impl Model {
    /// The robot, where the model is one.
    pub fn robot(&self) -> Option<&RobotModel> {
        match &self.rig {
            Rig::Robot(robot) => Some(robot),
            Rig::Axis(_) => None,
        }
    }
}
