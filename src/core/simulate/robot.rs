//! The robot without its controller: plant, sensors, motors, and what pushes or holds it.

use super::bench_plant::BenchPlant;
use super::motors::Motors;
use super::planar::Forcing;
use super::plant::{Plant, Pose};
use super::sensors::Sensors;
use super::simulation::{
    FALL_PITCH_RAD, Fall, NotFinite, SENSOR_STREAM, SimulationError, SimulationSettings, TICK_S,
};
use crate::effects::{Machine, RobotLaws};
use crate::model::Ground;
use crate::model::{Motor, RobotModel, State};
use crate::record::Readings;

/// A simulated robot, one tick of 1 ms at a time, under whatever torques it is requested.
#[derive(Clone, Debug)]
pub struct SimulatedRobot {
    substeps: u32,
    com_height_m: f64,
    plant: Plant,
    /// Shafts that turn by themselves: wheels in the air.
    lifted: Option<[BenchPlant; 2]>,
    sensors: Sensors,
    motors: Motors,
    torque_nm: [f64; 2],
    push: Forcing,
    push_ticks_left: u64,
    tick: u64,
    fall: Option<Fall>,
    not_finite: Option<NotFinite>,
}

impl SimulatedRobot {
    /// A robot at its initial state, before the first tick, with a separate ground under the left and the
    /// right wheel; one that is flat leaves the model's.
    ///
    /// # Errors
    /// Robot, settings or ground out of range.
    pub fn on_ground(
        robot: &RobotModel,
        settings: &SimulationSettings,
        grounds: &[Ground; 2],
    ) -> Result<Self, SimulationError> {
        let robot = &robot.with_effects_declared();
        robot.validate()?;
        settings.validate()?;
        grounds.iter().try_for_each(Ground::validate)?;
        Ok(Self {
            substeps: settings.substeps,
            com_height_m: robot.parameters.com_height_m,
            plant: Plant::on_ground(robot, grounds, &settings.initial),
            lifted: None,
            sensors: Sensors::new(robot.sensors, settings.seed, SENSOR_STREAM),
            motors: Motors::new(&robot.limits, &robot.actuation, settings.seed),
            torque_nm: [0.0; 2],
            push: Forcing::default(),
            push_ticks_left: 0,
            tick: 0,
            fall: None,
            not_finite: None,
        })
    }

    /// Creates it with its wheels in the air, its body held: to be moved on by [`SimulatedRobot::hold`].
    ///
    /// # Errors
    /// Robot or settings out of range.
    pub fn in_air(robot: &RobotModel, settings: &SimulationSettings) -> Result<Self, SimulationError> {
        let on_ground = Self::on_ground(robot, settings, &[const { Ground::flat() }; 2])?;
        let robot = robot.with_effects_declared();
        let inertia_kg_m2 = robot.parameters.wheel_inertia_kg_m2;
        let laws = RobotLaws::new(&Machine::wheel_in_air(&robot), &robot.effects);
        let shafts = Motor::BOTH.map(|motor| {
            BenchPlant::new(inertia_kg_m2, 0.0, robot.friction[motor as usize], 0.0, 0.0)
                .with_effects(laws.clone().into_motor(motor))
        });
        Ok(Self { lifted: Some(shafts), ..on_ground })
    }

    /// Returns the sensor readings of this sample; call exactly once per sample.
    pub fn read(&mut self) -> Readings {
        self.sensors.read(&self.truth(), self.tick)
    }

    /// The recorder's time stamp of this tick, s; once a tick.
    pub fn stamp(&mut self) -> f64 {
        self.sensors.stamp(self.tick)
    }

    /// Readings of the IMU in a second from now on: a rate that divides 1000.
    pub fn set_imu_rate_hz(&mut self, rate_hz: f64) {
        self.sensors.set_imu_rate_hz(rate_hz);
    }

    /// Moves on by one tick under the torques that were requested a delay earlier, left and right, N m. After
    /// a fall, or where the motion is no longer finite, it stays where it is and so does the clock.
    pub fn advance(&mut self, asked_nm: [f64; 2]) {
        if self.has_ended() {
            return;
        }
        self.torque_nm = self.motors.step(asked_nm, self.motor_speed_rad_s());
        let push = if self.push_ticks_left > 0 { self.push } else { Forcing::default() };
        self.push_ticks_left = self.push_ticks_left.saturating_sub(1);
        let forcing = Forcing { torque_nm: self.torque_nm, ..push };
        self.plant.advance(&forcing, TICK_S, self.substeps);
        self.tick += 1;
        let state = self.plant.state();
        if !self.plant.is_finite() {
            self.not_finite = Some(NotFinite { step: self.tick, time_s: self.time_s() });
        } else if state.pitch_rad.abs() > FALL_PITCH_RAD {
            self.fall = Some(Fall { time_s: self.time_s(), state });
        }
    }

    /// Moves on by one tick in a hand that brings the robot into a state, with heading 0, whatever its motors
    /// do; wheels in the air turn as they do. A robot that has fallen is picked up.
    pub fn hold(&mut self, asked_nm: [f64; 2], state: &State) {
        self.torque_nm = self.motors.step(asked_nm, self.motor_speed_rad_s());
        for (shaft, torque_nm) in self.lifted.iter_mut().flatten().zip(self.torque_nm) {
            shaft.advance(torque_nm, TICK_S, self.substeps);
        }
        self.plant.place(state);
        self.tick += 1;
        self.fall = None;
        self.not_finite = None;
    }

    /// Pushes the body from this tick on, forward positive, at a height above the axle along the body (at its
    /// centre of mass if none is given, m); replaces a push that still acts. The duration is rounded to whole
    /// ticks.
    pub fn push(&mut self, force_n: f64, duration_s: f64, height_m: Option<f64>) {
        let push_height_m = height_m.unwrap_or(self.com_height_m);
        self.push = Forcing { push_n: force_n, push_height_m, ..Forcing::default() };
        self.push_ticks_left = (duration_s / TICK_S).round().max(0.0) as u64;
    }

    /// Time of this tick, s.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 / 1000.0
    }

    /// The true state.
    pub fn state(&self) -> State {
        self.plant.state()
    }

    /// The true state with heading, roll and the ground below.
    pub fn pose(&self) -> Pose {
        self.plant.pose()
    }

    /// True motor angles q, left and right, rad.
    pub fn motor_angle_rad(&self) -> [f64; 2] {
        self.lifted.as_ref().map_or_else(
            || self.plant.motor_angle_rad(),
            |shafts| shafts.each_ref().map(BenchPlant::angle_rad),
        )
    }

    /// True motor speeds q̇, left and right, rad/s.
    pub fn motor_speed_rad_s(&self) -> [f64; 2] {
        self.lifted.as_ref().map_or_else(
            || self.plant.motor_speed_rad_s(),
            |shafts| shafts.each_ref().map(BenchPlant::speed_rad_s),
        )
    }

    /// Torques on the shafts in the last tick, before friction, left and right, N m.
    pub fn torque_nm(&self) -> [f64; 2] {
        self.torque_nm
    }

    /// Returns whether friction holds the motor shafts just now; shafts of wheels on the ground.
    pub fn stuck(&self) -> [bool; 2] {
        self.plant.stuck()
    }

    /// The fall that ended the motion, if there was one.
    pub fn fall(&self) -> Option<&Fall> {
        self.fall.as_ref()
    }

    /// Step at which the motion became non-finite, if any.
    pub fn not_finite(&self) -> Option<&NotFinite> {
        self.not_finite.as_ref()
    }

    /// Returns whether the robot has fallen or its motion is no longer finite.
    pub fn has_ended(&self) -> bool {
        self.fall.is_some() || self.not_finite.is_some()
    }

    fn truth(&self) -> Readings {
        let state = self.plant.state();
        Readings {
            motor_angle_rad: self.motor_angle_rad(),
            motor_speed_rad_s: self.motor_speed_rad_s(),
            pitch_rad: state.pitch_rad,
            pitch_rate_rad_s: state.pitch_rate_rad_s,
        }
    }
}
