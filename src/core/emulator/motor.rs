//! A motor drive of the LK MF series, from its side.

use std::f64::consts::TAU;

use crate::control::{SpeedPi, SpeedPiState};
use crate::link::{
    MotorErrors,
    lk::{self, Brake, Command, Encoder, MotorId, PhaseCurrents, Reply, State1, State2},
};
use crate::model::{LinkSettings, Motor, StateLayout, TICK_S};
use crate::simulate::SpeedGains;

/// Torque constant where the model gives none: MF9025v2-16T, N m/A.
pub(super) const TORQUE_CONSTANT_NM_A: f64 = 0.32;
/// Resistance of the winding for the current from the supply, Ω.
const RESISTANCE_OHM: f64 = 0.5;
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

/// One drive.
#[derive(Clone, Debug)]
pub(super) struct EmulatedMotor {
    id: MotorId,
    /// 1 or −1: its own sense as the robot drives forward.
    sign: f64,
    torque_constant_nm_a: f64,
    steps_per_a: f64,
    encoder_steps: u32,
    layout: StateLayout,
    /// Encoder where the robot's own angle is 0.
    zero_steps: u32,
    powered: bool,
    on: bool,
    brake: u8,
    task: Task,
    speed_control: SpeedPi,
    /// Offset subtracted from the multi-turn angle, rad.
    angle_base_rad: f64,
    causes: MotorErrors,
    errors: MotorErrors,
    temperature_c: f64,
    target_c: f64,
}

/// Command of the drive.
#[derive(Clone, Copy, Debug)]
enum Task {
    None,
    Current { iq: i16 },
    Speed { target_rad_s: f64, limit_nm: f64, memory: SpeedPiState },
}

impl EmulatedMotor {
    /// A drive after power-up. Its encoder starts at `zero_steps`, of which only those of a turn count.
    pub(super) fn new(
        motor: Motor,
        wiring: &LinkSettings,
        id: MotorId,
        wheel_inertia_kg_m2: f64,
        torque_limit_nm: f64,
        zero_steps: u32,
    ) -> Self {
        let SpeedGains { kp, ki } = SpeedGains::firm(wheel_inertia_kg_m2);
        Self {
            id,
            sign: wiring.directions()[motor as usize].sign(),
            torque_constant_nm_a: wiring.torque_constant_nm_a.unwrap_or(TORQUE_CONSTANT_NM_A),
            steps_per_a: wiring.current_steps_per_a,
            encoder_steps: wiring.encoder_steps,
            layout: wiring.state_layout,
            zero_steps: zero_steps % wiring.encoder_steps,
            powered: true,
            on: true,
            brake: Brake::Release as u8,
            task: Task::None,
            speed_control: SpeedPi {
                proportional_nm_s_rad: kp,
                integral_nm_rad: ki,
                feedforward: None,
                torque_limit_nm,
            },
            angle_base_rad: 0.0,
            causes: MotorErrors(0),
            errors: MotorErrors(0),
            temperature_c: ROOM_C,
            target_c: ROOM_C,
        }
    }

    pub(super) fn id(&self) -> MotorId {
        self.id
    }

    /// Returns whether it gives torque when asked.
    pub(super) fn works(&self) -> bool {
        self.powered && self.on && self.errors.is_none()
    }

    /// Returns whether it is asked to move.
    pub(super) fn is_driven(&self) -> bool {
        self.works() && !matches!(self.task, Task::None | Task::Current { iq: 0 })
    }

    /// Takes what it was told to do away.
    pub(super) fn rest(&mut self) {
        self.task = Task::None;
    }

    pub(super) fn lose_power(&mut self) {
        self.powered = false;
        self.task = Task::None;
    }

    pub(super) fn power_up(&mut self, shaft: &Shaft) {
        (self.powered, self.on, self.task) = (true, true, Task::None);
        self.errors = self.causes;
        self.clear_turns(shaft);
    }

    pub(super) fn set_causes(&mut self, causes: MotorErrors) {
        self.causes = causes;
        self.errors.0 |= causes.0;
    }

    pub(super) fn set_temperature_c(&mut self, target_c: f64) {
        self.target_c = target_c;
    }

    /// One tick: the torque that it asks of its current control, N m, forward positive.
    pub(super) fn step(&mut self, speed_rad_s: f64) -> f64 {
        self.temperature_c += (self.target_c - self.temperature_c).clamp(-WARMING_C, WARMING_C);
        if !self.works() {
            return 0.0;
        }
        match &mut self.task {
            Task::None => 0.0,
            Task::Current { iq } => self.sign * f64::from(*iq) / self.steps_per_a * self.torque_constant_nm_a,
            Task::Speed { target_rad_s, limit_nm, memory } => {
                let control = SpeedPi { torque_limit_nm: *limit_nm, ..self.speed_control };
                control.step(memory, *target_rad_s, speed_rad_s, TICK_S)
            }
        }
    }

    /// Obeys a command and answers it; no answer to one that this drive does not know or that has no meaning on
    /// a shaft without a stop: voltages (MS series), angles, parameters and zeros permanently.
    pub(super) fn answer(&mut self, bytes: [u8; 8], shaft: &Shaft, voltage_v: f64) -> Option<Reply> {
        let command = Command::decode(bytes).filter(|_| self.powered)?;
        let echo = Some(Reply::Echo { bytes });
        match command {
            Command::Off => {
                (self.on, self.task) = (false, Task::None);
                self.clear_turns(shaft);
                echo
            }
            Command::On => {
                self.on = true;
                echo
            }
            Command::Stop => {
                self.task = Task::None;
                echo
            }
            Command::Brake(action) => {
                if action != Brake::Read {
                    self.brake = action as u8;
                }
                Some(Reply::Brake { state: self.brake })
            }
            Command::ClearErrors => {
                self.errors = self.causes;
                self.state_1(bytes[0], shaft, voltage_v)
            }
            Command::ReadState1 => self.state_1(bytes[0], shaft, voltage_v),
            Command::ReadState2 => self.state_2(bytes[0], shaft),
            Command::ReadState3 => self.phase_currents(shaft),
            Command::TorqueCurrent { iq } => {
                self.task = Task::Current { iq: iq.clamp(-lk::MAX_IQ, lk::MAX_IQ) };
                self.state_2(bytes[0], shaft)
            }
            Command::Speed { speed_cdps, iq_limit } => {
                self.turn_at(speed_cdps, iq_limit);
                self.state_2(bytes[0], shaft)
            }
            Command::ReadEncoder => {
                let position = self.encoder(shaft);
                Some(Reply::Encoder(Encoder { position, raw: position, offset: 0 }))
            }
            Command::ReadAngle => {
                let angle_cdeg = centidegrees(self.own_angle_rad(shaft) - self.angle_base_rad) as i64;
                Some(Reply::Angle { angle_cdeg })
            }
            Command::ReadTurnAngle => {
                let angle_cdeg = centidegrees(self.own_angle_rad(shaft)).rem_euclid(36_000.0) as u32;
                Some(Reply::TurnAngle { angle_cdeg })
            }
            Command::SetAngle { angle_cdeg } => {
                self.angle_base_rad = self.own_angle_rad(shaft) - f64::from(angle_cdeg) * TAU / 36_000.0;
                echo
            }
            _ => None,
        }
    }

    fn turn_at(&mut self, speed_cdps: i32, iq_limit: i16) {
        let target_rad_s = self.sign * f64::from(speed_cdps) * TAU / 36_000.0;
        let memory = match self.task {
            Task::Speed { memory, .. } => memory,
            _ => SpeedPiState::default(),
        };
        let own_nm = self.speed_control.torque_limit_nm;
        let limit_nm = match iq_limit {
            0 => own_nm,
            iq => own_nm.min(f64::from(iq.unsigned_abs()) / self.steps_per_a * self.torque_constant_nm_a),
        };
        self.task = Task::Speed { target_rad_s, limit_nm, memory };
    }

    fn state_1(&self, command: u8, shaft: &Shaft, voltage_v: f64) -> Option<Reply> {
        let (temperature_c, errors) = (self.temperature(), self.errors);
        let state = match self.layout {
            StateLayout::Current => State1::Current {
                temperature_c,
                voltage_cv: (100.0 * voltage_v).round() as i16,
                current_ca: (100.0 * self.supply_a(shaft, voltage_v)).round() as i16,
                power: if self.on && errors.is_none() { 0x00 } else { 0x10 },
                errors,
            },
            StateLayout::Older => {
                State1::Older { temperature_c, voltage_dv: (10.0 * voltage_v).round() as u16, errors }
            }
        };
        Some(Reply::State1 { command, state })
    }

    fn state_2(&self, command: u8, shaft: &Shaft) -> Option<Reply> {
        let speed_dps = (self.sign * shaft.speed_rad_s.to_degrees()).round() as i16;
        let (temperature_c, iq, encoder) = (self.temperature(), self.iq(shaft), self.encoder(shaft));
        Some(Reply::State2 { command, state: State2 { temperature_c, iq, speed_dps, encoder } })
    }

    /// Those of a current along q, seen from each phase, with 21 pole pairs.
    fn phase_currents(&self, shaft: &Shaft) -> Option<Reply> {
        let electrical_rad = 21.0 * self.own_angle_rad(shaft);
        let phase = |number: f64| -libm::sin(electrical_rad - number * TAU / 3.0);
        let currents =
            [0.0, 1.0, 2.0].map(|number| (f64::from(self.iq(shaft)) * phase(number)).round() as i16);
        Some(Reply::State3(PhaseCurrents { temperature_c: self.temperature(), currents }))
    }

    fn temperature(&self) -> i8 {
        self.temperature_c.round() as i8
    }

    fn current_a(&self, shaft: &Shaft) -> f64 {
        self.sign * shaft.torque_nm / self.torque_constant_nm_a
    }

    fn iq(&self, shaft: &Shaft) -> i16 {
        if self.works() { (self.current_a(shaft) * self.steps_per_a).round() as i16 } else { 0 }
    }

    fn supply_a(&self, shaft: &Shaft, voltage_v: f64) -> f64 {
        if !self.works() {
            return 0.0;
        }
        let heat_w = RESISTANCE_OHM * self.current_a(shaft).powi(2);
        (shaft.torque_nm * shaft.speed_rad_s + heat_w) / voltage_v.max(1.0)
    }

    /// In its own sense, counted over turns, 0 where its encoder is.
    fn own_angle_rad(&self, shaft: &Shaft) -> f64 {
        let zero_rad = f64::from(self.zero_steps) / f64::from(self.encoder_steps) * TAU;
        self.sign * shaft.angle_rad + zero_rad
    }

    fn encoder(&self, shaft: &Shaft) -> u16 {
        let steps = f64::from(self.encoder_steps);
        (self.own_angle_rad(shaft) / TAU * steps).round().rem_euclid(steps) as u16
    }

    fn clear_turns(&mut self, shaft: &Shaft) {
        self.angle_base_rad = (self.own_angle_rad(shaft) / TAU).floor() * TAU;
    }
}

fn centidegrees(angle_rad: f64) -> f64 {
    (angle_rad * 36_000.0 / TAU).round()
}
