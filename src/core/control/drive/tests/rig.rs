//! A simulated robot in lock-step with a drive: what is asked at a tick is answered at the next, without any bytes.

use std::collections::VecDeque;
use std::time::Duration;

use crate::control::{
    BalanceController, ControllerKind,
    drive::{Drive, DriveEvent, DriveOrder, DriveSettings, Excitation, Inputs, Output, Stage, StopReason},
};
use crate::link::{ImuReading, MotorErrors, MotorEvent, MotorHealth, MotorOrder, MotorState};
use crate::lqr;
use crate::model::{Ground, Motor, RobotModel, State, TICK_S};
use crate::model_file::presets;
use crate::simulate::{SimulatedRobot, SimulationSettings};

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
    /// Orders are not received.
    Deaf,
    /// A motor tells neither voltage nor errors.
    HealthSilent(Motor),
    /// A motor's turns are not known any more.
    TurnsLost(Motor),
    /// Somebody else commands a motor, too.
    Commanded(Motor),
    /// An encoder gives the same angle, and speed 0.
    EncoderFrozen(Motor),
    BothEncodersFrozen,
    /// An encoder gives the same angle; the speed is right.
    AngleFrozen(Motor),
    /// The IMU's pitch does not change any more, its rate is 0, its pitch is off by an angle.
    PitchFrozen,
    RateZero,
    PitchOff(f64),
    /// It drifts, rad/s.
    PitchDrift(f64),
    /// A motor gives the opposite of its torque; each gives the torque of the other.
    TorqueReversed(Motor),
    TorquesSwapped,
    /// Somebody holds the robot still.
    Held,
}

pub(super) struct Rig {
    pub(super) drive: Drive,
    pub(super) robot: SimulatedRobot,
    pub(super) tick: u64,
    /// Whether readings reach the drive a tick after they are taken, as over a bus; the model's delay has it.
    wire: bool,
    /// Torque on the shaft over torque requested.
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
    /// Angles of the encoders while they worked, and the state in which the robot was held.
    kept_angle_rad: [f64; 2],
    held: State,
    /// Of the axle, at the last tick.
    acceleration_m_s2: f64,
    speed_m_s: f64,
    /// Ticks by which the motors hear later what is sent to them.
    pub(super) latency: u64,
    on_the_way: VecDeque<(u64, MotorOrder)>,
    pub(super) outputs: Vec<(Duration, Output)>,
}

/// Rocks by 0.1 rad once in 2 s, for 4 s, and stands then.
pub(super) fn rock(time_s: f64) -> f64 {
    if time_s < 4.0 { 0.1 * (std::f64::consts::PI * time_s).sin() } else { 0.0 }
}

/// State of a robot at a tick in a hand that moves its body so.
pub(super) fn in_hand(hand: fn(f64) -> f64, tick: u64) -> State {
    let time_s = 1e-3 * tick as f64;
    let pitch_rate_rad_s = (hand(time_s + 1e-4) - hand(time_s - 1e-4)) / 2e-4;
    State { pitch_rad: hand(time_s), pitch_rate_rad_s, ..State::default() }
}

/// Rocks, then leans by an angle from 4 s on.
fn leans(time_s: f64, lean_rad: f64) -> f64 {
    let share = ((time_s - 3.0) / 1.0).clamp(0.0, 1.0);
    rock(time_s) + lean_rad * share * share * (3.0 - 2.0 * share)
}

/// The same by a little forward, by as much as is allowed, and backward.
pub(super) fn leans_forward(time_s: f64) -> f64 {
    leans(time_s, 0.03)
}

pub(super) fn leans_far(time_s: f64) -> f64 {
    leans(time_s, 0.13)
}

pub(super) fn leans_back(time_s: f64) -> f64 {
    leans(time_s, -0.05)
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
            // The ground of the model's surroundings.
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
            hand: if in_air { |_| 0.0 } else { rock },
            on: [false; 2],
            in_air,
            imu_period: u64::from(actual.sensors.imu_period_ticks()),
            torque_nm: [0.0; 2],
            answers: Vec::new(),
            frozen: None,
            kept_angle_rad: [0.0; 2],
            held: State::default(),
            acceleration_m_s2: 0.0,
            speed_m_s: 0.0,
            latency: 0,
            on_the_way: VecDeque::new(),
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

    fn state(&self, motor: Motor, readings: &crate::record::Readings) -> MotorEvent {
        let side = motor as usize;
        let sign = self.signs[1 + side];
        let temperature_c = match self.faulty(|f| matches!(f, Fault::Temperature(m, _) if *m == motor)) {
            Some(Fault::Temperature(_, c)) => c,
            _ => 35.0,
        };
        let frozen =
            self.faulty(|f| [Fault::EncoderFrozen(motor), Fault::BothEncodersFrozen].contains(f)).is_some();
        let speed_rad_s = if frozen { 0.0 } else { sign * readings.motor_speed_rad_s[side] };
        let broken = motor == Motor::Right && self.faulty(|f| *f == Fault::NotFinite).is_some();
        MotorEvent::State(
            motor,
            MotorState {
                time: self.now(),
                angle_rad: sign * self.kept_angle_rad[side],
                speed_rad_s: if broken { f64::NAN } else { speed_rad_s },
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
                voltage_v: Some(voltage_v),
                supply_current_a: Some(0.1),
                on: Some(self.on[motor as usize] && !off),
                errors,
                round_trip: Some(Duration::from_millis(1 + self.latency)),
            },
        )
    }

    fn imu(&mut self, readings: &crate::record::Readings) -> Option<ImuReading> {
        if !self.tick.is_multiple_of(self.imu_period) || self.faulty(|f| *f == Fault::ImuSilent).is_some() {
            return None;
        }
        let pitch_rad = self.signs[0] * readings.pitch_rad;
        let off_rad = match self.faulty(|f| matches!(f, Fault::PitchOff(_))) {
            Some(Fault::PitchOff(off_rad)) => off_rad,
            _ => 0.0,
        };
        let drifts = self.faults.iter().find_map(|(from, fault)| match fault {
            Fault::PitchDrift(rate) => Some(rate * 1e-3 * self.tick.saturating_sub(*from) as f64),
            _ => None,
        });
        let off_rad = off_rad + drifts.unwrap_or(0.0);
        let stuck = self.frozen.filter(|_| self.faulty(|f| *f == Fault::PitchFrozen).is_some());
        let rate =
            if self.faulty(|f| *f == Fault::RateZero).is_some() { 0.0 } else { readings.pitch_rate_rad_s };
        let reading = ImuReading {
            time: self.now(),
            pitch_rad: stuck.map_or(pitch_rad, |kept| kept.pitch_rad) + off_rad,
            pitch_rate_rad_s: self.signs[0] * rate,
            // The noise of an acceleration, which never stands still.
            tilt_rad: Some(
                pitch_rad - self.acceleration_m_s2 / 9.81
                    + self.tilt_off_rad
                    + 1e-3 * ((self.tick as f64) * 12.9898).sin(),
            ),
            yaw_rate_rad_s: Some(self.robot.pose().yaw_rate_rad_s),
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
        for motor in Motor::BOTH {
            let frozen = |f: &Fault| {
                let kinds =
                    [Fault::EncoderFrozen(motor), Fault::BothEncodersFrozen, Fault::AngleFrozen(motor)];
                kinds.contains(f)
            };
            if self.faulty(frozen).is_none() {
                self.kept_angle_rad[motor as usize] = readings.motor_angle_rad[motor as usize];
            }
        }
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
                motors.push(MotorEvent::Commanded { motor, time, command: 0x81, current_a: None });
            }
        }
        let late = match self.faulty(|f| matches!(f, Fault::Late(_))) {
            Some(Fault::Late(s)) => Duration::from_secs_f64(s),
            _ => Duration::ZERO,
        };
        let bus_down = self.faulty(|f| *f == Fault::BusDown).is_some();
        let inputs = Inputs { motors: &motors, imu: &imu, orders, bus_down, late };
        let output = self.drive.step(self.now(), &inputs);
        self.on_the_way.extend(output.orders.iter().map(|order| (self.tick + self.latency, *order)));
        while let Some((_, order)) = self.on_the_way.pop_front_if(|(due, _)| *due <= self.tick) {
            self.hear(order, &readings);
        }
        self.outputs.push((self.now(), output));
        self.advance();
        self.tick += 1;
        &self.outputs.last().unwrap().1
    }

    /// What the motors do and answer.
    fn hear(&mut self, order: MotorOrder, readings: &crate::record::Readings) {
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
                    MotorEvent::Switched { motor, time, on: self.on[side] }
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
        let mut torque = self.torque_nm.map(|nm| self.torque_scale * nm);
        if self.faulty(|f| *f == Fault::TorquesSwapped).is_some() {
            torque.swap(0, 1);
        }
        for motor in Motor::BOTH {
            if self.faulty(|f| *f == Fault::TorqueReversed(motor)).is_some() {
                torque[motor as usize] *= -1.0;
            }
        }
        let held = self.faulty(|f| *f == Fault::Held).is_some();
        if !held {
            self.held = State { x_dot_m_s: 0.0, pitch_rate_rad_s: 0.0, ..self.robot.state() };
        }
        if held && self.on.contains(&true) {
            self.robot.hold(torque, &self.held);
        } else if self.in_air || !self.on.contains(&true) {
            self.robot.hold(torque, &in_hand(self.hand, self.tick + 1));
        } else {
            self.robot.advance(torque);
        }
        let speed_m_s = self.robot.state().x_dot_m_s;
        self.acceleration_m_s2 = (speed_m_s - self.speed_m_s) / TICK_S;
        self.speed_m_s = speed_m_s;
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
