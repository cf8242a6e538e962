//! Many closed loops at once: thresholds from clean runs, robustness over the parameters' tolerances.

use std::num::NonZeroUsize;

use super::super::actuator::Actuator;
use super::super::noise::Noise;
use super::super::plant::Plant;
use super::super::scenario::MAX_SECONDS;
use super::super::simulation::{FALL_PITCH_RAD, Fall, TICK_S};
use super::super::statistics::Statistics;
use super::batch::advance_batch;
use super::plant::{Forcing, PlanarPlant};
use super::running::RunningStatistics;
use crate::ParameterError;
use crate::control::{BalanceController, Measurement, Reference};
use crate::model::{RobotModel, State, Surroundings};
use crate::parallel;
use crate::parameter::within;

/// Robots that are simulated side by side: so many that few are left over when vectors are filled, so few that
/// their friction tables stay close to the processor.
const SIDE_BY_SIDE: usize = 64;
/// Integration steps a tick.
const SUBSTEPS: u32 = 10;

/// One robot under control, in its plane: heading, ground, legs and sensors take no part. The effects of its model do,
/// and their feedforward; where they act in one motor alone, the robot turns, and its controller holds the heading.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The robot that moves: its parameters, friction, effects, motors' limits, transport delay and torque noise count.
    pub robot: RobotModel,
    /// The controller, which answers the true state every 1 ms. It need not know the robot's parameters well.
    pub controller: BalanceController,
    /// State at the start; the controller leads it to zero.
    pub initial: State,
    /// Seed of the torque noise.
    pub seed: u64,
}

/// Outcome of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialOutcome {
    /// Statistics of the true state at every tick of 1 ms.
    pub statistics: Statistics,
    /// The fall that ended the motion, if there was one.
    pub fall: Option<Fall>,
}

/// Runs every trial for `seconds` (0.001 to 3600, rounded to 1 ms) with ten integration steps of order 4 a
/// tick; the outcomes are in the order of the trials. A trial's outcome depends on nothing but the trial:
/// neither on the others nor on the number of threads or the width of the processor's vectors.
///
/// # Errors
/// Duration or a robot's parameters out of range.
pub fn monte_carlo(
    trials: &[Trial],
    seconds: f64,
    threads: NonZeroUsize,
) -> Result<Vec<TrialOutcome>, ParameterError> {
    within("seconds", seconds, TICK_S..=MAX_SECONDS, "from 0.001 to 3600")?;
    for trial in trials {
        trial.robot.validate()?;
    }
    let ticks = (seconds / TICK_S).round() as u64;
    let groups: Vec<&[Trial]> = trials.chunks(SIDE_BY_SIDE).collect();
    Ok(parallel::map(&groups, threads, |group| run(group, ticks)).concat())
}

/// Robots with effects one by one, each with its own memory of the motion, and the others side by side.
fn run(trials: &[Trial], ticks: u64) -> Vec<TrialOutcome> {
    let declared: Vec<Trial> = trials
        .iter()
        .map(|trial| Trial { robot: trial.robot.with_effects_declared(), ..trial.clone() })
        .collect();
    let (plain, others): (Vec<usize>, Vec<usize>) =
        (0..trials.len()).partition(|&index| declared[index].robot.effects.is_empty());
    let mut outcomes = vec![None; trials.len()];
    side_by_side(&declared, &plain, ticks, &mut outcomes);
    for index in others {
        outcomes[index] = Some(with_effects(index, &declared[index], ticks));
    }
    outcomes.into_iter().map(|outcome| outcome.expect("each trial stands or has fallen")).collect()
}

fn with_effects(index: usize, trial: &Trial, ticks: u64) -> TrialOutcome {
    let mut closed = Loop::new(index, trial, ticks);
    let robot = RobotModel { surroundings: Surroundings::default(), ..trial.robot.clone() };
    let mut plant = Plant::new(&robot, &trial.initial);
    for tick in 0..ticks {
        let pose = plant.pose();
        let measurement = Measurement {
            state: pose.state,
            motor_angle_rad: plant.motor_angle_rad(),
            motor_speed_rad_s: plant.motor_speed_rad_s(),
            yaw_rad: pose.yaw_rad,
            yaw_rate_rad_s: pose.yaw_rate_rad_s,
        };
        let torque_nm = closed.torque_nm(&measurement);
        plant.advance(&Forcing { torque_nm, ..Forcing::default() }, TICK_S, SUBSTEPS);
        let state = plant.state();
        if !is_up(&state) {
            return closed.outcome(Some(Fall { time_s: (tick + 1) as f64 / 1000.0, state }));
        }
    }
    closed.outcome(None)
}

fn is_up(state: &State) -> bool {
    state.pitch_rad.abs() <= FALL_PITCH_RAD
}

fn side_by_side(trials: &[Trial], plain: &[usize], ticks: u64, outcomes: &mut [Option<TrialOutcome>]) {
    let mut loops: Vec<Loop> = plain.iter().map(|&index| Loop::new(index, &trials[index], ticks)).collect();
    let mut plants: Vec<PlanarPlant> = plain
        .iter()
        .map(|&index| &trials[index])
        .map(|trial| PlanarPlant::new(&trial.robot.parameters, trial.robot.friction, &trial.initial))
        .collect();
    let mut forcings = vec![Forcing::default(); plain.len()];
    for tick in 0..ticks {
        for ((closed, plant), forcing) in loops.iter_mut().zip(&plants).zip(&mut forcings) {
            forcing.torque_nm = closed.torque_nm(&seen(plant));
        }
        advance_batch(&mut plants, &forcings, TICK_S, SUBSTEPS);
        // From the end, so that the one that takes the place of a fallen robot has been looked at.
        for place in (0..plants.len()).rev() {
            let state = plants[place].state();
            if !is_up(&state) {
                let fall = Fall { time_s: (tick + 1) as f64 / 1000.0, state };
                let fallen = loops.swap_remove(place);
                outcomes[fallen.index] = Some(fallen.outcome(Some(fall)));
                plants.swap_remove(place);
                forcings.swap_remove(place);
            }
        }
    }
    for standing in loops {
        outcomes[standing.index] = Some(standing.outcome(None));
    }
}

fn seen(plant: &PlanarPlant) -> Measurement {
    Measurement {
        state: plant.state(),
        motor_angle_rad: [plant.motor_angle_rad(); 2],
        motor_speed_rad_s: [plant.motor_speed_rad_s(); 2],
        ..Measurement::default()
    }
}

/// One robot's loop without its plant.
struct Loop {
    index: usize,
    controller: BalanceController,
    actuators: [Actuator; 2],
    noise: [Noise; 2],
    torque_noise_nm: f64,
    statistics: RunningStatistics,
}

impl Loop {
    fn new(index: usize, trial: &Trial, ticks: u64) -> Self {
        let RobotModel { limits, actuation, .. } = &trial.robot;
        Self {
            index,
            controller: trial.controller.clone(),
            actuators: [0, 1].map(|_| Actuator::new(limits, actuation)),
            noise: [0, 1].map(|motor| Noise::new(trial.seed, motor)),
            torque_noise_nm: actuation.torque_noise_nm,
            statistics: RunningStatistics::new(ticks),
        }
    }

    /// One tick of controller and motors.
    fn torque_nm(&mut self, measurement: &Measurement) -> [f64; 2] {
        self.statistics.push(&measurement.state);
        let asked = self.controller.step(measurement, &Reference::default());
        std::array::from_fn(|motor| {
            let noise = self.noise[motor].normal(self.torque_noise_nm);
            self.actuators[motor].step(asked[motor], measurement.motor_speed_rad_s[motor]) + noise
        })
    }

    fn outcome(&self, fall: Option<Fall>) -> TrialOutcome {
        TrialOutcome { statistics: self.statistics.finish(fall.is_some()), fall }
    }
}

#[cfg(test)]
mod tests;
