//! Controllers: one pure step from measurements to motor torques.
//!
//! LQR is u = −K X (Eq. 13); FLQR adds each motor's friction at its measured speed (Eq. 29). Torques are
//! those of the two motor shafts, left then right, N m, and drive the robot forward when positive.

mod balance;

pub use balance::{BalanceController, ControlError, ControllerKind, DEFAULT_COMPENSATION, Measurement};

#[cfg(test)]
mod tests;
