//! Controllers: one pure step from measurements to motor torques.
//!
//! LQR is u = K (X̃ − X) (Eqs. 13, 26); FLQR adds each motor's friction at its measured speed (Eq. 29). Both
//! hold the heading. Torques are those of the two motor shafts, left then right, N m, and drive the robot
//! forward when positive. A single motor on a bench is held at a speed by PI. [`drive`] puts a real robot under a
//! controller.

mod balance;
pub mod drive;
pub mod gate;
mod odometry;
mod program;
mod schedule;
mod speed;
mod yaw;

pub use balance::{BalanceController, ControlError, ControllerKind, DEFAULT_COMPENSATION, Reference};
pub use odometry::{Measurement, Odometry};
pub use program::{SpeedProgram, SpeedRun};
pub use schedule::{GainSchedule, ScheduleError, ScheduleNode};
pub use speed::{SpeedGains, SpeedPi, SpeedPiState};
pub use yaw::{default_yaw_hold, yaw_inertia_kg_m2};

#[cfg(test)]
mod tests;
