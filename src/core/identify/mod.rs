//! Identification: parameters from recordings.
//!
//! Two questions, chosen by what the log holds ([`fit`]):
//! - Constant speeds, staircases and files of pairs give the six parameters of the Stribeck curve (Eq. 28):
//!   [`pairs_from_log`] makes the pairs of section 3.1, [`Pso`] searches as Algorithm 1, variable projection
//!   polishes to the optimum, and profile likelihood gives the intervals.
//! - Any other motion of one axis gives inertia or mass and friction ([`motion`]).
//!
//! [`crate::excitation`] has the motions that such logs are recorded with.
//!
//! | symbol of the paper | here |
//! |---|---|
//! | q̇̄, τ̄_f | [`FrictionPair`] |
//! | e (Eq. 32) | [`FitReport::rmse`], root of the mean of squares |
//! | M, c₁, c₂, ω_s, ω_e, α, T | [`PsoSettings`] |
//! | x_min, x_max | [`SearchBox`] |
//! | K (section 3.1) | edge samples, a tenth of a dwell |

mod error;
mod exp2;
mod fit;
mod identifiability;
mod intervals;
mod linear;
pub mod motion;
mod pairs;
mod parameters;
mod polish;
mod report;
mod samples;
mod search_box;
mod staircase;
#[cfg(test)]
mod staircase_tests;
mod stribeck;
#[cfg(test)]
mod stribeck_tests;
mod swarm;
#[cfg(test)]
mod test_data;

pub use error::FitError;
pub use fit::fit;
pub use pairs::{Dwell, PairSet, pairs_from_log};
pub use report::{Estimate, FitReport, StopReason};
pub use search_box::{Bounds, SearchBox};
pub use stribeck::{fit_pairs, polish_pairs};
pub use swarm::{Pso, PsoProgress, PsoSettings};

use serde::Serialize;

use crate::friction::StribeckParameters;

/// One point of the friction curve: means over a stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrictionPair {
    /// Mean speed of the motor shaft, rad/s.
    pub speed_rad_s: f64,
    /// Mean torque that held it, N m: the friction torque (Eq. 31).
    pub torque_nm: f64,
}

/// Search method for the six parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The swarm, then the polish to the optimum, then intervals.
    #[default]
    Best,
    /// The paper's swarm alone: no polish and, because its result is not an optimum, no intervals.
    Pso,
}

/// Options of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Search method for the six parameters.
    pub method: Method,
    /// Bounds of the search.
    pub bounds: Bounds,
    /// Parameters to free in fits from motion, keys as in the model file, or `all`. Naming `inertia_kg_m2` or
    /// `mass_kg` asks for such a fit also where a log of a bench holds constant speeds; these give all six
    /// parameters whichever are named.
    pub estimate: Vec<String>,
    /// Seed of the swarm.
    pub seed: u64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { method: Method::Best, bounds: Bounds::Data, estimate: Vec::new(), seed: 1 }
    }
}

/// A fit on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitProgress {
    /// Iterations done.
    pub iteration: usize,
    /// Iterations at most.
    pub iterations: usize,
    /// Best error so far, unit as the report's; NaN as long as it is unknown.
    pub best_error: f64,
    /// The parameters that have it, where the fit is one of the Stribeck curve.
    pub best: Option<StribeckParameters>,
}
