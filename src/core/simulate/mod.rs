//! The simulated robot: a plant with sticking friction, the paper's sensors, and its experiments.
//!
//! Sine, exponential and the like come from `libm`, not from the system, whose last bit differs between
//! processors: sticking, rounding sensors and an unstable body would make another path of it within
//! seconds, and a run is to be the same everywhere.

mod actuator;
mod balance_run;
mod bench_plant;
mod bench_run;
mod change;
mod experiment;
mod motors;
mod noise;
mod planar;
mod plant;
mod recovery;
mod robot;
mod scenario;
mod sensors;
mod simulation;
mod statistics;
mod tracking;

pub use crate::control::SpeedGains;
pub use actuator::Actuator;
pub use balance_run::{Run, TimedPose};
pub use bench_plant::BenchPlant;
pub use bench_run::BenchRun;
pub use experiment::{ControllerChoice, Experiment, ExperimentError, Outcome, Push, run};
pub(crate) use noise::Noise;
pub use planar::{Forcing, PlanarPlant, Trial, TrialOutcome, advance_batch, monte_carlo};
pub use plant::{Followed, Plant, Pose};
pub use recovery::{Recovery, largest_pitch, recovery};
pub use robot::SimulatedRobot;
pub use scenario::{Scenario, UnknownScenario};
pub use simulation::{
    Command, FALL_PITCH_RAD, Fall, NotFinite, Simulation, SimulationError, SimulationSettings, TICK_S,
};
pub use statistics::{Statistics, Summary};
pub use tracking::StepResponse;

#[cfg(test)]
mod bench_tests;
#[cfg(test)]
mod experiment_tests;
#[cfg(test)]
mod recovery_tests;
#[cfg(test)]
mod tests;
