//! Friction and inertia from logs.

mod exp2;
pub mod filter;
mod linear;
pub mod motion;
mod parameters;
mod polish;
mod samples;
mod search_box;
mod swarm;

pub use search_box::{Bounds, SearchBox};
pub use swarm::{Pso, PsoProgress, PsoSettings};

/// One point of the friction curve: means over a stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionPair {
    /// Mean speed of the motor shaft, rad/s.
    pub speed_rad_s: f64,
    /// Mean torque that held it, N m: the friction torque (Eq. 31).
    pub torque_nm: f64,
}
