//! Frames in words.

use super::{Address, Command, MotorId, Reply, State1, State2, address, payload, torques};
use crate::link::{Direction, StampedFrame, describe::number};
use crate::model::LinkSettings;

/// Describes a frame; `None` if it is not of this protocol.
pub(super) fn describe(stamped: &StampedFrame, settings: &LinkSettings) -> Option<String> {
    let address = address(&stamped.frame)?;
    let bytes = match payload(&stamped.frame) {
        Ok(bytes) => bytes,
        Err(error) => return Some(format!("incomplete: {error}")),
    };
    let command = |motor| {
        Some(format!("{} {}", name(motor, settings), command(&Command::decode(bytes).ok()?, settings)))
    };
    let reply = |motor| {
        let reply = Reply::decode(bytes, settings.state_layout).ok()?;
        Some(format!("{} reports {}", name(motor, settings), said(&reply, settings)))
    };
    match address {
        Address::Torques => {
            let amperes = torques(bytes).map(|iq| number(f64::from(iq) / settings.current_steps_per_a, 2));
            Some(format!("motors 1 to 4: torque currents {} A", amperes.join(", ")))
        }
        Address::Reply(motor) => reply(motor),
        Address::CommandOrReply(motor) if stamped.direction == Direction::Sent => command(motor),
        // Replies may come on the identifier of commands: what cannot be a command is one.
        Address::CommandOrReply(motor) => command(motor).or_else(|| reply(motor)),
    }
}

fn name(motor: MotorId, settings: &LinkSettings) -> String {
    match motor.number() {
        number if number == settings.left_motor_id => "left".to_owned(),
        number if number == settings.right_motor_id => "right".to_owned(),
        number => format!("motor {number}"),
    }
}

fn command(command: &Command, settings: &LinkSettings) -> String {
    match command {
        Command::Off => "off".to_owned(),
        Command::On => "on".to_owned(),
        Command::Stop => "stop".to_owned(),
        Command::ReadState1 => "read supply and errors".to_owned(),
        Command::ClearErrors => "clear errors".to_owned(),
        Command::ReadState2 => "read motion".to_owned(),
        Command::ReadState3 => "read phase currents".to_owned(),
        Command::ReadEncoder => "read encoder".to_owned(),
        Command::ReadAngle | Command::ReadTurnAngle => "read angle".to_owned(),
        Command::TorqueCurrent { iq } => {
            format!("torque current {} A", number(f64::from(*iq) / settings.current_steps_per_a, 2))
        }
        Command::Speed { speed_cdps, .. } | Command::SpeedLimited { speed_cdps, .. } => {
            format!("speed {} rad/s", number((0.01 * f64::from(*speed_cdps)).to_radians(), 2))
        }
        _ => format!("command {:02X}", command.code()),
    }
}

fn said(reply: &Reply, settings: &LinkSettings) -> String {
    match reply {
        Reply::State1 { state, .. } => supply(state),
        Reply::State2 { state, .. } => motion(state, settings),
        Reply::State3(currents) => format!("phase currents {:?}, raw", currents.currents),
        Reply::Brake { state } => format!("brake {state}"),
        Reply::Encoder(encoder) => format!("encoder {}", encoder.position),
        Reply::Angle { angle_cdeg } => angle(*angle_cdeg as f64),
        Reply::TurnAngle { angle_cdeg } => angle(f64::from(*angle_cdeg)),
        Reply::Offset { offset, .. } => format!("offset {offset}"),
        Reply::Echo { bytes } => match Command::decode(*bytes) {
            Ok(done) => format!("done: {}", command(&done, settings)),
            Err(_) => format!("done: {:02X}", bytes[0]),
        },
    }
}

fn supply(state: &State1) -> String {
    let power = match state.on() {
        Some(true) => ", on",
        Some(false) => ", off",
        None => "",
    };
    let (temperature_c, voltage_v) = (number(state.temperature_c(), 0), number(state.voltage_v(), 2));
    format!("{temperature_c} °C, {voltage_v} V{power}, {}", state.errors())
}

fn motion(state: &State2, settings: &LinkSettings) -> String {
    let current_a = number(f64::from(state.iq) / settings.current_steps_per_a, 2);
    let speed_rad_s = number(f64::from(state.speed_dps).to_radians(), 2);
    let temperature_c = number(f64::from(state.temperature_c), 0);
    format!("{current_a} A, {speed_rad_s} rad/s, encoder {}, {temperature_c} °C", state.encoder)
}

fn angle(angle_cdeg: f64) -> String {
    format!("angle {} rad", number((0.01 * angle_cdeg).to_radians(), 3))
}
