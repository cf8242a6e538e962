//! The closed loop: a robot and its controller.

use super::plant::Pose;
use super::robot::SimulatedRobot;
use crate::ParameterError;
use crate::control::{BalanceController, Measurement, Reference};
use crate::model::Ground;
pub use crate::model::TICK_S;
use crate::model::{RobotModel, State};
use crate::parameter::{finite, within};
use crate::record::Sample;

/// Pitch beyond which the robot has fallen, rad.
pub const FALL_PITCH_RAD: f64 = 0.8;
/// Random streams of a seed: torque noise, then those of the sensors.
pub(super) const TORQUE_STREAM: u64 = 0;
pub(super) const SENSOR_STREAM: u64 = 2;

/// Settings of a simulation. Sensors, delays and noise are the model's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationSettings {
    /// Seed of all noise.
    pub seed: u64,
    /// State at the start.
    pub initial: State,
    /// Integration steps a tick. Default: 4, 0.25 ms each; four times as many change the path by less than
    /// 5e-6 in SI units over 3 s with many stops.
    pub substeps: u32,
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self { seed: 1, initial: State::default(), substeps: 4 }
    }
}

/// A setting that no simulation can run with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the simulation cannot start: {0}")]
pub struct SimulationError(#[from] ParameterError);

/// State and time of a fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fall {
    /// Time, s.
    pub time_s: f64,
    /// True state at that time.
    pub state: State,
}

/// Step at which the motion became non-finite.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the motion is not finite from step {step} ({time_s} s): check the model for extreme masses, lengths, \
     friction or stiffnesses"
)]
pub struct NotFinite {
    /// Tick of 1 ms, counted from 1, during which it happened.
    pub step: u64,
    /// End of that tick, s.
    pub time_s: f64,
}

/// Setpoint of the robot at one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Position setpoint.
    pub reference: Reference,
    /// Torque on top of the controller's, left and right, N m; excites motions to identify from.
    pub added_torque_nm: [f64; 2],
}

/// A simulated robot under control, one tick of 1 ms at a time.
#[derive(Clone, Debug)]
pub struct Simulation {
    controller: BalanceController,
    robot: SimulatedRobot,
}

impl Simulation {
    /// A robot on its model's ground at its initial state, before the first tick. The controller may have
    /// been made from another model.
    ///
    /// # Errors
    /// Robot or settings out of range.
    pub fn new(
        robot: &RobotModel,
        controller: BalanceController,
        settings: SimulationSettings,
    ) -> Result<Self, SimulationError> {
        Self::on_ground(robot, controller, settings, &[const { Ground::flat() }; 2])
    }

    /// Creates it with separate ground under the left and the right wheel.
    ///
    /// # Errors
    /// Robot, settings or ground out of range.
    pub fn on_ground(
        robot: &RobotModel,
        controller: BalanceController,
        settings: SimulationSettings,
        grounds: &[Ground; 2],
    ) -> Result<Self, SimulationError> {
        Ok(Self { controller, robot: SimulatedRobot::on_ground(robot, &settings, grounds)? })
    }

    /// One tick of keeping the station x = 0; see [`Simulation::step_to`].
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// # let linear = robot.parameters.linear_model();
    /// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
    /// # use flqr_core::control::{BalanceController, ControllerKind};
    /// use flqr_core::model::State;
    /// use flqr_core::simulate::{Simulation, SimulationSettings};
    ///
    /// let controller = BalanceController::new(ControllerKind::Flqr, robot, gain)?;
    /// let initial = State { pitch_rad: 0.1, ..State::default() };
    /// let settings = SimulationSettings { initial, ..SimulationSettings::default() };
    /// let mut simulation = Simulation::new(robot, controller, settings)?;
    /// for _ in 0..3000 {
    ///     simulation.step();
    /// }
    /// assert!(simulation.state().pitch_rad.abs() < 0.02 && simulation.fall().is_none());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn step(&mut self) -> Sample {
        self.step_to(&Command::default())
    }

    /// One tick: read the sensors, ask the controller, move on by 1 ms under the torques that were requested
    /// a delay earlier. After a fall, or where the motion is no longer finite, the motors are off, the robot
    /// stays where it is and so does the clock.
    pub fn step_to(&mut self, command: &Command) -> Sample {
        let readings = self.robot.read();
        let measurement = self.controller.odometry.measurement(&readings);
        let asked = if self.has_ended() { [0.0; 2] } else { self.asked(&measurement, command) };
        let sample = Sample::new(self.robot.stamp(), &readings, &measurement.state, asked);
        self.robot.advance(asked);
        sample
    }

    /// Changes the controller from the next tick on.
    pub fn set_controller(&mut self, controller: BalanceController) {
        self.controller = controller;
    }

    /// Pushes the body from the next tick on; see [`SimulatedRobot::push`].
    pub fn push(&mut self, force_n: f64, duration_s: f64, height_m: Option<f64>) {
        self.robot.push(force_n, duration_s, height_m);
    }

    /// Time of the next tick, s.
    pub fn time_s(&self) -> f64 {
        self.robot.time_s()
    }

    /// The true state.
    pub fn state(&self) -> State {
        self.robot.state()
    }

    /// The true state with heading, roll and the ground below.
    pub fn pose(&self) -> Pose {
        self.robot.pose()
    }

    /// True motor angles q, left and right, rad.
    pub fn motor_angle_rad(&self) -> [f64; 2] {
        self.robot.motor_angle_rad()
    }

    /// Returns whether friction holds the motor shafts just now.
    pub fn stuck(&self) -> [bool; 2] {
        self.robot.stuck()
    }

    /// The fall that ended the motion, if there was one.
    pub fn fall(&self) -> Option<&Fall> {
        self.robot.fall()
    }

    /// Step at which the motion became non-finite, if any.
    pub fn not_finite(&self) -> Option<&NotFinite> {
        self.robot.not_finite()
    }

    /// Returns whether the robot has fallen or its motion is no longer finite.
    pub fn has_ended(&self) -> bool {
        self.robot.has_ended()
    }

    fn asked(&self, measurement: &Measurement, command: &Command) -> [f64; 2] {
        let controlled = self.controller.step(measurement, &command.reference);
        let limit = self.controller.torque_limit_nm.max(0.0);
        std::array::from_fn(|motor| {
            let added = command.added_torque_nm[motor];
            if added == 0.0 { controlled[motor] } else { (controlled[motor] + added).clamp(-limit, limit) }
        })
    }
}

impl SimulationSettings {
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        finite("x_m", self.initial.x_m)?;
        finite("x_dot_m_s", self.initial.x_dot_m_s)?;
        finite("pitch_rate_rad_s", self.initial.pitch_rate_rad_s)?;
        within("pitch_rad", self.initial.pitch_rad, -FALL_PITCH_RAD..=FALL_PITCH_RAD, "from -0.8 to 0.8")?;
        within("substeps", f64::from(self.substeps), 1.0..=1000.0, "from 1 to 1000")
    }
}
