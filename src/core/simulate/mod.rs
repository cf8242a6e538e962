//! The simulated robot: a plant with sticking friction, the paper's sensors, and its experiments.
//!
//! Sine, exponential and the like come from `libm`, not from the system, whose last bit differs between
//! processors: sticking, rounding sensors and an unstable body would make another path of it within
//! seconds, and a run is to be the same everywhere.

mod actuator;
mod bench_plant;
mod change;
mod ground;
mod noise;
mod planar;
mod plant;
mod response;
mod sample;
mod scenario;
mod sensors;
mod simulation;
mod statistics;

pub use actuator::Actuator;
pub use bench_plant::BenchPlant;
pub use ground::Ground;
pub use planar::{Forcing, PlanarPlant, advance_batch};
pub use plant::{Plant, Pose};
pub use response::predicted_response;
pub use sample::Sample;
pub use scenario::{Push, Run, Scenario, UnknownScenario};
pub use sensors::SensorSettings;
pub use simulation::{FALL_PITCH_RAD, Fall, Simulation, SimulationError, SimulationSettings, TICK_S};
pub use statistics::{Statistics, Summary};

#[cfg(test)]
mod tests;
