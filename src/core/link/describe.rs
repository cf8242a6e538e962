//! Frames in words, for lists of what is on a bus.

use super::protocol::protocol;
use super::{FrameKind, StampedFrame, ht8115};
use crate::model::LinkSettings;

/// The meaning of a frame on the bus of a robot with these settings; `None` if it is not known.
pub fn describe(stamped: &StampedFrame, settings: &LinkSettings) -> Option<String> {
    match stamped.frame.kind() {
        FrameKind::Remote => Some("remote request".to_owned()),
        FrameKind::Error => Some("error frame".to_owned()),
        FrameKind::Data => (protocol(settings.protocol).describe)(stamped, settings)
            .or_else(|| ht8115::describe(&stamped.frame)),
    }
}

pub(super) fn number(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::link::{Direction, Frame, FrameId};

    fn check(id: u16, bytes: [u8; 8], direction: Direction, expected: Option<&str>) {
        let frame = Frame::full(FrameId::Standard(id), bytes);
        let stamped = StampedFrame { time: Duration::ZERO, direction, frame };
        assert_eq!(describe(&stamped, &LinkSettings::default()).as_deref(), expected, "{id:X} {bytes:X?}");
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
        assert_eq!(describe(&stamped, &LinkSettings::default()).as_deref(), Some(said));
    }
}
