//! Effects that a declared model may lack: each with its name, its physics, its units and the experiment that shows it.
//!
//! An effect is data and one law. The same law gives the simulator's force, the estimator's column, at unit amplitude
//! over the rows of a log, and the torque that a controller adds to cancel it.
//!
//! # To add one
//! A static [`EffectKind`] in a file of this room and a line in [`KINDS`]: model files, simulator, estimator and tests
//! take it from there.

mod effect;
mod friction;
mod harmonics;
mod kind;
mod law;
mod machine;

pub use effect::{Effect, EffectError, EffectLaw};
pub use kind::{Declared, EffectKind, Feedforward, Parameter, Place, Role, unit_of};
pub use law::{Action, Law, Moment, Term};
pub use machine::{Machine, MachineKind};

/// Every effect of the library.
pub static KINDS: [&EffectKind; 8] = [
    &harmonics::COGGING,
    &harmonics::TORQUE_RIPPLE,
    &harmonics::POSITION_DEPENDENT_FRICTION,
    &friction::QUADRATIC_DRAG,
    &friction::VISCOUS_ASYMMETRY,
    &friction::FRICTION_ASYMMETRY,
    &friction::COULOMB_ERROR,
    &friction::VISCOUS_ERROR,
];

/// The effect with an id; none where the library has no such effect.
pub fn kind(id: &str) -> Option<&'static EffectKind> {
    KINDS.iter().copied().find(|kind| kind.id == id)
}

#[cfg(test)]
mod tests;
