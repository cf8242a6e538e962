//! Wiring of the robot: motors on CAN, IMU on a serial line.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, positive, within};

/// Keys of the model file's `[link]` table. Sources disagree on scales and identifiers, so what cannot be read
/// off the wire is a setting; without `torque_constant_nm_a` a robot can be watched but not driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LinkSettings {
    /// Protocol of the motor drives. Default: lk.
    #[serde(skip_serializing_if = "MotorProtocolName::is_default")]
    pub protocol: MotorProtocolName,
    /// Number of the left motor, 1 to 32: commands go to 0x140 + id. Default: 1.
    pub left_motor_id: u8,
    /// Number of the right motor. Default: 2.
    pub right_motor_id: u8,
    /// Which way the left motor's own angle counts when the robot drives forward. Default: forward.
    pub left_direction: Turn,
    /// Same for the right motor, which is mounted the other way round. Default: backward.
    pub right_direction: Turn,
    /// Torque constant of the winding, N m/A: 0.32 of the MF9025v2-16T, 0.81 of the -35T.
    pub torque_constant_nm_a: Option<f64>,
    /// Steps of the current command in an ampere. Default: 4096/33 = 124.12 (LK protocol 2.35 and 2.36, MF series);
    /// older manuals have 62.5.
    pub current_steps_per_a: f64,
    /// Steps of the encoder in a turn. Default: 65536.
    pub encoder_steps: u32,
    /// Torque command mode. Default: each.
    pub torque_command: TorqueCommand,
    /// Layout of the reply to a query of voltage and errors. Default: current.
    pub state_layout: StateLayout,
    /// Angle of the IMU that is the robot's pitch. Default: roll, the turn about the IMU's x axis, which points
    /// to the right.
    pub pitch_axis: PitchAxis,
    /// Which way that angle counts when the body leans forward. Default: forward.
    pub pitch_direction: Turn,
    /// Readings that the IMU is to send in a second. Default: 200.
    pub imu_rate_hz: u32,
}

/// Protocol of the motor drives on the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MotorProtocolName {
    /// Shanghai Lingkong (LKMTECH), MF series.
    #[default]
    Lk,
}

impl MotorProtocolName {
    /// Returns whether it is the default, which files leave out.
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// A sense of rotation as the robot drives or leans forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Turn {
    /// The angle grows.
    Forward,
    /// The angle falls.
    Backward,
}

impl Turn {
    /// 1 or −1.
    pub fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// Torque command mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TorqueCommand {
    /// 0xA1 to each motor.
    Each,
    /// One frame for both, 0x280: ids 1 to 4, and the mode has to be set in the drives.
    Together,
}

/// Layout of the motor's state 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StateLayout {
    /// Protocol 2.35 and 2.36: voltage in 0.01 V at bytes 2 and 3.
    Current,
    /// Older firmware: voltage in 0.1 V at bytes 3 and 4.
    Older,
}

/// Angle of the IMU that is the robot's pitch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PitchAxis {
    /// The turn about the IMU's x axis.
    Roll,
    /// The turn about its y axis.
    Pitch,
}

impl Default for LinkSettings {
    fn default() -> Self {
        Self {
            protocol: MotorProtocolName::default(),
            left_motor_id: 1,
            right_motor_id: 2,
            left_direction: Turn::Forward,
            right_direction: Turn::Backward,
            torque_constant_nm_a: None,
            current_steps_per_a: 4096.0 / 33.0,
            encoder_steps: 65_536,
            torque_command: TorqueCommand::Each,
            state_layout: StateLayout::Current,
            pitch_axis: PitchAxis::Roll,
            pitch_direction: Turn::Forward,
            imu_rate_hz: 200,
        }
    }
}

impl LinkSettings {
    /// Numbers of the left and the right motor.
    pub fn motor_ids(&self) -> [u8; 2] {
        [self.left_motor_id, self.right_motor_id]
    }

    /// Senses of the left and the right motor.
    pub fn directions(&self) -> [Turn; 2] {
        [self.left_direction, self.right_direction]
    }

    /// Refuses numbers that no motor has, the same number twice, and scales that are not above zero.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let highest = if self.torque_command == TorqueCommand::Together { 4 } else { 32 };
        let allowed =
            if highest == 4 { "from 1 to 4 where torque_command = \"together\"" } else { "from 1 to 32" };
        within("left_motor_id", f64::from(self.left_motor_id), 1.0..=f64::from(highest), allowed)?;
        within("right_motor_id", f64::from(self.right_motor_id), 1.0..=f64::from(highest), allowed)?;
        if self.left_motor_id == self.right_motor_id {
            let allowed = "different from left_motor_id";
            let value = f64::from(self.right_motor_id);
            return Err(ParameterError { name: "right_motor_id", value, allowed: allowed.into() });
        }
        self.torque_constant_nm_a.map_or(Ok(()), |constant| positive("torque_constant_nm_a", constant))?;
        positive("current_steps_per_a", self.current_steps_per_a)?;
        within("encoder_steps", f64::from(self.encoder_steps), 2.0..=65_536.0, "from 2 to 65536")?;
        within("imu_rate_hz", f64::from(self.imu_rate_hz), 1.0..=200.0, "from 1 to 200")
    }
}
