//! The simulated robot behind the real bytes: motors on CAN with the protocol of the wiring, a JY901 on a serial line.
//!
//! Time is an argument; same robot, settings and calls, same bytes. The robot moves in ticks of 1 ms. A motor
//! answers 0.25 ms after a command with what it measured at the last tick, and a torque that comes within a tick
//! counts for the whole of it; the IMU's bytes are there 0.5 ms after the tick of their reading.
//!
//! # Delay
//! The model's `delay_s` is the whole way from a measurement to the torque that answers it. A controller that
//! runs once a tick hears of a tick at the next one: that tick on the wire is part of the delay, and the
//! emulated motors take only the rest. A delay below one tick cannot be emulated and is one tick.
//!
//! # On the stand
//! At first a hand holds the robot upright, wheels on the ground, and rocks it slowly by ±0.1 rad, so that the
//! motor angles show the pitch: q = −θ. The first torque that is not 0 frees it. A robot that has fallen lies;
//! 1 s after the last torque, the motors being off or the robot down, it is carried back. With its wheels in the
//! air it stays on the stand, and the motors turn.

mod adapter;
mod bus;
mod fault;
mod flood;
mod hand;
mod imu;
mod motor;
mod on_board;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::control::BalanceController;
use crate::link::protocol::{DriveAnswer, DriveSetup, protocol};
use crate::link::{Direction, Frame, StampedFrame};
use crate::model::{Actuation, Ground, LinkSettings, Motor, RobotModel, State, TICK_S};
use crate::record::Readings;
use crate::simulate::{Pose, SimulatedRobot, SimulationError, SimulationSettings};

pub use adapter::EmulatedAdapter;
pub use bus::EmulatedBus;
pub use fault::{Fault, FaultError, TimedFault};
pub use hand::Place;

use flood::Flood;
use hand::Hand;
use imu::{Attitude, EmulatedImu, Health};
use motor::{EmulatedMotor, Shaft};
use on_board::OnBoard;

/// From a command to the motor's reply.
const REPLY_AFTER: Duration = Duration::from_micros(250);
/// Most frames that wait to be read; the oldest go first.
const WAITING: usize = 8192;
/// Random stream of a seed for the motors' zeros.
const ZEROS_STREAM: u64 = 17;
/// Voltage of the supply until a fault changes it, V.
const SUPPLY_V: f64 = 24.0;

/// Settings of an emulated robot besides its model. Default: seed 0, as its model says, and no faults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmulatorSettings {
    /// Seed of all noise.
    pub seed: u64,
    /// True if the stand keeps the wheels off the ground.
    pub wheels_in_air: bool,
    /// The robot's own controller: it balances by itself, and its commands are on the bus.
    pub on_board: Option<BalanceController>,
    /// True wiring, if different from the model's.
    pub actual: Option<LinkSettings>,
    /// Base identifier of the motors' replies, if not the protocol's default.
    pub reply_base: Option<u16>,
    /// Frames of other devices that fill the bus, in a second.
    pub flood_hz: u32,
    /// Faults.
    pub faults: Vec<TimedFault>,
}

/// A simulated robot that speaks the real robot's protocols.
///
/// ```
/// # let model = flqr_core::model_file::presets::paper();
/// # let robot = model.robot().ok_or("no robot")?;
/// use std::time::Duration;
///
/// use flqr_core::emulator::{Emulator, EmulatorSettings};
/// use flqr_core::link::lk::{Command, MotorId};
///
/// let mut emulator = Emulator::new(robot, EmulatorSettings::default())?;
/// let motor = MotorId::new(1).ok_or("not a motor id")?;
/// emulator.receive(Duration::from_millis(5), &Command::ReadState2.frame(motor));
/// let reply = emulator.frames(Duration::from_millis(6)).ok_or("no reply")?;
/// assert_eq!(reply.frame.bytes()[0], 0x9C);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Emulator {
    robot: SimulatedRobot,
    wheel_radius_m: f64,
    com_height_m: f64,
    gravity_m_s2: f64,
    in_air: bool,
    hand: Hand,
    motors: [EmulatedMotor; 2],
    imu: EmulatedImu,
    on_board: Option<OnBoard>,
    flood: Flood,
    /// Faults to come, latest first.
    faults: Vec<TimedFault>,
    voltage_v: f64,
    /// Values reported by motors with a frozen encoder.
    frozen: [Option<Shaft>; 2],
    reversed: [bool; 2],
    swapped: bool,
    bus_off: bool,
    tick: u64,
    last_driven_tick: u64,
    readings: Readings,
    /// Offset of the simulated motor angles after the robot was carried, rad.
    carried_rad: [f64; 2],
    velocity_m_s: [f64; 2],
    outgoing: VecDeque<StampedFrame>,
}

impl Emulator {
    /// A robot on its stand at time 0.
    ///
    /// # Errors
    /// Robot or wiring out of range.
    pub fn new(robot: &RobotModel, settings: EmulatorSettings) -> Result<Self, SimulationError> {
        let robot = &robot.with_effects_declared();
        let wiring = settings.actual.unwrap_or(robot.link);
        wiring.validate()?;
        let hand = Hand::Rocks { since: 0 };
        let initial = hand.state(0, 0.0).unwrap_or_default();
        let simulation = SimulationSettings { seed: settings.seed, initial, ..SimulationSettings::default() };
        let behind_the_wire = behind_the_wire(robot);
        let simulated = match settings.wheels_in_air {
            true => SimulatedRobot::in_air(&behind_the_wire, &simulation)?,
            false => {
                SimulatedRobot::on_ground(&behind_the_wire, &simulation, &[const { Ground::flat() }; 2])?
            }
        };
        let mut faults = settings.faults;
        faults.sort_by_key(|fault| fault.at);
        faults.reverse();
        let mut emulator = Self {
            robot: simulated,
            wheel_radius_m: robot.parameters.wheel_radius_m,
            com_height_m: robot.parameters.com_height_m,
            gravity_m_s2: robot.parameters.gravity_m_s2,
            in_air: settings.wheels_in_air,
            hand,
            motors: motors(robot, &wiring, settings.seed, settings.reply_base),
            imu: EmulatedImu::new(&wiring, &robot.sensors),
            on_board: settings.on_board.map(|own| OnBoard::new(own, &driven(wiring), robot.safety.tilt_rad)),
            flood: Flood::new(settings.flood_hz, settings.seed),
            faults,
            voltage_v: SUPPLY_V,
            frozen: [None; 2],
            reversed: [false; 2],
            swapped: false,
            bus_off: false,
            tick: 0,
            last_driven_tick: 0,
            readings: Readings::default(),
            carried_rad: [0.0; 2],
            velocity_m_s: velocity_m_s(&initial, robot.parameters.com_height_m),
            outgoing: VecDeque::new(),
        };
        emulator.begin_tick();
        Ok(emulator)
    }

    /// Lets the robot move until `now`; a time before that of the last call changes nothing.
    pub fn advance(&mut self, now: Duration) {
        while self.time() + tick_duration() <= now {
            let speeds = self.readings.motor_speed_rad_s;
            let asked_nm = [0, 1].map(|motor: usize| self.motors[motor].step(speeds[motor]));
            self.move_on(self.wired(asked_nm));
            self.tick += 1;
            self.begin_tick();
        }
    }

    /// Takes in a frame that is sent to the robot, and lets it move until then.
    pub fn receive(&mut self, now: Duration, frame: &Frame) {
        self.advance(now);
        self.obey(now, frame);
    }

    /// The next frame that is on the bus by `now`: replies, and what others send.
    pub fn frames(&mut self, now: Duration) -> Option<StampedFrame> {
        self.outgoing.pop_front_if(|frame| frame.time <= now)
    }

    /// When the next frame will be on the bus, as far as it is known: one that has not been read yet, or else
    /// the next tick.
    pub fn next_frame_at(&self) -> Duration {
        let next_tick = self.time() + tick_duration();
        self.outgoing.front().map_or(next_tick, |frame| frame.time.min(next_tick))
    }

    /// The bytes that the IMU has sent by `now` and that have not been read.
    pub fn imu_bytes(&mut self, now: Duration) -> Vec<u8> {
        self.advance(now);
        self.imu.bytes(now)
    }

    /// Takes in bytes that are sent to the IMU: writes to its registers.
    pub fn imu_receive(&mut self, now: Duration, bytes: &[u8]) {
        self.advance(now);
        if let Some(rate_hz) = self.imu.receive(self.tick, bytes) {
            self.robot.set_imu_rate_hz(rate_hz);
        }
    }

    /// Lets something go wrong, or right again, now.
    pub fn inject(&mut self, fault: Fault) {
        match fault {
            Fault::MotorVanishes(motor) => self.motors[motor as usize].lose_power(),
            Fault::MotorReturns(motor) => {
                let shaft = self.shaft(motor as usize);
                self.motors[motor as usize].power_up(&shaft, self.voltage_v);
            }
            Fault::MotorErrors(motor, errors) => self.motors[motor as usize].set_causes(errors),
            Fault::MotorTemperature(motor, celsius) => self.motors[motor as usize].set_temperature_c(celsius),
            Fault::Voltage(voltage_v) => self.voltage_v = voltage_v,
            Fault::ImuSilent => self.imu_turns(Health::Silent),
            Fault::ImuFrozen => self.imu_turns(Health::Frozen),
            Fault::ImuAngleFrozen => self.imu_turns(Health::AngleFrozen),
            Fault::ImuRateZero => self.imu_turns(Health::RateZero),
            Fault::ImuAngleOff(off_rad) => self.imu_turns(Health::AngleOff(off_rad)),
            Fault::ImuReturns => self.imu_turns(Health::Well),
            Fault::EncoderFrozen(motor) => {
                let shaft = self.shaft(motor as usize);
                self.frozen[motor as usize] = Some(Shaft { speed_rad_s: 0.0, ..shaft });
            }
            Fault::EncoderReturns(motor) => self.frozen[motor as usize] = None,
            Fault::TorqueReversed(motor) => self.reversed[motor as usize] ^= true,
            Fault::TorquesSwapped => self.swapped ^= true,
            Fault::Commanded(motor, command) => {
                let frame = self.motors[motor as usize].foreign_command(command);
                self.put(self.time(), frame);
                self.obey(self.time(), &frame);
            }
            Fault::Held => {
                let Pose { state, .. } = self.robot.pose();
                let state = State { x_dot_m_s: 0.0, pitch_rate_rad_s: 0.0, ..state };
                self.hand = Hand::Holds { state };
            }
            Fault::Released => self.hand = Hand::Off,
            Fault::BusOff => self.bus_off = true,
            Fault::BusOn => self.bus_off = false,
            Fault::Push { force_n, duration_s } => self.push(force_n, duration_s),
        }
        if self.bus_off {
            self.outgoing.clear();
        }
    }

    /// Pushes the body at its centre of mass from this tick on, forward positive.
    pub fn push(&mut self, force_n: f64, duration_s: f64) {
        self.robot.push(force_n, duration_s, None);
    }

    /// Returns whether a fault keeps all frames off the bus.
    pub fn bus_is_off(&self) -> bool {
        self.bus_off
    }

    /// Position of the robot.
    pub fn place(&self) -> Place {
        self.hand.place()
    }

    /// The true state.
    pub fn state(&self) -> State {
        self.robot.state()
    }

    /// The true state with heading, roll and the ground below.
    pub fn pose(&self) -> Pose {
        self.robot.pose()
    }

    /// Time of the last tick.
    pub fn time(&self) -> Duration {
        Duration::from_millis(self.tick)
    }

    fn imu_turns(&mut self, health: Health) {
        self.imu.set_health(health, self.readings.pitch_rad);
    }

    /// Torques as they act, by how the motors are wired.
    fn wired(&self, [left, right]: [f64; 2]) -> [f64; 2] {
        let torques = if self.swapped { [right, left] } else { [left, right] };
        [0, 1].map(|motor: usize| if self.reversed[motor] { -torques[motor] } else { torques[motor] })
    }

    fn move_on(&mut self, asked_nm: [f64; 2]) {
        self.change_hands();
        let Some(state) = self.hand.state(self.tick + 1, self.wheel_radius_m) else {
            self.robot.advance(asked_nm);
            if self.robot.has_ended() {
                let pitch_rad = self.robot.fall().map_or(0.0, |fall| fall.state.pitch_rad);
                self.hand = Hand::LetsLie { pitch_rad };
            }
            return;
        };
        let before = self.robot.motor_angle_rad();
        self.robot.hold(asked_nm, &state);
        if self.hand.place() != Place::Stand || self.hand.holds() {
            for (motor, angle_rad) in self.robot.motor_angle_rad().into_iter().enumerate() {
                self.carried_rad[motor] += before[motor] - angle_rad;
            }
        }
    }

    /// Lets the robot go, picks it up or sets it down.
    fn change_hands(&mut self) {
        let driven = self.motors.iter().any(EmulatedMotor::is_driven);
        let quiet = self.tick - self.last_driven_tick >= hand::PATIENCE_TICKS;
        let off = !self.motors.iter().any(EmulatedMotor::works);
        match self.hand.place() {
            Place::Stand if driven && !self.in_air && !self.hand.holds() => self.hand = Hand::Off,
            Place::Free | Place::Lying if quiet && (off || self.place() == Place::Lying) => {
                self.motors.iter_mut().for_each(EmulatedMotor::rest);
                let from_pitch_rad = self.robot.state().pitch_rad;
                self.hand = Hand::Carries { since: self.tick, from_pitch_rad };
            }
            _ => self.hand.set_down(self.tick),
        }
    }

    /// Events of a tick: faults, readings, what the IMU and others send.
    fn begin_tick(&mut self) {
        let now = self.time();
        while let Some(due) = self.faults.pop_if(|fault| fault.at <= now) {
            self.inject(due.fault);
        }
        self.readings = self.robot.read();
        for (angle_rad, carried_rad) in self.readings.motor_angle_rad.iter_mut().zip(self.carried_rad) {
            *angle_rad += carried_rad;
        }
        let attitude = self.attitude();
        self.imu.tick(self.tick, &attitude);
        let own = self
            .on_board
            .as_mut()
            .map(|own| own.frames(self.tick, &self.readings, self.hand.place() == Place::Stand));
        for frame in own.into_iter().flatten() {
            self.put(now, frame);
            self.obey(now, &frame);
        }
        for motor in [0, 1] {
            let shaft = self.measured_shaft(motor);
            if let Some(frame) = self.motors[motor].tick(&shaft, self.voltage_v) {
                self.put(now, frame);
            }
        }
        for StampedFrame { time, frame, .. } in self.flood.frames(self.tick).collect::<Vec<_>>() {
            self.put(time, frame);
        }
    }

    fn obey(&mut self, now: Duration, frame: &Frame) {
        if self.bus_off {
            return;
        }
        for motor in [0, 1] {
            let shaft = self.measured_shaft(motor);
            let Some(answer) = self.motors[motor].receive(frame, &shaft, self.voltage_v) else { continue };
            if self.motors[motor].is_driven() {
                self.last_driven_tick = self.tick;
            }
            if let DriveAnswer::Reply(frame) = answer {
                self.put(now + REPLY_AFTER, frame);
            }
        }
    }

    /// The shaft as the drive measures it.
    fn measured_shaft(&self, motor: usize) -> Shaft {
        self.frozen[motor].unwrap_or_else(|| self.shaft(motor))
    }

    fn shaft(&self, motor: usize) -> Shaft {
        Shaft {
            angle_rad: self.readings.motor_angle_rad[motor],
            speed_rad_s: self.readings.motor_speed_rad_s[motor],
            torque_nm: self.robot.torque_nm()[motor],
        }
    }

    fn put(&mut self, time: Duration, frame: Frame) {
        if self.bus_off {
            return;
        }
        if self.outgoing.len() == WAITING {
            self.outgoing.pop_front();
        }
        let place = self.outgoing.partition_point(|other| other.time <= time);
        self.outgoing.insert(place, StampedFrame { time, direction: Direction::Received, frame });
    }

    fn attitude(&mut self) -> Attitude {
        let Pose { state, yaw_rad, yaw_rate_rad_s, .. } = self.robot.pose();
        let velocity_m_s = velocity_m_s(&state, self.com_height_m);
        let [ahead, upward] = [0, 1]
            .map(|axis: usize| (velocity_m_s[axis] - self.velocity_m_s[axis]) / TICK_S / self.gravity_m_s2);
        self.velocity_m_s = velocity_m_s;
        let (sin, cos) = libm::sincos(state.pitch_rad);
        Attitude {
            pitch_rad: self.readings.pitch_rad,
            pitch_rate_rad_s: self.readings.pitch_rate_rad_s,
            yaw_rad,
            yaw_rate_rad_s,
            forward_g: ahead * cos - (upward + 1.0) * sin,
            up_g: ahead * sin + (upward + 1.0) * cos,
        }
    }
}

fn tick_duration() -> Duration {
    Duration::from_millis(1)
}

/// The robot as it is behind the wire, which has a tick of the delay and the steps of the torque.
fn behind_the_wire(robot: &RobotModel) -> RobotModel {
    let delay_s = (robot.actuation.delay_s - TICK_S).max(0.0);
    let actuation = Actuation { delay_s, torque_step_nm: 0.0, ..robot.actuation };
    RobotModel { actuation, ..robot.clone() }
}

/// Settings by which torques can be requested.
fn driven(wiring: LinkSettings) -> LinkSettings {
    let torque_constant_nm_a =
        wiring.torque_constant_nm_a.or(protocol(wiring.protocol).emulated_constant_nm_a);
    LinkSettings { torque_constant_nm_a, ..wiring }
}

fn motors(
    robot: &RobotModel,
    wiring: &LinkSettings,
    seed: u64,
    reply_base: Option<u16>,
) -> [EmulatedMotor; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(ZEROS_STREAM);
    let torque_limit_nm = robot.limits.torque_nm.unwrap_or(f64::INFINITY);
    let inertia = robot.parameters.wheel_inertia_kg_m2;
    Motor::BOTH.map(|motor| {
        let setup = DriveSetup { wiring, motor, random: random.next_u32(), reply_base };
        EmulatedMotor::new(&setup, inertia, torque_limit_nm)
    })
}

/// Of the IMU at the centre of mass, forward and up, m/s.
fn velocity_m_s(state: &State, height_m: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(state.pitch_rad);
    let turning_m_s = height_m * state.pitch_rate_rad_s;
    [state.x_dot_m_s + turning_m_s * cos, -turning_m_s * sin]
}
