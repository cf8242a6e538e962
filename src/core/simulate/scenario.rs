//! The paper's balance experiments on the simulated robot.

use std::ops::ControlFlow;
use std::str::FromStr;

use super::sample::Sample;
use super::simulation::{Fall, Simulation, SimulationError, SimulationSettings, TICK_S};
use super::statistics::Statistics;
use crate::ParameterError;
use crate::control::BalanceController;
use crate::model_file::RobotModel;
use crate::parameter::{finite, within};
use crate::robot::State;

/// Longest run, s: an hour, 320 MB of samples.
const MAX_SECONDS: f64 = 3600.0;
/// Pitch at the start of every scenario, rad: the robot is let go nearly upright (assumed).
const START_PITCH_RAD: f64 = 0.05;

/// A push at the body's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Start, s.
    pub start_s: f64,
    /// Force, forward positive, N.
    pub force_n: f64,
    /// Duration, s.
    pub duration_s: f64,
}

impl Push {
    /// The paper's kick comes at 8.5 s (section 4.4); force and duration are not given. Assumed: 30 N for
    /// 0.1 s, which moves the robot about as far as the paper's.
    pub const KICK: Self = Self { start_s: 8.5, force_n: 30.0, duration_s: 0.1 };
}

/// An experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scenario {
    /// Standing on flat ground from a small pitch.
    Flat,
    /// The same with a push.
    Kick(Push),
}

/// A scenario's name that is not known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no scenario {name:?}: choose one of flat, kick")]
pub struct UnknownScenario {
    /// What was asked for.
    pub name: String,
}

impl FromStr for Scenario {
    type Err = UnknownScenario;

    fn from_str(name: &str) -> Result<Self, UnknownScenario> {
        match name {
            "flat" => Ok(Self::Flat),
            "kick" => Ok(Self::Kick(Push::KICK)),
            _ => Err(UnknownScenario { name: name.to_owned() }),
        }
    }
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// What the robot recorded, one row every 1 ms from 0, until the end, a fall or a stop by the watcher.
    pub samples: Vec<Sample>,
    /// Statistics of the samples.
    pub statistics: Statistics,
    /// The fall that ended the run, if there was one.
    pub fall: Option<Fall>,
}

impl Scenario {
    /// Runs the scenario for `seconds` (above 0, at most 3600, rounded to 1 ms) with the settings'
    /// sensors, delay, noise and seed; the initial state is the scenario's own. `watch` sees every sample
    /// and may stop the run.
    ///
    /// # Errors
    /// Robot, settings, push or duration out of range.
    pub fn run(
        &self,
        robot: &RobotModel,
        controller: BalanceController,
        settings: SimulationSettings,
        seconds: f64,
        watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Result<Run, SimulationError> {
        within("seconds", seconds, TICK_S..=MAX_SECONDS, "from 0.001 to 3600")?;
        self.validate()?;
        let initial = State { pitch_rad: START_PITCH_RAD, ..State::default() };
        let mut simulation = Simulation::new(robot, controller, SimulationSettings { initial, ..settings })?;
        let ticks = (seconds / TICK_S).round() as usize;
        let mut samples = Vec::with_capacity(ticks);
        for _ in 0..ticks {
            self.act(&mut simulation);
            let sample = simulation.step();
            samples.push(sample);
            if watch(&sample).is_break() || simulation.fall().is_some() {
                break;
            }
        }
        let fall = simulation.fall().copied();
        let measured = Statistics::of(&samples).expect("a run has at least one sample");
        // The IMU may not have seen the fall that ended the run.
        let fell = measured.fell || fall.is_some();
        let statistics = Statistics { fell, settled: measured.settled && !fell, ..measured };
        Ok(Run { samples, statistics, fall })
    }

    fn validate(&self) -> Result<(), ParameterError> {
        let Self::Kick(push) = self else { return Ok(()) };
        within("start_s", push.start_s, 0.0..=MAX_SECONDS, "from 0 to 3600")?;
        within("duration_s", push.duration_s, 0.0..=MAX_SECONDS, "from 0 to 3600")?;
        finite("force_n", push.force_n)
    }

    fn act(&self, simulation: &mut Simulation) {
        if let Self::Kick(push) = self
            && simulation.time_s() == (push.start_s / TICK_S).round() / 1000.0
        {
            simulation.push(push.force_n, push.duration_s);
        }
    }
}
