//! Names, scales and formats of quantities.

use flqr_core::effects::name_and_unit;
use flqr_core::report::number::fixed;

use crate::history::Channel;
use crate::plot::Unit;
use crate::widgets::shown;

/// Names of a robot's states, in the order of its matrices.
pub(crate) const STATES: [&str; 4] = ["displacement", "velocity", "pitch", "pitch rate"];
/// Names of its motors, as above.
pub(crate) const MOTORS: [&str; 2] = ["left", "right"];

/// Format of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quantity {
    pub(crate) name: &'static str,
    /// Unit as shown.
    pub(crate) unit: &'static str,
    /// From the core's unit to the shown one.
    pub(crate) scale: f64,
    /// A plot's vertical range is at least this long, in the shown unit.
    pub(crate) min_span: f64,
}

impl Quantity {
    pub(crate) fn of(channel: Channel, degrees: bool) -> Self {
        match (channel, degrees) {
            (Channel::Displacement, _) => Self::plain("displacement", "m", 0.02),
            (Channel::Velocity, _) => Self::plain("velocity", "m/s", 0.04),
            (Channel::Pitch, true) => Self::in_degrees("pitch", "°", 0.4),
            (Channel::Pitch, false) => Self::plain("pitch", "rad", 0.007),
            (Channel::PitchRate, true) => Self::in_degrees("pitch rate", "°/s", 2.0),
            (Channel::PitchRate, false) => Self::plain("pitch rate", "rad/s", 0.035),
            (Channel::LeftAngle, true) => Self::in_degrees("left angle", "°", 2.0),
            (Channel::LeftAngle, false) => Self::plain("left angle", "rad", 0.035),
            (Channel::RightAngle, true) => Self::in_degrees("right angle", "°", 2.0),
            (Channel::RightAngle, false) => Self::plain("right angle", "rad", 0.035),
            (Channel::LeftSpeed, _) => Self::shaft_speed("left speed", degrees),
            (Channel::RightSpeed, _) => Self::shaft_speed("right speed", degrees),
            (Channel::LeftTorque, _) => Self::plain("left torque", "N m", 0.01),
            (Channel::RightTorque, _) => Self::plain("right torque", "N m", 0.01),
        }
    }

    /// A quantity that is shown in the core's unit.
    pub(crate) const fn plain(name: &'static str, unit: &'static str, min_span: f64) -> Self {
        Self { name, unit, scale: 1.0, min_span }
    }

    /// Speed of a motor's shaft.
    pub(crate) const fn shaft_speed(name: &'static str, degrees: bool) -> Self {
        if degrees { Self::in_degrees(name, "°/s", 6.0) } else { Self::plain(name, "rad/s", 0.1) }
    }

    const fn in_degrees(name: &'static str, unit: &'static str, min_span: f64) -> Self {
        Self { name, unit, scale: 180.0 / std::f64::consts::PI, min_span }
    }

    /// Name and unit, for an axis.
    pub(crate) fn label(&self) -> String {
        format!("{} [{}]", self.name, self.unit)
    }
}

/// Name and unit of a log's column, as everywhere in the window; of another column its own name.
pub(crate) fn of_column(key: &str) -> (String, Unit) {
    let known = Channel::ALL.into_iter().find(|channel| channel.key() == key);
    if let Some(Quantity { name, unit, .. }) = known.map(|channel| Quantity::of(channel, false)) {
        return (name.to_owned(), Unit::named(unit));
    }
    match name_and_unit(key) {
        (_, "1") => (key.to_owned(), Unit::Plain("")),
        (name, unit) => (name.replace('_', " "), Unit::named(unit)),
    }
}

/// An angle with its unit and three digits.
pub(crate) fn angle(value_rad: f64, degrees: bool) -> String {
    if degrees {
        format!("{}°", shown(value_rad.to_degrees(), 3))
    } else {
        format!("{} rad", shown(value_rad, 3))
    }
}

/// From here on numbers have an exponent: a run that goes astray must not fill the page with digits.
const LARGEST_PLAIN: f64 = 1e6;

/// `value` with the decimals that make three digits of `scale`, so that numbers below each other compare.
pub(crate) fn to_scale(value: f64, scale: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value.abs() >= LARGEST_PLAIN {
        return format!("{value:.2e}").replace('-', "−");
    }
    let decimals = if scale > 0.0 { (2.0 - scale.log10().floor()).clamp(0.0, 7.0) as usize } else { 3 };
    fixed(value, decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_the_names_and_units_of_their_quantities() {
        for (key, name, unit) in [
            ("x_m", "displacement", Unit::Plain("m")),
            ("pitch_rad", "pitch", Unit::Angle),
            ("torque_left_nm", "left torque", Unit::Torque(None)),
            ("force_n", "force", Unit::Plain("N")),
            ("motor_speed_rad_s", "motor speed", Unit::AngularSpeed),
            ("remark", "remark", Unit::Plain("")),
        ] {
            assert_eq!(of_column(key), (name.to_owned(), unit), "{key}");
        }
    }

    #[test]
    fn numbers_have_three_digits_of_their_scale_and_stay_short() {
        for (value, scale, text) in [
            (0.07997, 0.008, "0.07997"),
            (-0.0004, 1.0, "0.00"),
            (-12.5, 30.0, "−12.5"),
            (-2.1e300, 1.0, "−2.10e300"),
            (f64::NAN, 1.0, "–"),
            (1.0, f64::INFINITY, "1"),
        ] {
            assert_eq!(to_scale(value, scale), text);
        }
    }
}
