//! Effects that a declared model may lack: each with its name, its physics, its units and the experiment that shows it.
//!
//! An effect is data and one law. The same law gives the simulator's force, the estimator's column, at unit amplitude
//! over the rows of a log, and the torque that a controller adds to cancel it.
//!
//! # To add one
//! A static [`EffectKind`] in a file of this room and a line in [`KINDS`]: model files, simulator, estimator and tests
//! take it from there.

mod acting;
mod actuator;
mod body;
mod effect;
mod feedforward;
mod friction;
mod harmonics;
mod kind;
mod law;
mod machine;
mod parameters;
mod sensors;
mod surroundings;

pub use acting::RobotLaws;
pub use effect::{EffectError, EffectLaw};
pub use feedforward::EffectFeedforward;
pub use kind::{
    Declared, EffectKind, Feedforward, Form, Grid, Parameter, Place, Role, Signal, Step, Trial,
    name_and_unit, unit_of,
};
pub use law::{Action, Law, MotionSample, Term};
pub use machine::Machine;

pub(crate) use friction::{COULOMB_ERROR, FRICTION_ASYMMETRY, VISCOUS_ERROR};
pub(crate) use parameters::INERTIA_ERROR;

/// Every effect of the library.
pub static KINDS: [&EffectKind; 35] = [
    &harmonics::COGGING,
    &harmonics::TORQUE_RIPPLE,
    &harmonics::POSITION_DEPENDENT_FRICTION,
    &friction::QUADRATIC_DRAG,
    &friction::VISCOUS_ASYMMETRY,
    &friction::FRICTION_ASYMMETRY,
    &friction::COULOMB_ERROR,
    &friction::VISCOUS_ERROR,
    &friction::LOW_SPEED_FRICTION,
    &friction::LOAD_DEPENDENT_FRICTION,
    &friction::PRESLIDING,
    &friction::THERMAL_FRICTION,
    &actuator::BACKLASH,
    &actuator::COMMAND_DELAY,
    &actuator::ACTUATOR_LAG,
    &actuator::TORQUE_GAIN,
    &actuator::TORQUE_SATURATION,
    &actuator::TORQUE_DEADZONE,
    &parameters::INERTIA_ERROR,
    &parameters::MASS_ERROR,
    &parameters::COM_HEIGHT_ERROR,
    &parameters::BODY_INERTIA_ERROR,
    &body::PITCH_OFFSET,
    &body::STRUCTURAL_MODE,
    &body::SLOSH,
    &surroundings::GROUND_SLOPE,
    &surroundings::TETHER_SPRING,
    &surroundings::AERO_DRAG,
    &surroundings::ROLLING_RESISTANCE,
    &surroundings::WHEEL_ECCENTRICITY,
    &surroundings::WHEEL_SLIP,
    &surroundings::TERRAIN,
    &surroundings::EXTERNAL_PUSH,
    &sensors::GYRO_BIAS,
    &sensors::IMU_DELAY,
];

/// Those that are named before all others where several tell a log as well, in their order.
pub(crate) static PREFERRED: [&EffectKind; 8] = [
    &parameters::INERTIA_ERROR,
    &friction::VISCOUS_ERROR,
    &friction::COULOMB_ERROR,
    &harmonics::COGGING,
    &friction::QUADRATIC_DRAG,
    &friction::VISCOUS_ASYMMETRY,
    &friction::FRICTION_ASYMMETRY,
    &actuator::COMMAND_DELAY,
];

/// The effect with an id; none where the library has no such effect.
///
/// ```
/// use flqr_core::effects::kind;
/// use flqr_core::model::MachineKind;
///
/// let cogging = kind("cogging").ok_or("unknown effect")?;
/// assert!(cogging.is_on(MachineKind::Robot) && cogging.per_motor());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn kind(id: &str) -> Option<&'static EffectKind> {
    KINDS.iter().copied().find(|kind| kind.id == id)
}

#[cfg(test)]
mod tests;
