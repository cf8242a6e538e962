//! A motor with its drive, whose protocol is that of the wiring.

use crate::control::{SpeedPi, SpeedPiState};
use crate::link::protocol::{
    Demand, DriveAnswer, DriveMeasurement, DriveSetup, DriveState, MotorDrive, protocol,
};
use crate::link::{Frame, MotorErrors};
use crate::model::TICK_S;
use crate::simulate::SpeedGains;

const ROOM_C: f64 = 30.0;
/// Rate of temperature change of a motor, °C per tick.
const WARMING_C: f64 = 0.02;

/// Measurements of the shaft by a drive, forward positive.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shaft {
    pub(super) angle_rad: f64,
    pub(super) speed_rad_s: f64,
    pub(super) torque_nm: f64,
}

/// One motor.
#[derive(Debug)]
pub(super) struct EmulatedMotor {
    drive: Box<dyn MotorDrive>,
    /// 1 or −1: its own sense as the robot drives forward.
    sign: f64,
    powered: bool,
    state: DriveState,
    speed_control: SpeedPi,
    speed_memory: SpeedPiState,
    temperature_c: f64,
    target_c: f64,
}

impl EmulatedMotor {
    /// A motor after power-up.
    pub(super) fn new(setup: &DriveSetup<'_>, wheel_inertia_kg_m2: f64, torque_limit_nm: f64) -> Self {
        let SpeedGains { kp, ki } = SpeedGains::firm(wheel_inertia_kg_m2);
        let none = MotorErrors::default();
        Self {
            drive: (protocol(setup.wiring.protocol).drive)(setup),
            sign: setup.wiring.directions()[setup.motor as usize].sign(),
            powered: true,
            state: DriveState { on: true, demand: Demand::None, causes: none, errors: none },
            speed_control: SpeedPi {
                proportional_nm_s_rad: kp,
                integral_nm_rad: ki,
                feedforward: None,
                torque_limit_nm,
            },
            speed_memory: SpeedPiState::default(),
            temperature_c: ROOM_C,
            target_c: ROOM_C,
        }
    }

    /// Returns whether it gives torque when asked.
    pub(super) fn works(&self) -> bool {
        self.powered && self.state.works()
    }

    /// Returns whether it is asked to move.
    pub(super) fn is_driven(&self) -> bool {
        let idle = match self.state.demand {
            Demand::None => true,
            Demand::Torque(torque_nm) => torque_nm == 0.0,
            Demand::Speed { .. } => false,
        };
        self.works() && !idle
    }

    /// Takes what it was told to do away.
    pub(super) fn rest(&mut self) {
        self.set_demand(Demand::None);
    }

    pub(super) fn lose_power(&mut self) {
        self.powered = false;
        self.rest();
    }

    pub(super) fn power_up(&mut self, shaft: &Shaft, voltage_v: f64) {
        (self.powered, self.state.on) = (true, true);
        self.rest();
        self.state.errors = self.state.causes;
        self.drive.power_up(&self.measured(shaft, voltage_v));
    }

    pub(super) fn set_causes(&mut self, causes: MotorErrors) {
        self.state.causes = causes;
        self.state.errors.0 |= causes.0;
    }

    pub(super) fn set_temperature_c(&mut self, target_c: f64) {
        self.target_c = target_c;
    }

    /// Frame with a command of another controller.
    pub(super) fn foreign_command(&self, code: u8) -> Frame {
        self.drive.foreign_command(code)
    }

    /// One tick: the torque that it asks of its current control, N m, forward positive.
    pub(super) fn step(&mut self, speed_rad_s: f64) -> f64 {
        self.temperature_c += (self.target_c - self.temperature_c).clamp(-WARMING_C, WARMING_C);
        if !self.works() {
            return 0.0;
        }
        match self.state.demand {
            Demand::None => 0.0,
            Demand::Torque(torque_nm) => self.sign * torque_nm,
            Demand::Speed { target_rad_s, limit_nm } => {
                let torque_limit_nm = self.speed_control.torque_limit_nm.min(limit_nm);
                let control = SpeedPi { torque_limit_nm, ..self.speed_control };
                control.step(&mut self.speed_memory, self.sign * target_rad_s, speed_rad_s, TICK_S)
            }
        }
    }

    /// Obeys a frame and answers it; `None` if the frame is not for this motor, or the motor has no supply.
    pub(super) fn receive(&mut self, frame: &Frame, shaft: &Shaft, voltage_v: f64) -> Option<DriveAnswer> {
        if !self.powered {
            return None;
        }
        let measured = self.measured(shaft, voltage_v);
        let answer = self.drive.receive(frame, &mut self.state, &measured)?;
        self.set_demand(self.state.demand);
        Some(answer)
    }

    /// Frame that it sends unprompted at a tick.
    pub(super) fn tick(&mut self, shaft: &Shaft, voltage_v: f64) -> Option<Frame> {
        let measured = self.measured(shaft, voltage_v);
        if self.powered { self.drive.tick(&self.state, &measured) } else { None }
    }

    fn set_demand(&mut self, demand: Demand) {
        if !matches!(demand, Demand::Speed { .. }) {
            self.speed_memory = SpeedPiState::default();
        }
        self.state.demand = demand;
    }

    /// Measurements in its own sense.
    fn measured(&self, shaft: &Shaft, voltage_v: f64) -> DriveMeasurement {
        DriveMeasurement {
            angle_rad: self.sign * shaft.angle_rad,
            speed_rad_s: self.sign * shaft.speed_rad_s,
            torque_nm: self.sign * shaft.torque_nm,
            temperature_c: self.temperature_c,
            voltage_v,
        }
    }
}
