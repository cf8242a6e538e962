//! A simulated robot in lock-step with a drive: what is asked at a tick is answered at the next, without any bytes.

use std::time::Duration;

use crate::control::drive::{
    Drive, DriveEvent, DriveOrder, DriveSettings, Excitation, Inputs, Output, Stage, StopReason,
};
use crate::control::{BalanceController, ControllerKind};
use crate::link::{ImuReading, MotorErrors, MotorEvent, MotorHealth, MotorOrder, MotorState};
use crate::lqr;
use crate::model_file::{RobotModel, presets};
use crate::robot::{Motor, State, TICK_S};
use crate::simulate::{Ground, SimulatedRobot, SimulationSettings};

pub(super) fn paper() -> RobotModel {
    let mut robot = presets::paper().robot().unwrap().clone();
    robot.link.imu_rate_hz = robot.sensors.imu_rate_hz as u32;
    robot
}

pub(super) fn controller(robot: &RobotModel, kind: ControllerKind) -> BalanceController {
    let gain = lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap().gain;
    BalanceController::new(kind, robot, gain).unwrap()
}

/// What is wrong with the robot, from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    MotorVanishes(Motor),
    ImuSilent,
    ImuFrozen,
    Errors(Motor, MotorErrors),
    Off(Motor),
    Temperature(Motor, f64),
    Voltage(f64),
    NotFinite,
    BusDown,
    Late(f64),
    /// Orders are not heard.
    Deaf,
    /// A motor tells neither voltage nor errors.
    HealthSilent(Motor),
    /// A motor's turns are not known any more.
    TurnsLost(Motor),
    /// Somebody else commands a motor, too.
    Commanded(Motor),
}

pub(super) struct Rig {
    pub(super) drive: Drive,
    pub(super) robot: SimulatedRobot,
    pub(super) tick: u64,
    /// Whether readings reach the drive a tick after they are taken, as over a bus; the model's delay has it.
    wire: bool,
    /// Torque on the shaft over torque asked for.
    pub(super) torque_scale: f64,
    /// Signs with which the IMU and both motors count.
    pub(super) signs: [f64; 3],
    /// What is added to the tilt from acceleration.
    pub(super) tilt_off_rad: f64,
    pub(super) faults: Vec<(u64, Fault)>,
    /// What the hand does until the motors are on: pitch at a time.
    pub(super) hand: fn(f64) -> f64,
    pub(super) on: [bool; 2],
    in_air: bool,
    imu_period: u64,
    torque_nm: [f64; 2],
    answers: Vec<MotorEvent>,
    frozen: Option<ImuReading>,
    pub(super) outputs: Vec<(Duration, Output)>,
}

/// Rocks by 0.1 rad once in 2 s, for 4 s, and stands then.
pub(super) fn rock(time_s: f64) -> f64 {
    if time_s < 4.0 { 0.1 * (std::f64::consts::PI * time_s).sin() } else { 0.0 }
}

impl Rig {
    pub(super) fn new(actual: &RobotModel, drive: Drive, in_air: bool, wire: bool, seed: u64) -> Self {
        let mut actual = actual.clone();
        if wire {
            actual.actuation.delay_s -= TICK_S;
        }
        let settings = SimulationSettings { seed, ..SimulationSettings::default() };
        let robot = if in_air {
            SimulatedRobot::in_air(&actual, &settings)
        } else {
            SimulatedRobot::on_ground(&actual, &settings, &[const { Ground::flat() }; 2])
        };
        Self {
            drive,
            robot: robot.unwrap(),
            tick: 0,
            wire,
            torque_scale: 1.0,
            signs: [1.0; 3],
            tilt_off_rad: 0.0,
            faults: Vec::new(),
            hand: rock,
            on: [false; 2],
            in_air,
            imu_period: u64::from(actual.sensors.imu_period_ticks()),
            torque_nm: [0.0; 2],
            answers: Vec::new(),
            frozen: None,
            outputs: Vec::new(),
        }
    }

    /// On the ground, under the controller of the model, over a wire.
    pub(super) fn balancing(
        robot: &RobotModel,
        kind: ControllerKind,
        settings: DriveSettings,
        seed: u64,
    ) -> Self {
        let drive = Drive::new(robot, controller(robot, kind), Excitation::Balance, settings).unwrap();
        Self::new(robot, drive, false, true, seed)
    }

    pub(super) fn now(&self) -> Duration {
        Duration::from_millis(self.tick)
    }

    fn faulty(&self, fault: impl Fn(&Fault) -> bool) -> Option<Fault> {
        self.faults.iter().find(|(from, kind)| *from <= self.tick && fault(kind)).map(|(_, kind)| *kind)
    }

    fn state(&self, motor: Motor, readings: &crate::control::Readings) -> MotorEvent {
        let side = motor as usize;
        let sign = self.signs[1 + side];
        let temperature_c = match self.faulty(|f| matches!(f, Fault::Temperature(m, _) if *m == motor)) {
            Some(Fault::Temperature(_, c)) => c,
            _ => 35.0,
        };
        let broken = motor == Motor::Right && self.faulty(|f| *f == Fault::NotFinite).is_some();
        MotorEvent::State(
            motor,
            MotorState {
                time: self.now(),
                angle_rad: sign * readings.motor_angle_rad[side],
                speed_rad_s: if broken { f64::NAN } else { sign * readings.motor_speed_rad_s[side] },
                current_a: self.torque_nm[side] / 0.32,
                temperature_c,
            },
        )
    }

    fn health(&self, motor: Motor) -> MotorEvent {
        let errors = match self.faulty(|f| matches!(f, Fault::Errors(m, _) if *m == motor)) {
            Some(Fault::Errors(_, errors)) => errors,
            _ => MotorErrors(0),
        };
        let voltage_v = match self.faulty(|f| matches!(f, Fault::Voltage(_))) {
            Some(Fault::Voltage(v)) => v,
            _ => 24.0,
        };
        let off = self.faulty(|f| *f == Fault::Off(motor)).is_some();
        MotorEvent::Health(
            motor,
            MotorHealth {
                time: self.now(),
                temperature_c: 35.0,
                voltage_v,
                supply_current_a: Some(0.1),
                on: Some(self.on[motor as usize] && !off),
                errors,
            },
        )
    }

    fn imu(&mut self, readings: &crate::control::Readings) -> Option<ImuReading> {
        if !self.tick.is_multiple_of(self.imu_period) || self.faulty(|f| *f == Fault::ImuSilent).is_some() {
            return None;
        }
        let pitch_rad = self.signs[0] * readings.pitch_rad;
        let reading = ImuReading {
            time: self.now(),
            pitch_rad,
            pitch_rate_rad_s: self.signs[0] * readings.pitch_rate_rad_s,
            // The noise of an acceleration, which never stands still.
            tilt_rad: Some(pitch_rad + self.tilt_off_rad + 1e-3 * ((self.tick as f64) * 12.9898).sin()),
            temperature_c: None,
        };
        if self.faulty(|f| *f == Fault::ImuFrozen).is_some() {
            let kept = self.frozen?;
            return Some(ImuReading { time: reading.time, ..kept });
        }
        self.frozen = Some(reading);
        Some(reading)
    }

    /// One tick with orders from whoever drives.
    pub(super) fn step(&mut self, orders: &[DriveOrder]) -> &Output {
        let readings = self.robot.read();
        let imu: Vec<ImuReading> = self.imu(&readings).into_iter().collect();
        let mut motors = std::mem::take(&mut self.answers);
        if !self.wire {
            // Answers are as fresh as the tick.
            for event in &mut motors {
                if let MotorEvent::State(motor, _) = *event {
                    *event = self.state(motor, &readings);
                }
            }
        }
        motors.retain(|event| match *event {
            MotorEvent::Health(motor, _) => self.faulty(|f| *f == Fault::HealthSilent(motor)).is_none(),
            _ => true,
        });
        let time = self.now();
        for motor in Motor::BOTH {
            if self.faulty(|f| *f == Fault::TurnsLost(motor)).is_some() {
                motors.push(MotorEvent::TurnsLost { motor, time, silent: Duration::from_millis(61) });
            }
            if self.faulty(|f| *f == Fault::Commanded(motor)).is_some() {
                motors.push(MotorEvent::Asked { motor, time, current_a: 0.1 });
            }
        }
        let late = match self.faulty(|f| matches!(f, Fault::Late(_))) {
            Some(Fault::Late(s)) => Duration::from_secs_f64(s),
            _ => Duration::ZERO,
        };
        let bus_down = self.faulty(|f| *f == Fault::BusDown).is_some();
        let inputs = Inputs { motors: &motors, imu: &imu, orders, bus_down, late };
        let output = self.drive.step(self.now(), &inputs);
        for &order in output.orders.iter() {
            self.hear(order, &readings);
        }
        self.outputs.push((self.now(), output));
        self.advance();
        self.tick += 1;
        &self.outputs.last().unwrap().1
    }

    /// What the motors do and answer.
    fn hear(&mut self, order: MotorOrder, readings: &crate::control::Readings) {
        if self.faulty(|f| *f == Fault::Deaf).is_some() {
            return;
        }
        for motor in Motor::BOTH {
            let side = motor as usize;
            if self.faulty(|f| *f == Fault::MotorVanishes(motor)).is_some() {
                self.torque_nm[side] = 0.0;
                continue;
            }
            let time = self.now();
            let answer = match order {
                MotorOrder::On | MotorOrder::Off => {
                    self.on[side] = order == MotorOrder::On;
                    let command = if order == MotorOrder::On { 0x88 } else { 0x80 };
                    MotorEvent::Acknowledged { motor, time, command }
                }
                MotorOrder::Torque(asked) => {
                    self.torque_nm[side] = asked[side];
                    self.state(motor, readings)
                }
                MotorOrder::ReadState => self.state(motor, readings),
                MotorOrder::ReadHealth | MotorOrder::ClearErrors => self.health(motor),
            };
            if !self.on[side] {
                self.torque_nm[side] = 0.0;
            }
            self.answers.push(answer);
        }
    }

    fn advance(&mut self) {
        let torque = self.torque_nm.map(|nm| self.torque_scale * nm);
        if self.in_air || !self.on.contains(&true) {
            let pitch_rad = if self.in_air { 0.0 } else { (self.hand)(1e-3 * (self.tick + 1) as f64) };
            self.robot.hold(torque, &State { pitch_rad, ..State::default() });
        } else {
            self.robot.advance(torque);
        }
    }

    /// Checks, rocks and arms; the tick at which it was armed.
    pub(super) fn arm(&mut self) -> u64 {
        self.step(&[DriveOrder::Check]);
        while self.tick < 4100 {
            self.step(&[]);
        }
        let armed = self.tick;
        self.step(&[DriveOrder::Arm]);
        assert_eq!(self.drive.stage(), Stage::Driving, "{:#?}", self.drive.checks());
        armed
    }

    /// Runs for a time, or until the drive stops.
    pub(super) fn run(&mut self, seconds: f64) -> Option<(Duration, StopReason)> {
        for _ in 0..(seconds / TICK_S).round() as u64 {
            self.step(&[]);
            if let Stage::Stopped(reason) = self.drive.stage() {
                return Some((self.outputs.last().unwrap().0, reason));
            }
        }
        None
    }

    pub(super) fn events(&self) -> impl Iterator<Item = (Duration, &DriveEvent)> {
        self.outputs.iter().flat_map(|(time, output)| output.events.iter().map(|event| (*time, event)))
    }
}
