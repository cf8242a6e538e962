//! The robot in one plane: both wheels turn together, the ground is level.

mod batch;
mod lanes;
mod laws;
pub(super) mod near_angle;
mod number;
mod plant;
pub(super) mod sliding;

pub use batch::advance_batch;
pub use plant::{Forcing, PlanarPlant};
