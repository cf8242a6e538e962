//! Leg joints of HaiTai, HT8115-J9 and -J36: frames to show, not to drive with.
//!
//! No manual of the maker was found. Drivers of the HT8115-J6 of the same family speak the frames of the MIT
//! mini-cheetah; whether J9 and J36 do is not known. Fields are big-endian, and a value is
//! raw × span / (2ⁿ − 1) + minimum; zero lies between two steps.

use super::describe::number;
use super::{Frame, FrameId, FrameKind};

const POSITION_RAD: f64 = 95.5;
const SPEED_RAD_S: f64 = 45.0;
const STIFFNESS: f64 = 500.0;
const DAMPING: f64 = 5.0;

/// A frame to or from a joint. Fields are raw; drivers disagree on the span of torque (±18 or ±35), so that it is
/// an argument where torque is requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointFrame {
    /// What a joint is to do.
    Command {
        /// 16 bits.
        position: u16,
        /// 12 bits.
        speed: u16,
        /// 12 bits.
        stiffness: u16,
        /// 12 bits.
        damping: u16,
        /// 12 bits.
        torque: u16,
    },
    /// What a joint does.
    Feedback {
        /// Number of the joint.
        joint: u8,
        /// 16 bits.
        position: u16,
        /// 12 bits.
        speed: u16,
        /// 12 bits.
        torque: u16,
    },
    /// Take commands from now on.
    Enter,
    /// Take none any more; one driver has it for setting zero.
    Leave,
    /// Make the present position zero.
    SetZero,
}

impl JointFrame {
    /// The joint's frame that this is; commands have 8 bytes and feedback 6.
    pub fn decode(frame: &Frame) -> Option<Self> {
        if frame.kind() != FrameKind::Data {
            return None;
        }
        match *frame.bytes() {
            [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, last @ 0xFC..=0xFE] => Some(match last {
                0xFC => Self::Enter,
                0xFD => Self::Leave,
                _ => Self::SetZero,
            }),
            [p1, p0, v1, v0_kp1, kp0, kd1, kd0_t1, t0] => Some(Self::Command {
                position: u16::from_be_bytes([p1, p0]),
                speed: upper(v1, v0_kp1),
                stiffness: lower(v0_kp1, kp0),
                damping: upper(kd1, kd0_t1),
                torque: lower(kd0_t1, t0),
            }),
            [joint, p1, p0, v1, v0_t1, t0] => Some(Self::Feedback {
                joint,
                position: u16::from_be_bytes([p1, p0]),
                speed: upper(v1, v0_t1),
                torque: lower(v0_t1, t0),
            }),
            _ => None,
        }
    }

    /// The frame on this identifier.
    pub fn frame(&self, id: FrameId) -> Frame {
        let special = |last| Frame::full(id, [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, last]);
        match *self {
            Self::Enter => special(0xFC),
            Self::Leave => special(0xFD),
            Self::SetZero => special(0xFE),
            Self::Command { position, speed, stiffness, damping, torque } => {
                let ([p1, p0], [a, b, c], [d, e, f]) =
                    (position.to_be_bytes(), pair(speed, stiffness), pair(damping, torque));
                Frame::full(id, [p1, p0, a, b, c, d, e, f])
            }
            Self::Feedback { joint, position, speed, torque } => {
                let ([p1, p0], [a, b, c]) = (position.to_be_bytes(), pair(speed, torque));
                Frame::data(id, &[joint, p1, p0, a, b, c]).expect("six bytes are a frame")
            }
        }
    }

    /// Angle, rad.
    pub fn position_rad(&self) -> Option<f64> {
        let (Self::Command { position, .. } | Self::Feedback { position, .. }) = *self else { return None };
        Some(within(position, 16, POSITION_RAD))
    }

    /// Speed, rad/s.
    pub fn speed_rad_s(&self) -> Option<f64> {
        let (Self::Command { speed, .. } | Self::Feedback { speed, .. }) = *self else { return None };
        Some(within(speed, 12, SPEED_RAD_S))
    }

    /// Torque in the unit of its span: 18 or 35.
    pub fn torque(&self, span: f64) -> Option<f64> {
        let (Self::Command { torque, .. } | Self::Feedback { torque, .. }) = *self else { return None };
        Some(within(torque, 12, span))
    }

    /// Stiffness and damping of a command.
    pub fn gains(&self) -> Option<[f64; 2]> {
        let Self::Command { stiffness, damping, .. } = *self else { return None };
        Some([f64::from(stiffness) * STIFFNESS / 4095.0, f64::from(damping) * DAMPING / 4095.0])
    }
}

/// The value of `bits` bits between minus and plus the bound.
fn within(raw: u16, bits: u32, bound: f64) -> f64 {
    f64::from(raw) * 2.0 * bound / f64::from((1_u32 << bits) - 1) - bound
}

/// A byte and the upper half of the next one.
fn upper(high: u8, low: u8) -> u16 {
    u16::from(high) << 4 | u16::from(low) >> 4
}

/// The lower half of a byte and the next one.
fn lower(high: u8, low: u8) -> u16 {
    u16::from(high & 0xF) << 8 | u16::from(low)
}

/// Two fields of 12 bits.
fn pair(first: u16, second: u16) -> [u8; 3] {
    [(first >> 4) as u8, ((first & 0xF) << 4 | second >> 8 & 0xF) as u8, second as u8]
}

/// Identifiers of leg joints: commands carry the joint's number, and answers that of the computer, which is small too.
/// Any frame of 6 or 8 bytes could be a joint's, so that others are left alone.
const JOINT_IDS: std::ops::RangeInclusive<u16> = 0..=0x1F;

/// A leg joint's frame; torque is a fraction of the greatest one, on which drivers of these joints disagree.
pub(super) fn describe(frame: &Frame) -> Option<String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    const ID: FrameId = FrameId::Standard(1);

    fn read(bytes: &[u8]) -> JointFrame {
        let frame = Frame::data(ID, bytes).unwrap();
        let joint = JointFrame::decode(&frame).expect("a joint's frame");
        assert_eq!(joint.frame(ID), frame);
        joint
    }

    fn near(ours: Option<f64>, theirs: f64, tolerance: f64) {
        assert!((ours.unwrap() - theirs).abs() <= tolerance, "{ours:?} {theirs}");
    }

    #[test]
    fn a_command_says_what_it_should() {
        let command = read(&[0x7F, 0xFF, 0x7F, 0xF0, 0x00, 0x33, 0x38, 0xE3]);
        near(command.position_rad(), 0.0, 0.0015);
        near(command.speed_rad_s(), 0.0, 0.0111);
        near(command.torque(18.0), 2.0, 0.005);
        let [stiffness, damping] = command.gains().unwrap();
        assert!(stiffness == 0.0 && (damping - 1.0).abs() < 0.001);
        let other =
            JointFrame::Command { position: 0x7FFF, speed: 0x7FF, stiffness: 0, damping: 819, torque: 0x874 };
        near(other.torque(35.0), 2.0, 0.01);
    }

    #[test]
    fn feedback_says_what_it_should() {
        let feedback = read(&[0x01, 0x80, 0x00, 0x80, 0x08, 0xE3]);
        let JointFrame::Feedback { joint: 1, .. } = feedback else { panic!("{feedback:?}") };
        near(feedback.position_rad(), 0.0015, 0.0001);
        near(feedback.speed_rad_s(), 0.011, 0.0001);
        near(feedback.torque(18.0), 2.0, 0.005);
        assert_eq!(feedback.gains(), None);
    }

    #[test]
    fn special_frames_are_told() {
        let special = |last| read(&[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, last]);
        let [enter, leave, zero] = [0xFC, 0xFD, 0xFE].map(special);
        assert_eq!([enter, leave, zero], [JointFrame::Enter, JointFrame::Leave, JointFrame::SetZero]);
        assert_eq!((enter.position_rad(), enter.speed_rad_s(), enter.torque(18.0)), (None, None, None));
        assert_eq!(JointFrame::decode(&Frame::data(ID, &[0; 5]).unwrap()), None);
        assert_eq!(JointFrame::decode(&Frame::remote(ID, 8).unwrap()), None);
    }
}
