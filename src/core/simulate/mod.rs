//! The simulated robot: a plant with sticking friction, the paper's sensors, and its experiments.

mod near_angle;
mod noise;
mod plant;
mod response;
mod sample;
mod scenario;
mod sensors;
mod simulation;
mod sliding;
mod statistics;

pub use plant::{Forcing, Plant};
pub use response::predicted_response;
pub use sample::Sample;
pub use scenario::{Push, Run, Scenario, UnknownScenario};
pub use sensors::SensorSettings;
pub use simulation::{FALL_PITCH_RAD, Fall, Simulation, SimulationError, SimulationSettings, TICK_S};
pub use statistics::{Statistics, Summary};

#[cfg(test)]
mod tests;
