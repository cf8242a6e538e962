//! LQR design: weights, Riccati equation, gain, cost, poles and residual.

mod weights;

pub use weights::Weights;
