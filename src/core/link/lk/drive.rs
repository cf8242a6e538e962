//! A drive of the MF series, from its side.

use std::f64::consts::TAU;

use super::{
    Address, Brake, Command, Encoder, MAX_IQ, MotorId, PhaseCurrents, Reply, ReplyId, State1, State2,
    address, payload, torques,
};
use crate::link::Frame;
use crate::link::protocol::{Demand, DriveAnswer, DriveMeasurement, DriveSetup, DriveState, MotorDrive};
use crate::model::StateLayout;

/// Torque constant where the wiring gives none: MF9025v2-16T, N m/A.
pub(super) const TORQUE_CONSTANT_NM_A: f64 = 0.32;
/// Resistance of the winding for the current from the supply, Ω.
const RESISTANCE_OHM: f64 = 0.5;
/// Pole pairs, for the phase currents.
const POLE_PAIRS: f64 = 21.0;

/// One drive.
#[derive(Debug)]
pub(super) struct Drive {
    id: Option<MotorId>,
    reply_id: ReplyId,
    torque_constant_nm_a: f64,
    steps_per_a: f64,
    encoder_steps: u32,
    layout: StateLayout,
    /// Encoder where the robot's own angle is 0.
    zero_steps: u32,
    brake: u8,
    /// Offset subtracted from the multi-turn angle, rad.
    angle_base_rad: f64,
}

impl Drive {
    pub(super) fn new(setup: &DriveSetup<'_>) -> Self {
        let wiring = setup.wiring;
        Self {
            id: MotorId::new(wiring.motor_ids()[setup.motor as usize]),
            reply_id: if setup.reply_base == Some(super::REPLIES_APART) {
                ReplyId::Apart
            } else {
                ReplyId::Shared
            },
            torque_constant_nm_a: wiring.torque_constant_nm_a.unwrap_or(TORQUE_CONSTANT_NM_A),
            steps_per_a: wiring.current_steps_per_a,
            encoder_steps: wiring.encoder_steps,
            layout: wiring.state_layout,
            zero_steps: setup.random % wiring.encoder_steps,
            brake: Brake::Release as u8,
            angle_base_rad: 0.0,
        }
    }

    /// Command in a frame for this drive.
    fn command(&self, frame: &Frame) -> Option<[u8; 8]> {
        let id = self.id?;
        let bytes = payload(frame).ok()?;
        match address(frame)? {
            Address::CommandOrReply(other) if other == id => Some(bytes),
            Address::Torques => {
                let iq = *torques(bytes).get(usize::from(id.number()) - 1)?;
                Some(Command::TorqueCurrent { iq }.encode())
            }
            Address::CommandOrReply(_) | Address::Reply(_) => None,
        }
    }

    /// Obeys a command and answers it; no answer to one that this drive does not know or that has no meaning on
    /// a shaft without a stop: voltages (MS series), angles, parameters and zeros permanently.
    fn answer(
        &mut self,
        bytes: [u8; 8],
        state: &mut DriveState,
        measured: &DriveMeasurement,
    ) -> Option<Reply> {
        let command = Command::decode(bytes).ok()?;
        let echo = Some(Reply::Echo { bytes });
        match command {
            Command::Off => {
                (state.on, state.demand) = (false, Demand::None);
                self.clear_turns(measured);
                echo
            }
            Command::On => {
                state.on = true;
                echo
            }
            Command::Stop => {
                state.demand = Demand::None;
                echo
            }
            Command::Brake(action) => {
                if action != Brake::Read {
                    self.brake = action as u8;
                }
                Some(Reply::Brake { state: self.brake })
            }
            Command::ClearErrors => {
                state.errors = state.causes;
                self.state_1(bytes[0], state, measured)
            }
            Command::ReadState1 => self.state_1(bytes[0], state, measured),
            Command::ReadState2 => self.state_2(bytes[0], state, measured),
            Command::ReadState3 => self.phase_currents(state, measured),
            Command::TorqueCurrent { iq } => {
                state.demand = Demand::Torque(self.torque_nm(iq.clamp(-MAX_IQ, MAX_IQ)));
                self.state_2(bytes[0], state, measured)
            }
            Command::Speed { speed_cdps, iq_limit } => {
                let limit_nm = match iq_limit {
                    0 => f64::INFINITY,
                    iq => f64::from(iq.unsigned_abs()) / self.steps_per_a * self.torque_constant_nm_a,
                };
                let target_rad_s = f64::from(speed_cdps) * TAU / 36_000.0;
                state.demand = Demand::Speed { target_rad_s, limit_nm };
                self.state_2(bytes[0], state, measured)
            }
            Command::ReadEncoder => {
                let position = self.encoder(measured);
                Some(Reply::Encoder(Encoder { position, raw: position, offset: 0 }))
            }
            Command::ReadAngle => {
                let angle_cdeg = centidegrees(self.own_angle_rad(measured) - self.angle_base_rad) as i64;
                Some(Reply::Angle { angle_cdeg })
            }
            Command::ReadTurnAngle => {
                let angle_cdeg = centidegrees(self.own_angle_rad(measured)).rem_euclid(36_000.0) as u32;
                Some(Reply::TurnAngle { angle_cdeg })
            }
            Command::SetAngle { angle_cdeg } => {
                self.angle_base_rad = self.own_angle_rad(measured) - f64::from(angle_cdeg) * TAU / 36_000.0;
                echo
            }
            _ => None,
        }
    }

    fn torque_nm(&self, iq: i16) -> f64 {
        f64::from(iq) / self.steps_per_a * self.torque_constant_nm_a
    }

    fn state_1(&self, command: u8, state: &DriveState, measured: &DriveMeasurement) -> Option<Reply> {
        let (temperature_c, errors) = (temperature(measured), state.errors);
        let voltage_v = measured.voltage_v;
        let state = match self.layout {
            StateLayout::Current => State1::Current {
                temperature_c,
                voltage_cv: (100.0 * voltage_v).round() as i16,
                current_ca: (100.0 * self.supply_a(state, measured)).round() as i16,
                power: if state.works() { 0x00 } else { 0x10 },
                errors,
            },
            StateLayout::Older => {
                State1::Older { temperature_c, voltage_dv: (10.0 * voltage_v).round() as u16, errors }
            }
        };
        Some(Reply::State1 { command, state })
    }

    fn state_2(&self, command: u8, state: &DriveState, measured: &DriveMeasurement) -> Option<Reply> {
        let speed_dps = measured.speed_rad_s.to_degrees().round() as i16;
        let (temperature_c, iq, encoder) =
            (temperature(measured), self.iq(state, measured), self.encoder(measured));
        Some(Reply::State2 { command, state: State2 { temperature_c, iq, speed_dps, encoder } })
    }

    /// Those of a current along q, seen from each phase.
    fn phase_currents(&self, state: &DriveState, measured: &DriveMeasurement) -> Option<Reply> {
        let electrical_rad = POLE_PAIRS * self.own_angle_rad(measured);
        let phase = |number: f64| -libm::sin(electrical_rad - number * TAU / 3.0);
        let currents = [0.0, 1.0, 2.0]
            .map(|number| (f64::from(self.iq(state, measured)) * phase(number)).round() as i16);
        Some(Reply::State3(PhaseCurrents { temperature_c: temperature(measured), currents }))
    }

    fn current_a(&self, measured: &DriveMeasurement) -> f64 {
        measured.torque_nm / self.torque_constant_nm_a
    }

    fn iq(&self, state: &DriveState, measured: &DriveMeasurement) -> i16 {
        if state.works() { (self.current_a(measured) * self.steps_per_a).round() as i16 } else { 0 }
    }

    fn supply_a(&self, state: &DriveState, measured: &DriveMeasurement) -> f64 {
        if !state.works() {
            return 0.0;
        }
        let heat_w = RESISTANCE_OHM * self.current_a(measured).powi(2);
        (measured.torque_nm * measured.speed_rad_s + heat_w) / measured.voltage_v.max(1.0)
    }

    /// Angle over turns, 0 where the encoder is.
    fn own_angle_rad(&self, measured: &DriveMeasurement) -> f64 {
        let zero_rad = f64::from(self.zero_steps) / f64::from(self.encoder_steps) * TAU;
        measured.angle_rad + zero_rad
    }

    fn encoder(&self, measured: &DriveMeasurement) -> u16 {
        let steps = f64::from(self.encoder_steps);
        (self.own_angle_rad(measured) / TAU * steps).round().rem_euclid(steps) as u16
    }

    fn clear_turns(&mut self, measured: &DriveMeasurement) {
        self.angle_base_rad = (self.own_angle_rad(measured) / TAU).floor() * TAU;
    }
}

impl MotorDrive for Drive {
    fn receive(
        &mut self,
        frame: &Frame,
        state: &mut DriveState,
        measured: &DriveMeasurement,
    ) -> Option<DriveAnswer> {
        let bytes = self.command(frame)?;
        let (id, reply_id) = (self.id?, self.reply_id);
        let reply = self.answer(bytes, state, measured);
        Some(reply.map_or(DriveAnswer::Silence, |reply| DriveAnswer::Reply(reply.frame(id, reply_id))))
    }

    fn power_up(&mut self, measured: &DriveMeasurement) {
        self.clear_turns(measured);
    }

    fn foreign_command(&self, code: u8) -> Frame {
        let id = self.id.map_or(super::TORQUES_ID, MotorId::command_id);
        Frame::full(id, [code, 0, 0, 0, 0, 0, 0, 0])
    }
}

fn temperature(measured: &DriveMeasurement) -> i8 {
    measured.temperature_c.round() as i8
}

fn centidegrees(angle_rad: f64) -> f64 {
    (angle_rad * 36_000.0 / TAU).round()
}
