//! The closed loop: sensors, controller, transport delay, motors, plant.

use std::collections::VecDeque;

use super::noise::Noise;
use super::planar::{Forcing, PlanarPlant};
use super::sample::Sample;
use super::sensors::{SensorSettings, Sensors};
use crate::ParameterError;
use crate::control::{BalanceController, Reference};
use crate::model_file::RobotModel;
use crate::parameter::{finite, not_negative, within};
use crate::robot::State;

/// Time from one control tick to the next, s.
pub const TICK_S: f64 = 0.001;
/// Pitch beyond which the robot has fallen, rad.
pub const FALL_PITCH_RAD: f64 = 0.8;
/// Longest transport delay, ticks.
const MAX_DELAY_TICKS: u32 = 1000;
/// Random streams of a seed: torque noise, then those of the sensors.
const TORQUE_STREAM: u64 = 0;
const SENSOR_STREAM: u64 = 2;

/// How a robot is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationSettings {
    /// Seed of all noise.
    pub seed: u64,
    /// State at the start.
    pub initial: State,
    /// Sensors.
    pub sensors: SensorSettings,
    /// Ticks of 1 ms from a measurement to the torque that answers it. Default: 4 (assumed: IMU parsing,
    /// two passes over CAN and the threads between, which the paper describes but does not time).
    pub delay_ticks: u32,
    /// Standard deviation of each motor's torque about the asked one, new at every tick, N m. Default:
    /// 0.02 (assumed: ripple and current control, under 1 % of the paper's motors' rated 2.42 N m).
    pub torque_noise_nm: f64,
    /// Integration steps a tick. Default: 4, 0.25 ms each; four times as many change the path by less than
    /// 5e-6 in SI units over 3 s with many stops.
    pub substeps: u32,
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            initial: State::default(),
            sensors: SensorSettings::default(),
            delay_ticks: 4,
            torque_noise_nm: 0.02,
            substeps: 4,
        }
    }
}

/// A setting that no simulation can run with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the simulation cannot start: {0}")]
pub struct SimulationError(#[from] ParameterError);

/// Where and when the robot fell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fall {
    /// Time, s.
    pub time_s: f64,
    /// True state at that time.
    pub state: State,
}

/// A simulated robot under control, one tick of 1 ms at a time.
#[derive(Clone, Debug)]
pub struct Simulation {
    controller: BalanceController,
    settings: SimulationSettings,
    push_height_m: f64,
    plant: PlanarPlant,
    sensors: Sensors,
    torque_noise: [Noise; 2],
    under_way: VecDeque<[f64; 2]>,
    push_n: f64,
    push_ticks_left: u64,
    tick: u64,
    fall: Option<Fall>,
}

impl Simulation {
    /// A robot at its initial state, before the first tick.
    ///
    /// # Errors
    /// Robot or settings out of range.
    pub fn new(
        robot: &RobotModel,
        controller: BalanceController,
        settings: SimulationSettings,
    ) -> Result<Self, SimulationError> {
        robot.parameters.validate()?;
        settings.validate()?;
        let radius = robot.parameters.wheel_radius_m;
        Ok(Self {
            controller,
            settings,
            push_height_m: robot.parameters.com_height_m,
            plant: PlanarPlant::new(&robot.parameters, robot.friction, &settings.initial),
            sensors: Sensors::new(settings.sensors, radius, settings.seed, SENSOR_STREAM),
            torque_noise: [0, 1].map(|motor| Noise::new(settings.seed, TORQUE_STREAM + motor)),
            under_way: std::iter::repeat_n([0.0; 2], settings.delay_ticks as usize).collect(),
            push_n: 0.0,
            push_ticks_left: 0,
            tick: 0,
            fall: None,
        })
    }

    /// One tick: read the sensors, ask the controller, move on by 1 ms under the torques that were asked
    /// for `delay_ticks` earlier. After a fall the motors are off, the robot stays where it fell and so
    /// does the clock.
    pub fn step(&mut self) -> Sample {
        let readings = self.sensors.read(&self.plant, self.tick);
        let asked = if self.fall.is_some() {
            [0.0; 2]
        } else {
            self.controller.step(&readings.measurement, &Reference::default())
        };
        let state = readings.measurement.state;
        let sample = Sample {
            time_s: self.time_s(),
            x_m: state.x_m,
            x_dot_m_s: state.x_dot_m_s,
            pitch_rad: state.pitch_rad,
            pitch_rate_rad_s: state.pitch_rate_rad_s,
            motor_angle_left_rad: readings.motor_angle_rad[0],
            motor_angle_right_rad: readings.motor_angle_rad[1],
            motor_speed_left_rad_s: readings.measurement.motor_speed_rad_s[0],
            motor_speed_right_rad_s: readings.measurement.motor_speed_rad_s[1],
            torque_left_nm: asked[0],
            torque_right_nm: asked[1],
        };
        if self.fall.is_none() {
            self.advance(asked);
        }
        sample
    }

    /// Changes the controller from the next tick on.
    pub fn set_controller(&mut self, controller: BalanceController) {
        self.controller = controller;
    }

    /// Pushes the body at its centre of mass from the next tick on, forward positive; replaces a push that
    /// still acts. The duration is rounded to whole ticks.
    pub fn push(&mut self, force_n: f64, duration_s: f64) {
        self.push_n = force_n;
        self.push_ticks_left = (duration_s / TICK_S).round().max(0.0) as u64;
    }

    /// Time of the next sample, s.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 / 1000.0
    }

    /// The true state.
    pub fn state(&self) -> State {
        self.plant.state()
    }

    /// True motor angle q, rad.
    pub fn motor_angle_rad(&self) -> f64 {
        self.plant.motor_angle_rad()
    }

    /// Whether friction holds the motor shafts just now.
    pub fn stuck(&self) -> bool {
        self.plant.stuck()
    }

    /// The fall that ended the motion, if there was one.
    pub fn fall(&self) -> Option<&Fall> {
        self.fall.as_ref()
    }

    fn advance(&mut self, asked: [f64; 2]) {
        self.under_way.push_back(asked);
        let arrived = self.under_way.pop_front().expect("a torque has just been pushed");
        let mut torque_nm = arrived;
        for (torque, noise) in torque_nm.iter_mut().zip(&mut self.torque_noise) {
            *torque += noise.normal(self.settings.torque_noise_nm);
        }
        let push_n = if self.push_ticks_left > 0 { self.push_n } else { 0.0 };
        self.push_ticks_left = self.push_ticks_left.saturating_sub(1);
        let forcing = Forcing { torque_nm, push_n, push_height_m: self.push_height_m };
        self.plant.advance(&forcing, TICK_S, self.settings.substeps);
        self.tick += 1;
        let state = self.plant.state();
        // A pitch that is not a number is a fall as well.
        if state.pitch_rad.abs() > FALL_PITCH_RAD || state.pitch_rad.is_nan() {
            self.fall = Some(Fall { time_s: self.time_s(), state });
        }
    }
}

impl SimulationSettings {
    fn validate(&self) -> Result<(), ParameterError> {
        finite("x_m", self.initial.x_m)?;
        finite("x_dot_m_s", self.initial.x_dot_m_s)?;
        finite("pitch_rate_rad_s", self.initial.pitch_rate_rad_s)?;
        within("pitch_rad", self.initial.pitch_rad, -FALL_PITCH_RAD..=FALL_PITCH_RAD, "from -0.8 to 0.8")?;
        not_negative("torque_noise_nm", self.torque_noise_nm)?;
        within(
            "delay_ticks",
            f64::from(self.delay_ticks),
            0.0..=f64::from(MAX_DELAY_TICKS),
            "from 0 to 1000",
        )?;
        within("substeps", f64::from(self.substeps), 1.0..=1000.0, "from 1 to 1000")?;
        self.sensors.validate()
    }
}
