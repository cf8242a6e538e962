//! Rows of a robot's recorder, simulated or real.

use super::schema::{self, Column};
use crate::model::{Motor, State};
use crate::record::Readings;

/// Row of the robot's recorder: measured values, and the torque that was required of the
/// motors. The columns are those of a robot log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time since the start as the recorder stamped it, s.
    pub time_s: f64,
    /// Displacement from encoders and IMU, m.
    pub x_m: f64,
    /// Speed from motor speeds and IMU, m/s.
    pub x_dot_m_s: f64,
    /// Pitch, held between IMU samples, rad.
    pub pitch_rad: f64,
    /// Pitch rate, held between IMU samples, rad/s.
    pub pitch_rate_rad_s: f64,
    /// Left encoder, rad.
    pub motor_angle_left_rad: f64,
    /// Right encoder, rad.
    pub motor_angle_right_rad: f64,
    /// Left motor's speed, rad/s.
    pub motor_speed_left_rad_s: f64,
    /// Right motor's speed, rad/s.
    pub motor_speed_right_rad_s: f64,
    /// Torque asked of the left motor, N m.
    pub torque_left_nm: f64,
    /// Torque asked of the right motor, N m.
    pub torque_right_nm: f64,
}

impl Sample {
    /// A row of what was read, what was made of it, and the torque that was requested then, left and right.
    pub fn new(time_s: f64, readings: &Readings, state: &State, asked_nm: [f64; 2]) -> Self {
        Self {
            time_s,
            x_m: state.x_m,
            x_dot_m_s: state.x_dot_m_s,
            pitch_rad: state.pitch_rad,
            pitch_rate_rad_s: state.pitch_rate_rad_s,
            motor_angle_left_rad: readings.motor_angle_rad[0],
            motor_angle_right_rad: readings.motor_angle_rad[1],
            motor_speed_left_rad_s: readings.motor_speed_rad_s[0],
            motor_speed_right_rad_s: readings.motor_speed_rad_s[1],
            torque_left_nm: asked_nm[0],
            torque_right_nm: asked_nm[1],
        }
    }

    /// A row of a robot log: values in the order of [`Sample::COLUMNS`].
    pub fn from_row(row: [f64; 11]) -> Self {
        let mut sample = Self::default();
        for (column, value) in SAMPLE_COLUMNS.iter().zip(row) {
            *(column.place)(&mut sample) = value;
        }
        sample
    }

    /// Names of the columns of a robot log, in the order of [`Sample::to_row`].
    pub const COLUMNS: [&'static str; 11] = schema::names(&SAMPLE_COLUMNS);

    /// The values in the order of [`Sample::COLUMNS`].
    pub fn to_row(&self) -> [f64; 11] {
        let mut sample = *self;
        SAMPLE_COLUMNS.map(|column| *(column.place)(&mut sample))
    }
}

/// Required columns of a robot log. The unit of each is the ending of its name.
pub(super) const SAMPLE_COLUMNS: [Column<Sample, f64>; 11] = [
    Column { name: "time_s", topic: None, place: |row| &mut row.time_s },
    Column { name: "x_m", topic: Some(("/state", "x_m")), place: |row| &mut row.x_m },
    Column { name: "x_dot_m_s", topic: Some(("/state", "x_dot_m_s")), place: |row| &mut row.x_dot_m_s },
    Column { name: "pitch_rad", topic: Some(("/state", "pitch_rad")), place: |row| &mut row.pitch_rad },
    Column {
        name: "pitch_rate_rad_s",
        topic: Some(("/state", "pitch_rate_rad_s")),
        place: |row| &mut row.pitch_rate_rad_s,
    },
    Column {
        name: "motor_angle_left_rad",
        topic: Some(("/motors/left", "angle_rad")),
        place: |row| &mut row.motor_angle_left_rad,
    },
    Column {
        name: "motor_angle_right_rad",
        topic: Some(("/motors/right", "angle_rad")),
        place: |row| &mut row.motor_angle_right_rad,
    },
    Column {
        name: "motor_speed_left_rad_s",
        topic: Some(("/motors/left", "speed_rad_s")),
        place: |row| &mut row.motor_speed_left_rad_s,
    },
    Column {
        name: "motor_speed_right_rad_s",
        topic: Some(("/motors/right", "speed_rad_s")),
        place: |row| &mut row.motor_speed_right_rad_s,
    },
    Column {
        name: "torque_left_nm",
        topic: Some(("/motors/left", "torque_nm")),
        place: |row| &mut row.torque_left_nm,
    },
    Column {
        name: "torque_right_nm",
        topic: Some(("/motors/right", "torque_nm")),
        place: |row| &mut row.torque_right_nm,
    },
];

/// Recorded signals of two motors with their wheels in the air, left then right; of a single shaft both
/// entries are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BenchSample {
    /// Time since the start as the recorder stamped it, s.
    pub time_s: f64,
    /// Encoders, rad.
    pub motor_angle_rad: [f64; 2],
    /// Measured speeds, rad/s.
    pub motor_speed_rad_s: [f64; 2],
    /// Torques asked of the motors, N m.
    pub torque_nm: [f64; 2],
    /// Speed that both are to have, rad/s.
    pub target_speed_rad_s: f64,
}

impl BenchSample {
    /// Names of the columns of a bench log, in the order of [`BenchSample::to_row`].
    pub const COLUMNS: [&'static str; 5] =
        ["time_s", "motor_angle_rad", "torque_nm", "motor_speed_rad_s", "target_speed_rad_s"];

    /// The values of one motor in the order of [`BenchSample::COLUMNS`].
    pub fn to_row(&self, motor: Motor) -> [f64; 5] {
        let motor = motor as usize;
        [
            self.time_s,
            self.motor_angle_rad[motor],
            self.torque_nm[motor],
            self.motor_speed_rad_s[motor],
            self.target_speed_rad_s,
        ]
    }
}
