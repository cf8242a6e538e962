//! LQR design: weights, Riccati equation, gain, cost, poles and residual; margins of the sampled loop.

mod balance;
mod care;
mod checks;
mod design;
mod diagnosis;
mod disturbance;
mod double_double;
mod doubling;
mod error;
mod input;
mod margins;
mod newton;
mod placement;
mod poles;
mod real;
mod running;
mod sampled_loop;
mod search;
mod sign;
mod square;
#[cfg(test)]
mod tests;

pub use care::{CareInput, CareSolution, solve_care};
pub use design::{LqrDesign, design};
pub use disturbance::Disturbance;
pub use error::{CareError, DesignError};
pub use margins::{Margins, SampledLoop, margins};
pub use placement::{Placement, weights_for_pole};
pub use running::{SampledPole, SampledResponse, damping, sampled_poles, sampled_response};
