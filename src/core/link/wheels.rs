//! The two wheel motors on the bus: orders to frames, frames to what was received, with the settings of the robot.

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::time::Duration;

use super::lk::{self, Address, Command, MAX_IQ, MotorId, Reply, State1, State2, TORQUES_ID};
use super::{Direction, Frame, MotorEvent, MotorHealth, MotorOrder, MotorState, StampedFrame};
use crate::model::{LinkSettings, Motor, TorqueCommand};

/// The longest silence over which turns are counted: a motor of at most 490 rpm (Table 1) stays within half a
/// turn of where its speeds before and after say that it is, whatever it does in between.
pub const LONGEST_SILENCE: Duration = Duration::from_millis(60);

/// A reply that comes later than this after its command is not taken for its reply.
const LATEST_REPLY: Duration = Duration::from_millis(50);

/// Most commands that are remembered for their echoes: those of 50 ms, and some.
const MOST_SENT: usize = 128;

/// How far two readings of a motor's temperature may be apart, °C.
const TEMPERATURE_STEP_C: i16 = 2;

const RAD_S_PER_DPS: f64 = TAU / 360.0;

/// Both wheel motors (LK protocol) of one robot.
///
/// # Commands and replies of one identifier
/// Many firmwares answer on the identifier of the command, so a watcher has to tell the two apart. A frame is a
/// reply where a command of that code cannot have its bytes: commands leave bytes at 0 that replies fill with
/// temperature, current and encoder. What could be both is a reply only if a command of the same code was sent or
/// received within 50 ms and not answered yet; and if it states a temperature, also only if that is within 2 °C of
/// the last one (or the command was our own and none is known). What can go wrong: on/off and the like, whose
/// replies are plain echoes, are taken for acknowledged by a repetition of the command after a lost reply; and a
/// torque command to a motor at 0 °C after a lost reply can be taken for a reading of encoder 0. Neither can
/// happen once a motor has answered on 0x180 + number, which no command has.
///
/// # Commands of another controller
/// Every command that this program did not send is one, but for three kinds of frames:
/// - echoes: some adapters return what they send. An echo has the bytes of a command sent within 50 ms, and each
///   command has one. Queries show it: no reply has their bytes. Until an echoed query is received, a command that
///   moves a motor is another controller's even if it has the bytes of one of ours;
/// - the reply to an on or off command that comes twice;
/// - replies with a damaged command byte, which CAN's checksum rules out but a serial line does not: one bit off the
///   reply to an on or off command, or off any reply if it reads as access to parameters, which may have any bytes.
///   A damaged reply with the bytes of another command takes more than one wrong bit.
#[derive(Clone, Debug)]
pub struct Wheels {
    settings: LinkSettings,
    wheels: [Wheel; 2],
    /// Whether torques that this program sent are events too.
    tells_sent: bool,
}

#[derive(Clone, Debug)]
struct Wheel {
    motor: Motor,
    id: Option<MotorId>,
    /// 1 or −1: its own sense as the robot drives forward.
    sign: f64,
    answers_apart: bool,
    /// The newest command of each code.
    unanswered: Vec<Unanswered>,
    /// Commands that this program sent within the time of a reply and whose echo was not received, oldest first.
    sent: VecDeque<Sent>,
    /// Whether commands of this program come back.
    echoes: bool,
    /// Whether a frame before the first reply was left out, because it may have been an echo.
    left_one_out: bool,
    temperature_c: Option<i8>,
    shaft: Option<Shaft>,
}

#[derive(Clone, Copy, Debug)]
struct Unanswered {
    code: u8,
    time: Duration,
    ours: bool,
}

#[derive(Clone, Copy, Debug)]
struct Sent {
    bytes: [u8; 8],
    time: Duration,
    /// Whether `time` is that of its way to the bus, and not of the order.
    written: bool,
}

/// Encoder steps in the motor's own sense.
#[derive(Clone, Copy, Debug)]
struct Shaft {
    time: Duration,
    encoder: u16,
    speed_rad_s: f64,
    /// Since the first reading.
    steps: i64,
}

impl Wheels {
    /// The motors of these settings, which are to be ones that [`LinkSettings::validate`] accepts: a motor whose
    /// number does not exist is neither received nor asked.
    pub fn new(settings: &LinkSettings) -> Self {
        let wheel = |motor: Motor| Wheel {
            motor,
            id: MotorId::new(settings.motor_ids()[motor as usize]),
            sign: settings.directions()[motor as usize].sign(),
            answers_apart: false,
            unanswered: Vec::new(),
            sent: VecDeque::new(),
            echoes: false,
            left_one_out: false,
            temperature_c: None,
            shaft: None,
        };
        Self { settings: *settings, wheels: Motor::BOTH.map(wheel), tells_sent: false }
    }

    /// The motors of a recording: whoever commanded them, torques are events, the ones too that this program sent.
    pub fn telling_sent(self) -> Self {
        Self { tells_sent: true, ..self }
    }

    /// The frames of an order: one for each motor, or one for both where torques are commanded together. A torque
    /// gives none without a torque constant; beyond the range of the protocol (±2048) it is clamped, and one that
    /// is not a number asks for none.
    pub fn frames(&self, order: &MotorOrder) -> impl Iterator<Item = Frame> + use<> {
        let both = |command: Command| self.each(|_| Some(command));
        match *order {
            MotorOrder::On => both(Command::On),
            MotorOrder::Off => both(Command::Off),
            MotorOrder::ReadState => both(Command::ReadState2),
            MotorOrder::ReadHealth => both(Command::ReadState1),
            MotorOrder::ClearErrors => both(Command::ClearErrors),
            MotorOrder::Torque(torques_nm) => match self.settings.torque_command {
                TorqueCommand::Each => self.each(|wheel| {
                    let iq = self.iq_from_nm(wheel, torques_nm[wheel.motor as usize])?;
                    Some(Command::TorqueCurrent { iq })
                }),
                TorqueCommand::Together => [self.together(torques_nm), None],
            },
        }
        .into_iter()
        .flatten()
    }

    fn each(&self, command: impl Fn(&Wheel) -> Option<Command>) -> [Option<Frame>; 2] {
        self.wheels.each_ref().map(|wheel| Some(command(wheel)?.frame(wheel.id?)))
    }

    fn together(&self, torques_nm: [f64; 2]) -> Option<Frame> {
        let mut slots = [0; 4];
        for wheel in &self.wheels {
            let slot = slots.get_mut(usize::from(wheel.id?.number()) - 1)?;
            *slot = self.iq_from_nm(wheel, torques_nm[wheel.motor as usize])?;
        }
        Some(lk::torques_frame(slots))
    }

    fn iq_from_nm(&self, wheel: &Wheel, torque_nm: f64) -> Option<i16> {
        let current_a = torque_nm / self.settings.torque_constant_nm_a?;
        let iq = (wheel.sign * current_a * self.settings.current_steps_per_a).round();
        Some(iq.clamp(f64::from(-MAX_IQ), f64::from(MAX_IQ)) as i16)
    }

    /// What a frame tells; at most two events. Frames that this program sent are to be handed in too: they tell
    /// which replies to expect, and are no events themselves.
    pub fn receive(&mut self, frame: &StampedFrame) -> impl Iterator<Item = MotorEvent> + use<> {
        self.heard(frame).unwrap_or_default().into_iter().flatten()
    }

    /// Takes the time at which a frame, handed to [`Wheels::receive`] when it was ordered, was written to the bus. One
    /// that nobody ordered is taken for sent now.
    pub fn written(&mut self, stamped: &StampedFrame) {
        let Some((address, bytes)) = lk::address(&stamped.frame) else { return };
        match address {
            Address::CommandOrReply(id) | Address::Reply(id) => {
                if let Some(wheel) = self.wheels.iter_mut().find(|wheel| wheel.id == Some(id)) {
                    wheel.written(bytes, stamped.time, &self.settings);
                }
            }
            Address::Torques => {
                let slots = lk::torques(bytes);
                for wheel in &mut self.wheels {
                    let slot = wheel.id.and_then(|id| slots.get(usize::from(id.number()) - 1));
                    if let Some(&iq) = slot {
                        wheel.written(Command::TorqueCurrent { iq }.encode(), stamped.time, &self.settings);
                    }
                }
            }
        }
    }

    fn heard(&mut self, stamped: &StampedFrame) -> Option<[Option<MotorEvent>; 2]> {
        let (address, bytes) = lk::address(&stamped.frame)?;
        let (time, ours) = (stamped.time, stamped.direction == Direction::Sent);
        let tells = !ours || self.tells_sent;
        let (Address::CommandOrReply(id) | Address::Reply(id)) = address else {
            return Some(self.commanded_together(bytes, time, ours).map(|event| event.filter(|_| tells)));
        };
        let wheel = self.wheels.iter_mut().find(|wheel| wheel.id == Some(id))?;
        wheel.answers_apart |= matches!(address, Address::Reply(_));
        let on_command_id = address == Address::CommandOrReply(id);
        if !ours && on_command_id && wheel.is_echo(bytes, time) {
            return None;
        }
        if ours || (on_command_id && wheel.is_command(bytes, time)) {
            if !ours && wheel.is_own_reply(bytes) {
                return None;
            }
            let command = u16::from(bytes[0]);
            let event = wheel.commanded(bytes, command, time, ours, &self.settings);
            return Some([event.filter(|_| tells), None]);
        }
        let asked = wheel.unanswered.iter().position(|asked| asked.code == bytes[0]);
        let asked = asked.map(|index| wheel.unanswered.remove(index)).filter(|asked| asked.ours);
        let round_trip = asked.map(|asked| time.saturating_sub(asked.time));
        wheel.answered(Reply::decode(bytes, self.settings.state_layout)?, time, round_trip, &self.settings)
    }

    fn commanded_together(&mut self, bytes: [u8; 8], time: Duration, ours: bool) -> [Option<MotorEvent>; 2] {
        let slots = lk::torques(bytes);
        let settings = &self.settings;
        self.wheels.each_mut().map(|wheel| {
            let iq = *slots.get(usize::from(wheel.id?.number()) - 1)?;
            let alone = Command::TorqueCurrent { iq }.encode();
            if !ours && wheel.is_echo(alone, time) {
                return None;
            }
            wheel.commanded(alone, TORQUES_ID.raw() as u16, time, ours, settings)
        })
    }
}

impl Wheel {
    /// Whether a frame on the identifier of commands is one: see [`Wheels`].
    fn is_command(&self, bytes: [u8; 8], time: Duration) -> bool {
        if Command::decode(bytes).is_none() {
            return false;
        }
        let Some(asked) = self.unanswered.iter().find(|asked| {
            asked.code == bytes[0] && time.saturating_sub(asked.time) <= LATEST_REPLY && !self.answers_apart
        }) else {
            return true;
        };
        let stated_c = i16::from(bytes[1].cast_signed());
        let near = |last_c: i8| (i16::from(last_c) - stated_c).abs() <= TEMPERATURE_STEP_C;
        match bytes[0] {
            // As a reply it would state 0 V.
            0x9A | 0x9B => true,
            0x9C | 0x9D | 0xA0..=0xA8 | 0xAD => !self.temperature_c.map_or(asked.ours, near),
            _ => false,
        }
    }

    /// Whether a frame is a command of this program that its adapter returns.
    fn is_echo(&mut self, bytes: [u8; 8], time: Duration) -> bool {
        while self.sent.front().is_some_and(|sent| sent.time + LATEST_REPLY < time) {
            self.sent.pop_front();
        }
        let Some(index) = self.sent.iter().position(|sent| sent.bytes == bytes) else { return false };
        let is_query = Command::decode(bytes).is_some_and(|command| command.is_query());
        if is_query && self.temperature_c.is_none() && !self.left_one_out {
            // Nothing tells an echo from a reply of zeros yet, and one reply can be spared.
            self.left_one_out = true;
            self.sent.remove(index);
            return true;
        }
        // A motor at 0 °C and encoder 0 may answer with the bytes of the query.
        self.echoes |= is_query && self.is_command(bytes, time);
        if self.echoes {
            self.sent.remove(index);
        }
        self.echoes
    }

    /// Whether a frame that reads as a command is a reply to one of this program that came twice or was damaged.
    fn is_own_reply(&self, bytes: [u8; 8]) -> bool {
        let of_parameters = matches!(Command::decode(bytes), Some(Command::Parameters { .. }));
        self.sent.iter().any(|sent| {
            let wrong_bits = (sent.bytes[0] ^ bytes[0]).count_ones();
            let same_rest = sent.bytes[1..] == bytes[1..];
            let is_switching = matches!(sent.bytes[0], 0x80 | 0x88);
            (is_switching && wrong_bits <= 1 && same_rest) || (of_parameters && wrong_bits == 1)
        })
    }

    fn written(&mut self, bytes: [u8; 8], time: Duration, settings: &LinkSettings) {
        let Some(sent) = self.sent.iter_mut().find(|sent| !sent.written && sent.bytes == bytes) else {
            self.commanded(bytes, u16::from(bytes[0]), time, true, settings);
            return;
        };
        (sent.time, sent.written) = (time, true);
        if let Some(asked) = self.unanswered.iter_mut().find(|asked| asked.code == bytes[0] && asked.ours) {
            asked.time = asked.time.max(time);
        }
    }

    fn commanded(
        &mut self,
        bytes: [u8; 8],
        command: u16,
        time: Duration,
        ours: bool,
        settings: &LinkSettings,
    ) -> Option<MotorEvent> {
        let code = bytes[0];
        self.unanswered.retain(|asked| asked.code != code);
        self.unanswered.push(Unanswered { code, time, ours });
        if ours {
            if self.sent.len() == MOST_SENT {
                self.sent.pop_front();
            }
            self.sent.push_back(Sent { bytes, time, written: false });
        }
        let current_a = match Command::decode(bytes)? {
            Command::TorqueCurrent { iq } => Some(self.current_a(iq, settings)),
            query if query.is_query() => return None,
            _ => None,
        };
        Some(MotorEvent::Commanded { motor: self.motor, time, command, current_a })
    }

    fn current_a(&self, iq: i16, settings: &LinkSettings) -> f64 {
        self.sign * f64::from(iq) / settings.current_steps_per_a
    }

    fn answered(
        &mut self,
        reply: Reply,
        time: Duration,
        round_trip: Option<Duration>,
        settings: &LinkSettings,
    ) -> Option<[Option<MotorEvent>; 2]> {
        let motor = self.motor;
        match reply {
            Reply::State2 { state, .. } => Some(self.moved(state, time, settings)),
            Reply::State1 { state, .. } => {
                Some([Some(MotorEvent::Health(motor, health(&state, time, round_trip))), None])
            }
            Reply::Echo { bytes } => {
                let on = match Command::decode(bytes)? {
                    Command::On => true,
                    Command::Off => false,
                    _ => return None,
                };
                Some([Some(MotorEvent::Switched { motor, time, on }), None])
            }
            Reply::Brake { .. }
            | Reply::Offset { .. }
            | Reply::State3(_)
            | Reply::Encoder(_)
            | Reply::Angle { .. }
            | Reply::TurnAngle { .. } => None,
        }
    }

    fn moved(&mut self, state: State2, time: Duration, settings: &LinkSettings) -> [Option<MotorEvent>; 2] {
        self.temperature_c = Some(state.temperature_c);
        let speed_rad_s = f64::from(state.speed_dps) * RAD_S_PER_DPS;
        let here = Shaft { time, encoder: state.encoder, speed_rad_s, steps: 0 };
        let silent = self.shaft.map_or(Duration::ZERO, |last| time.saturating_sub(last.time));
        let lost = silent > LONGEST_SILENCE;
        let steps = match self.shaft {
            None => 0,
            Some(last) if lost => last.steps,
            Some(last) => last.steps + here.steps_since(&last, settings.encoder_steps),
        };
        self.shaft = Some(Shaft { steps, ..here });
        let reading = MotorState {
            time,
            angle_rad: self.sign * steps as f64 * TAU / f64::from(settings.encoder_steps),
            speed_rad_s: self.sign * speed_rad_s,
            current_a: self.current_a(state.iq, settings),
            temperature_c: f64::from(state.temperature_c),
        };
        let lost = lost.then_some(MotorEvent::TurnsLost { motor: self.motor, time, silent });
        [lost, Some(MotorEvent::State(self.motor, reading))]
    }
}

impl Shaft {
    /// Steps since the last reading: the encoder's, and the whole turns that come nearest to the mean speed.
    fn steps_since(&self, last: &Self, turn: u32) -> i64 {
        let elapsed_s = self.time.saturating_sub(last.time).as_secs_f64();
        let turns = (last.speed_rad_s + self.speed_rad_s) / 2.0 * elapsed_s / TAU;
        let within = i64::from(self.encoder) - i64::from(last.encoder);
        within + i64::from(turn) * (turns - within as f64 / f64::from(turn)).round() as i64
    }
}

fn health(state: &State1, time: Duration, round_trip: Option<Duration>) -> MotorHealth {
    MotorHealth {
        time,
        temperature_c: state.temperature_c(),
        voltage_v: state.voltage_v(),
        supply_current_a: state.supply_current_a(),
        on: state.on(),
        errors: state.errors(),
        round_trip,
    }
}

#[cfg(test)]
mod tests;
