//! Which signal is what.

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::str::FromStr;

use crate::model::Motor;

/// What a signal can be; forward positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Pitch.
    Pitch,
    /// Pitch rate.
    PitchRate,
    /// Angle of a motor.
    Angle(Motor),
    /// Speed of a motor.
    Speed(Motor),
    /// Torque of a motor.
    Torque(Motor),
    /// Temperature of a motor.
    Temperature(Motor),
}

impl Quantity {
    /// All, with the names of the robot log's columns.
    pub const NAMES: [(Self, &'static str); 10] = [
        (Self::Pitch, "pitch_rad"),
        (Self::PitchRate, "pitch_rate_rad_s"),
        (Self::Angle(Motor::Left), "motor_angle_left_rad"),
        (Self::Angle(Motor::Right), "motor_angle_right_rad"),
        (Self::Speed(Motor::Left), "motor_speed_left_rad_s"),
        (Self::Speed(Motor::Right), "motor_speed_right_rad_s"),
        (Self::Torque(Motor::Left), "torque_left_nm"),
        (Self::Torque(Motor::Right), "torque_right_nm"),
        (Self::Temperature(Motor::Left), "motor_temperature_left_c"),
        (Self::Temperature(Motor::Right), "motor_temperature_right_c"),
    ];

    /// Its name in a robot log.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(known, _)| *known == self).map_or("", |(_, name)| name)
    }

    /// The quantity of this name, with or without its unit: `pitch` is `pitch_rad`.
    fn named(name: &str) -> Option<Self> {
        let without_unit = |known: &'static str| {
            ["_rad_s", "_rad", "_nm", "_c"].iter().find_map(|unit| known.strip_suffix(unit))
        };
        let mut names = Self::NAMES.iter();
        names.find(|(_, known)| *known == name || without_unit(known) == Some(name)).map(|(known, _)| *known)
    }

    /// What a unit of a DBC file is worth in the unit of this quantity; none of a unit that does not fit or is
    /// not known.
    pub fn factor_from_unit(self, unit: &str) -> Option<f64> {
        let unit = unit.trim().to_lowercase().replace([' ', '*', '·', '.'], "");
        let (angle, speed) = match unit.as_str() {
            "rad" => (Some(1.0), None),
            "mrad" => (Some(1e-3), None),
            "deg" | "°" | "degree" | "degrees" => (Some(PI / 180.0), None),
            "rev" | "turn" | "turns" => (Some(TAU), None),
            "rad/s" => (None, Some(1.0)),
            "mrad/s" => (None, Some(1e-3)),
            "deg/s" | "°/s" | "dps" | "degree/s" => (None, Some(PI / 180.0)),
            "rpm" | "1/min" | "rev/min" => (None, Some(TAU / 60.0)),
            "rev/s" | "1/s" => (None, Some(TAU)),
            _ => (None, None),
        };
        match self {
            Self::Pitch | Self::Angle(_) => angle,
            Self::PitchRate | Self::Speed(_) => speed,
            Self::Torque(_) => match unit.as_str() {
                "nm" => Some(1.0),
                "mnm" => Some(1e-3),
                _ => None,
            },
            Self::Temperature(_) => matches!(unit.as_str(), "c" | "°c" | "degc").then_some(1.0),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A quantity and the signal that has it, as text `QUANTITY=SIGNAL`, `QUANTITY=MESSAGE.SIGNAL`, or one of these
/// with `*FACTOR`; the unit of the quantity may be left out, as in `pitch=SIGNAL`.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// What it is.
    pub quantity: Quantity,
    /// Message of the signal, where signals of several messages have its name.
    pub message: Option<String>,
    /// Name of the signal.
    pub signal: String,
    /// What its value is multiplied by; where none is given, the unit in the file decides.
    pub factor: Option<f64>,
}

/// A choice that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChoiceSyntaxError {
    /// Not of the form.
    #[error("`{text}` must have the form COLUMN=MESSAGE.SIGNAL or COLUMN=MESSAGE.SIGNAL*FACTOR")]
    Form {
        /// What was given.
        text: String,
    },
    /// No such quantity.
    #[error("unknown column `{name}`: use one of {}", names())]
    Quantity {
        /// What was given.
        name: String,
    },
}

fn names() -> String {
    Quantity::NAMES.map(|(_, name)| name).join(", ")
}

impl FromStr for Choice {
    type Err = ChoiceSyntaxError;

    fn from_str(text: &str) -> Result<Self, ChoiceSyntaxError> {
        let form = || ChoiceSyntaxError::Form { text: text.to_owned() };
        let (name, source) = text.split_once('=').ok_or_else(form)?;
        let name = name.trim();
        let quantity =
            Quantity::named(name).ok_or_else(|| ChoiceSyntaxError::Quantity { name: name.to_owned() })?;
        let (signal, factor) = match source.split_once('*') {
            None => (source, None),
            Some((signal, factor)) => {
                let factor = factor.trim().parse().ok().filter(|factor: &f64| factor.is_finite());
                (signal, Some(factor.ok_or_else(form)?))
            }
        };
        let (message, signal) = match signal.trim().split_once('.') {
            None => (None, signal.trim()),
            Some((message, signal)) => (Some(message.to_owned()), signal),
        };
        if signal.is_empty() || message.as_deref() == Some("") {
            return Err(form());
        }
        Ok(Self { quantity, message, signal: signal.to_owned(), factor })
    }
}
