//! Runs of the balancing robot.

use std::ops::ControlFlow;

use super::experiment::{Experiment, Push};
use super::plant::{Plant, Pose};
use super::scenario::Scenario;
use super::simulation::{Command, Fall, NotFinite, Simulation, SimulationError, SimulationSettings, TICK_S};
use super::statistics::Statistics;
use crate::control::{BalanceController, Reference};
use crate::excitation::{BALANCE_MULTISINE_NM, Multisine, OutAndBack, PathPoint, SmoothMove, multisines};
use crate::model::Ground;
use crate::model::{RobotModel, State};
use crate::record::Sample;

/// Pitch at which the robot is let go, rad: nearly upright (assumed).
const LET_GO_PITCH_RAD: f64 = 0.05;
/// Start of the bridge, its ramps, deck and height, m; the robot stops at the middle of the deck.
const BRIDGE_M: [f64; 4] = [0.3, 0.4, 0.6, 0.04];
const BRIDGE_TARGET_M: f64 = 1.0;
const BRIDGE_DRIVE: SmoothMove = SmoothMove { start_s: 2.0, duration_s: 8.0, distance_m: BRIDGE_TARGET_M };
const CRUISE_LAP_S: f64 = 20.0;
const CRUISE_PEAK_M_S: f64 = 0.4;
/// Ticks from one true pose to the next.
const POSE_TICKS: usize = 10;

/// Outcome of a run on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Recording, one row per 1 ms from 0 until the end, a fall or a stop by the watcher.
    pub samples: Vec<Sample>,
    /// Statistics of the samples.
    pub statistics: Statistics,
    /// The fall that ended the run, if there was one.
    pub fall: Option<Fall>,
    /// The truth every 10 ms.
    pub poses: Vec<TimedPose>,
    /// Warnings known before the run.
    pub warnings: Vec<String>,
    /// Final position setpoint, m; statistics of the steady point are taken about it.
    pub target_x_m: f64,
    /// Step at which the motion became non-finite, if any; the samples end there.
    pub(super) not_finite: Option<NotFinite>,
}

/// A true pose and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedPose {
    /// Time since the start, s.
    pub time_s: f64,
    /// State, heading, roll and ground at that time.
    pub pose: Pose,
}

/// Setpoints and ground of a scenario.
pub(super) struct Course {
    initial: State,
    grounds: [Ground; 2],
    motion: Motion,
    push: Option<Push>,
    ticks: usize,
}

enum Motion {
    Station,
    Move(SmoothMove),
    Laps(OutAndBack),
    Torques([Multisine; 2]),
}

impl Scenario {
    /// The ground under the left and the right wheel of a robot, on top of its slope.
    pub fn grounds(self, robot: &RobotModel) -> [Ground; 2] {
        Plant::grounds_under(robot, &self.own_grounds()).map(Ground::clone)
    }

    fn own_grounds(self) -> [Ground; 2] {
        let [start, ramp, deck, height] = BRIDGE_M;
        match self {
            Self::Bridge => [Ground::bridge(start, ramp, deck, height), Ground::flat()],
            _ => [const { Ground::flat() }; 2],
        }
    }
}

impl Course {
    /// The course of a scenario on the ground.
    pub(super) fn new(experiment: &Experiment) -> Self {
        let Experiment { scenario, seconds, kick, torque_scale, .. } = experiment;
        let pitched = State { pitch_rad: LET_GO_PITCH_RAD, ..State::default() };
        let station = Self {
            initial: State::default(),
            grounds: [const { Ground::flat() }; 2],
            motion: Motion::Station,
            push: None,
            ticks: (seconds / TICK_S).round() as usize,
        };
        match *scenario {
            Scenario::Flat => Self { initial: pitched, ..station },
            Scenario::Kick => Self { initial: pitched, push: Some(*kick), ..station },
            Scenario::Bridge => Self {
                initial: pitched,
                grounds: scenario.own_grounds(),
                motion: Motion::Move(BRIDGE_DRIVE),
                ..station
            },
            Scenario::Cruise => {
                let laps = OutAndBack::filling(*seconds, CRUISE_LAP_S, CRUISE_PEAK_M_S);
                Self { motion: Motion::Laps(laps), ..station }
            }
            Scenario::Multisine => {
                Self { motion: Motion::Torques(multisines(torque_scale * BALANCE_MULTISINE_NM)), ..station }
            }
            Scenario::Station | Scenario::SpeedTracking | Scenario::FrictionSweep => station,
        }
    }

    fn command(&self, time_s: f64) -> Command {
        let along = |point: PathPoint| {
            let state = State { x_m: point.x_m, x_dot_m_s: point.x_dot_m_s, ..State::default() };
            Command { reference: Reference { state, yaw_rad: 0.0 }, ..Command::default() }
        };
        match &self.motion {
            Motion::Station => Command::default(),
            Motion::Move(path) => along(path.at(time_s)),
            Motion::Laps(path) => along(path.at(time_s)),
            Motion::Torques(motors) => {
                let added_torque_nm = [0, 1].map(|motor: usize| motors[motor].at(time_s));
                Command { added_torque_nm, ..Command::default() }
            }
        }
    }

    fn target_x_m(&self) -> f64 {
        if let Motion::Move(path) = &self.motion { path.distance_m } else { 0.0 }
    }

    /// Sends the robot over the course; `watch` hears the share that is done.
    pub(super) fn run(
        &self,
        robot: &RobotModel,
        controller: BalanceController,
        seed: u64,
        warnings: Vec<String>,
        watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Run, SimulationError> {
        let settings = SimulationSettings { seed, initial: self.initial, ..SimulationSettings::default() };
        let mut simulation = Simulation::on_ground(robot, controller, settings, &self.grounds)?;
        let mut samples = Vec::with_capacity(self.ticks);
        let mut poses = Vec::with_capacity(self.ticks / POSE_TICKS + 1);
        for tick in 0..self.ticks {
            let time_s = simulation.time_s();
            if tick.is_multiple_of(POSE_TICKS) {
                poses.push(TimedPose { time_s, pose: simulation.pose() });
                if watch(tick as f64 / self.ticks as f64).is_break() && tick > 0 {
                    break;
                }
            }
            if let Some(push) = &self.push
                && tick == (push.start_s / TICK_S).round() as usize
            {
                simulation.push(push.force_n, push.duration_s, push.height_m);
            }
            samples.push(simulation.step_to(&self.command(time_s)));
            if simulation.has_ended() {
                break;
            }
        }
        let fall = simulation.fall().copied();
        let not_finite = simulation.not_finite().copied();
        let measured = Statistics::of(&samples).expect("a run has at least one sample");
        // The IMU may not have seen the fall that ended the run.
        let fell = measured.fell || fall.is_some();
        let statistics = Statistics { fell, settled: measured.settled && !fell, ..measured };
        Ok(Run { samples, statistics, fall, poses, warnings, target_x_m: self.target_x_m(), not_finite })
    }
}
