//! The robot in one plane: both wheels turn together, the ground is level.

mod laws;
pub(super) mod near_angle;
mod number;
mod plant;
pub(super) mod sliding;

pub use plant::{Forcing, PlanarPlant};
