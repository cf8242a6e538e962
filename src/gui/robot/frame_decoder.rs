//! Decoded frames as text.

use flqr_core::link::{
    Direction, Frame, FrameId, FrameKind, StampedFrame,
    ht8115::JointFrame,
    lk::{self, Address, Command, MotorId, Reply, State1, State2},
};
use flqr_core::model::LinkSettings;

/// The meaning of a frame on the bus of a robot with these settings; `None` if it is not known.
pub(super) fn decoded(stamped: &StampedFrame, settings: &LinkSettings) -> Option<String> {
    let frame = &stamped.frame;
    match frame.kind() {
        FrameKind::Remote => return Some("remote request".to_owned()),
        FrameKind::Error => return Some("error frame".to_owned()),
        FrameKind::Data => {}
    }
    let Some((address, bytes)) = lk::address(frame) else { return joint(frame) };
    let command =
        |motor| Some(format!("{} {}", name(motor, settings), command(&Command::decode(bytes)?, settings)));
    let reply = |motor| {
        let reply = Reply::decode(bytes, settings.state_layout)?;
        Some(format!("{} reports {}", name(motor, settings), said(&reply, settings)))
    };
    match address {
        Address::Torques => {
            let amperes =
                lk::torques(bytes).map(|iq| number(f64::from(iq) / settings.current_steps_per_a, 2));
            Some(format!("motors 1 to 4: torque currents {} A", amperes.join(", ")))
        }
        Address::Reply(motor) => reply(motor),
        Address::CommandOrReply(motor) if stamped.direction == Direction::Sent => command(motor),
        // Replies may come on the identifier of commands: what cannot be a command is one.
        Address::CommandOrReply(motor) => command(motor).or_else(|| reply(motor)),
    }
}

/// Identifiers of leg joints: commands carry the joint's number, and answers that of the computer, which is small too.
/// Any frame of 6 or 8 bytes could be a joint's, so that others are left alone.
const JOINT_IDS: std::ops::RangeInclusive<u16> = 0..=0x1F;

/// A leg joint's frame; torque is a fraction of the greatest one, on which drivers of these joints disagree.
fn joint(frame: &Frame) -> Option<String> {
    let FrameId::Standard(id) = frame.id() else { return None };
    let joint = JointFrame::decode(frame).filter(|_| JOINT_IDS.contains(&id))?;
    let text = match joint {
        JointFrame::Enter => "enable".to_owned(),
        JointFrame::Leave => "disable".to_owned(),
        JointFrame::SetZero => "set zero".to_owned(),
        JointFrame::Command { .. } => {
            let [stiffness, damping] = joint.gains()?;
            let (stiffness, damping) = (number(stiffness, 1), number(damping, 2));
            format!("to {}, stiffness {stiffness}, damping {damping}", joint_motion(&joint)?)
        }
        JointFrame::Feedback { joint: number, .. } => {
            return Some(format!("joint {number} reports {}", joint_motion(&joint)?));
        }
    };
    Some(format!("joint {id} {text}"))
}

fn joint_motion(joint: &JointFrame) -> Option<String> {
    let (angle_rad, speed_rad_s) = (number(joint.position_rad()?, 2), number(joint.speed_rad_s()?, 2));
    let torque = number(100.0 * joint.torque(1.0)?, 0);
    Some(format!("{angle_rad} rad, {speed_rad_s} rad/s, {torque} % of full torque"))
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
            Some(done) => format!("done: {}", command(&done, settings)),
            None => format!("done: {:02X}", bytes[0]),
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

fn number(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn check(id: u16, bytes: [u8; 8], direction: Direction, expected: Option<&str>) {
        let frame = Frame::full(FrameId::Standard(id), bytes);
        let stamped = StampedFrame { time: Duration::ZERO, direction, frame };
        assert_eq!(decoded(&stamped, &LinkSettings::default()).as_deref(), expected, "{id:X} {bytes:X?}");
    }

    /// The first four: worked bytes of the LK protocols V2.35 and V2.36.
    #[test]
    fn frames_say_what_the_protocol_says_of_them() {
        use Direction::{Received, Sent};
        for (id, bytes, direction, expected) in [
            (0x141, [0xA1, 0, 0, 0, 0x84, 1, 0, 0], Sent, "left torque current 3.13 A"),
            (0x142, [0xA1, 0, 0, 0, 0x3E, 0xFF, 0, 0], Received, "right torque current −1.56 A"),
            (
                0x141,
                [0xA1, 0x23, 0x36, 1, 0xE1, 0xFE, 0, 0xC0],
                Received,
                "left reports 2.50 A, −5.01 rad/s, encoder 49152, 35 °C",
            ),
            (
                0x181,
                [0x9A, 0x23, 0x61, 9, 0xDD, 0xFF, 0, 8],
                Received,
                "left reports 35 °C, 24.01 V, on, motor too hot",
            ),
            (0x145, [0x88, 0, 0, 0, 0, 0, 0, 0], Sent, "motor 5 on"),
            (0x182, [0x80, 0, 0, 0, 0, 0, 0, 0], Received, "right reports done: off"),
            (
                0x280,
                [124, 0, 0, 0, 0, 0, 132, 255],
                Sent,
                "motors 1 to 4: torque currents 1.00, 0.00, 0.00, −1.00 A",
            ),
        ] {
            check(id, bytes, direction, Some(expected));
        }
        check(0x7FF, [0; 8], Received, None);
    }

    /// Bytes as the fields of the MIT protocol; zero lies between two steps.
    #[test]
    fn frames_of_leg_joints_say_what_they_ask_for_and_tell() {
        use Direction::{Received, Sent};
        check(
            3,
            [0x80, 0, 0x80, 0x00, 0xA4, 0x33, 0x38, 0xE3],
            Sent,
            Some("joint 3 to 0.00 rad, 0.01 rad/s, 11 % of full torque, stiffness 20.0, damping 1.00"),
        );
        for (last, said) in [(0xFC, "enable"), (0xFD, "disable"), (0xFE, "set zero")] {
            let mut bytes = [0xFF; 8];
            bytes[7] = last;
            check(1, bytes, Sent, Some(&format!("joint 1 {said}")));
            check(0x300, bytes, Sent, None);
        }
        let frame = Frame::data(FrameId::Standard(0), &[2, 0xFF, 0xFF, 0x00, 0x08, 0x00]).unwrap();
        let stamped = StampedFrame { time: Duration::ZERO, direction: Received, frame };
        let said = "joint 2 reports 95.50 rad, −45.00 rad/s, 0 % of full torque";
        assert_eq!(decoded(&stamped, &LinkSettings::default()).as_deref(), Some(said));
    }
}
