//! The computer's side of the protocol.

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::time::Duration;

use super::{Address, Command, MAX_IQ, MotorId, Reply, State1, TORQUES_ID, address, payload, torques};
use crate::link::protocol::{
    Frames, MOST_FRAMES, MOST_REPORTS, MotorProtocol, Report, Reports, ShaftAngle, TorqueRange,
};
use crate::link::{Direction, Frame, MotorHealth, MotorOrder, StampedFrame};
use crate::model::{LinkSettings, Motor, TorqueCommand};

/// The longest silence over which turns are counted: a motor of at most 490 rpm (Table 1) stays within half a
/// turn of where its speeds before and after say that it is, whatever it does in between.
const LONGEST_SILENCE: Duration = Duration::from_millis(60);

/// A reply that comes later than this after its command is not taken for its reply.
const LATEST_REPLY: Duration = Duration::from_millis(50);

/// Most commands that are remembered for their echoes: those of 50 ms, and some.
const MOST_SENT: usize = 128;

/// How far two readings of a motor's temperature may be apart, °C.
const TEMPERATURE_STEP_C: i16 = 2;

const RAD_S_PER_DPS: f64 = TAU / 360.0;

/// What torques need.
const NO_CONSTANT: &str =
    "set torque_constant_nm_a in [link], 0.32 N m/A of the MF9025v2-16T or 0.81 N m/A of the -35T";

/// What the protocol cannot tell: versions 2.35 and 2.36 have no such parameter.
pub(super) const NO_TIMEOUT: &str = "the timeout of the motors cannot be read with the LK protocol: if this computer, the adapter \
    or a cable fails, they hold their last torque. Set the timeout with the manufacturer's tool, and keep the switch of their supply within reach";

/// Computer's side of the LK protocol, for both wheel motors of one robot.
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
#[derive(Debug)]
pub(super) struct Host {
    settings: LinkSettings,
    nodes: [Node; 2],
}

#[derive(Debug)]
struct Node {
    motor: Motor,
    id: Option<MotorId>,
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

impl Host {
    /// The motors of these settings, which are to be ones that [`LinkSettings::validate`] accepts: a motor whose
    /// number does not exist is neither received nor asked.
    pub(super) fn new(settings: &LinkSettings) -> Self {
        let node = |motor: Motor| Node {
            motor,
            id: MotorId::new(settings.motor_ids()[motor as usize]),
            answers_apart: false,
            unanswered: Vec::new(),
            sent: VecDeque::new(),
            echoes: false,
            left_one_out: false,
            temperature_c: None,
        };
        Self { settings: *settings, nodes: Motor::BOTH.map(node) }
    }

    fn each(&self, command: impl Fn(&Node) -> Option<Command>) -> Frames {
        let [left, right] = self.nodes.each_ref().map(|node| Some(command(node)?.frame(node.id?)));
        let mut frames = [None; MOST_FRAMES];
        (frames[0], frames[1]) = (left, right);
        frames
    }

    fn together(&self, torques_nm: [f64; 2]) -> Option<Frame> {
        let mut slots = [0; 4];
        for node in &self.nodes {
            let slot = slots.get_mut(usize::from(node.id?.number()) - 1)?;
            *slot = self.iq_from_nm(torques_nm[node.motor as usize])?;
        }
        Some(super::torques_frame(slots))
    }

    fn iq_from_nm(&self, torque_nm: f64) -> Option<i16> {
        let current_a = torque_nm / self.settings.torque_constant_nm_a?;
        let iq = (current_a * self.settings.current_steps_per_a).round();
        Some(iq.clamp(f64::from(-MAX_IQ), f64::from(MAX_IQ)) as i16)
    }

    fn heard(&mut self, stamped: &StampedFrame) -> Option<[Option<Report>; 2]> {
        let address = address(&stamped.frame)?;
        let bytes = payload(&stamped.frame).ok()?;
        let (time, ours) = (stamped.time, stamped.direction == Direction::Sent);
        let (Address::CommandOrReply(id) | Address::Reply(id)) = address else {
            return Some(self.commanded_together(bytes, time, ours));
        };
        let node = self.nodes.iter_mut().find(|node| node.id == Some(id))?;
        node.answers_apart |= matches!(address, Address::Reply(_));
        let on_command_id = address == Address::CommandOrReply(id);
        if !ours && on_command_id && node.is_echo(bytes, time) {
            return None;
        }
        if ours || (on_command_id && node.is_command(bytes, time)) {
            if !ours && node.is_own_reply(bytes) {
                return None;
            }
            let command = u32::from(bytes[0]);
            return Some([node.commanded(bytes, command, time, ours, &self.settings), None]);
        }
        let asked = node.unanswered.iter().position(|asked| asked.code == bytes[0]);
        let asked = asked.map(|index| node.unanswered.remove(index)).filter(|asked| asked.ours);
        let round_trip = asked.map(|asked| time.saturating_sub(asked.time));
        let reply = Reply::decode(bytes, self.settings.state_layout).ok()?;
        Some([node.answered(reply, time, round_trip, &self.settings), None])
    }

    fn commanded_together(&mut self, bytes: [u8; 8], time: Duration, ours: bool) -> [Option<Report>; 2] {
        let slots = torques(bytes);
        let settings = &self.settings;
        self.nodes.each_mut().map(|node| {
            let iq = *slots.get(usize::from(node.id?.number()) - 1)?;
            let alone = Command::TorqueCurrent { iq }.encode();
            if !ours && node.is_echo(alone, time) {
                return None;
            }
            node.commanded(alone, TORQUES_ID.raw(), time, ours, settings)
        })
    }
}

impl MotorProtocol for Host {
    /// Encodes one frame for each motor, or one for both if torques are commanded together. A torque gives none
    /// without a torque constant; one that is not a number commands 0.
    fn encode(&mut self, order: &MotorOrder) -> Frames {
        let both = |command: Command| self.each(|_| Some(command));
        match *order {
            MotorOrder::On => both(Command::On),
            MotorOrder::Off => both(Command::Off),
            MotorOrder::ReadState => both(Command::ReadState2),
            MotorOrder::ReadHealth => both(Command::ReadState1),
            MotorOrder::ClearErrors => both(Command::ClearErrors),
            MotorOrder::Torque(torques_nm) => match self.settings.torque_command {
                TorqueCommand::Each => self.each(|node| {
                    let iq = self.iq_from_nm(torques_nm[node.motor as usize])?;
                    Some(Command::TorqueCurrent { iq })
                }),
                TorqueCommand::Together => {
                    let mut frames = [None; MOST_FRAMES];
                    frames[0] = self.together(torques_nm);
                    frames
                }
            },
        }
    }

    fn decode(&mut self, frame: &StampedFrame) -> Reports {
        let mut reports = [None; MOST_REPORTS];
        if let Some([first, second]) = self.heard(frame) {
            (reports[0], reports[1]) = (first, second);
        }
        reports
    }

    /// A frame that nobody ordered is taken for sent now.
    fn written(&mut self, stamped: &StampedFrame) {
        let Some((address, bytes)) = address(&stamped.frame).zip(payload(&stamped.frame).ok()) else {
            return;
        };
        let settings = &self.settings;
        for node in &mut self.nodes {
            let Some(id) = node.id else { continue };
            let own = match address {
                Address::CommandOrReply(other) | Address::Reply(other) => (other == id).then_some(bytes),
                Address::Torques => {
                    let slot = torques(bytes).get(usize::from(id.number()) - 1).copied();
                    slot.map(|iq| Command::TorqueCurrent { iq }.encode())
                }
            };
            if let Some(bytes) = own {
                node.written(bytes, stamped.time, settings);
            }
        }
    }

    fn torque_range(&self) -> Result<TorqueRange, &'static str> {
        let constant_nm_a = self.settings.torque_constant_nm_a.ok_or(NO_CONSTANT)?;
        let steps_per_a = self.settings.current_steps_per_a;
        Ok(TorqueRange {
            max_nm: f64::from(MAX_IQ) / steps_per_a * constant_nm_a,
            step_nm: constant_nm_a / steps_per_a,
        })
    }

    fn longest_silence(&self) -> Duration {
        LONGEST_SILENCE
    }
}

impl Node {
    /// Whether a frame on the identifier of commands is one: see [`Host`].
    fn is_command(&self, bytes: [u8; 8], time: Duration) -> bool {
        if Command::decode(bytes).is_err() {
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
        let is_query = Command::decode(bytes).is_ok_and(|command| command.is_query());
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
        let of_parameters = matches!(Command::decode(bytes), Ok(Command::Parameters { .. }));
        self.sent.iter().any(|sent| {
            let wrong_bits = (sent.bytes[0] ^ bytes[0]).count_ones();
            let same_rest = sent.bytes[1..] == bytes[1..];
            let is_switching = matches!(sent.bytes[0], 0x80 | 0x88);
            (is_switching && wrong_bits <= 1 && same_rest) || (of_parameters && wrong_bits == 1)
        })
    }

    fn written(&mut self, bytes: [u8; 8], time: Duration, settings: &LinkSettings) {
        let Some(sent) = self.sent.iter_mut().find(|sent| !sent.written && sent.bytes == bytes) else {
            self.commanded(bytes, u32::from(bytes[0]), time, true, settings);
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
        command: u32,
        time: Duration,
        ours: bool,
        settings: &LinkSettings,
    ) -> Option<Report> {
        let code = bytes[0];
        self.unanswered.retain(|asked| asked.code != code);
        self.unanswered.push(Unanswered { code, time, ours });
        if ours {
            if self.sent.len() == MOST_SENT {
                self.sent.pop_front();
            }
            self.sent.push_back(Sent { bytes, time, written: false });
        }
        let current_a = match Command::decode(bytes).ok()? {
            Command::TorqueCurrent { iq } => Some(current_a(iq, settings)),
            query if query.is_query() => return None,
            _ => None,
        };
        Some(Report::Commanded { motor: self.motor, command, current_a })
    }

    fn answered(
        &mut self,
        reply: Reply,
        time: Duration,
        round_trip: Option<Duration>,
        settings: &LinkSettings,
    ) -> Option<Report> {
        let motor = self.motor;
        match reply {
            Reply::State2 { state, .. } => {
                self.temperature_c = Some(state.temperature_c);
                let (steps, turn_steps) = (u32::from(state.encoder), settings.encoder_steps);
                Some(Report::Motion {
                    motor,
                    angle: ShaftAngle::WithinTurn { steps, turn_steps, turn_rad: TAU },
                    speed_rad_s: f64::from(state.speed_dps) * RAD_S_PER_DPS,
                    current_a: current_a(state.iq, settings),
                    temperature_c: f64::from(state.temperature_c),
                })
            }
            Reply::State1 { state, .. } => Some(Report::Health(motor, health(&state, time, round_trip))),
            Reply::Echo { bytes } => {
                let on = match Command::decode(bytes).ok()? {
                    Command::On => true,
                    Command::Off => false,
                    _ => return None,
                };
                Some(Report::Switched { motor, on })
            }
            Reply::Brake { .. }
            | Reply::Offset { .. }
            | Reply::State3(_)
            | Reply::Encoder(_)
            | Reply::Angle { .. }
            | Reply::TurnAngle { .. } => None,
        }
    }
}

fn current_a(iq: i16, settings: &LinkSettings) -> f64 {
    f64::from(iq) / settings.current_steps_per_a
}

fn health(state: &State1, time: Duration, round_trip: Option<Duration>) -> MotorHealth {
    MotorHealth {
        time,
        temperature_c: state.temperature_c(),
        voltage_v: Some(state.voltage_v()),
        supply_current_a: state.supply_current_a(),
        on: state.on(),
        errors: state.errors(),
        round_trip,
    }
}
