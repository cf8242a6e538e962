//! The robot in one plane: both wheels turn together, the ground is level.

mod batch;
mod lanes;
mod laws;
mod monte_carlo;
pub(super) mod near_angle;
mod number;
mod plant;
mod running;
pub(super) mod sliding;

pub use batch::advance_batch;
pub use monte_carlo::{Trial, TrialOutcome, monte_carlo};
pub use plant::{Forcing, PlanarPlant};
