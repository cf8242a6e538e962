//! Units of plotted quantities, and the ones that the user has chosen to see.

use egui::{Context, Id};

/// Display unit of a quantity; values are in the core's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// An angle, rad.
    Angle,
    /// An angular speed, rad/s.
    AngularSpeed,
    /// A torque, N m, and how much of it a motor makes of a current, N m/A, where that is known.
    Torque(Option<f64>),
    /// Anything that is shown in the core's unit.
    Plain(&'static str),
}

/// The units that are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitChoice {
    /// Degrees in place of radians.
    pub degrees: bool,
    /// Motor current in place of torque, where the motor's constant is known.
    pub amperes: bool,
}

impl Default for UnitChoice {
    fn default() -> Self {
        Self { degrees: true, amperes: false }
    }
}

/// Returns whether angles are shown in degrees: one choice for all of the window, which its session keeps.
pub(crate) fn degrees(ctx: &Context) -> bool {
    ctx.data(|data| data.get_temp(degrees_id())).unwrap_or_else(|| UnitChoice::default().degrees)
}

/// Makes that choice.
pub(crate) fn set_degrees(ctx: &Context, degrees: bool) {
    ctx.data_mut(|data| data.insert_temp(degrees_id(), degrees));
}

fn degrees_id() -> Id {
    Id::unique("degrees")
}

impl UnitChoice {
    /// Torques, and angles as all of the window shows them.
    pub(crate) fn of(ctx: &Context) -> Self {
        Self { degrees: degrees(ctx), ..Self::default() }
    }
}

impl Unit {
    /// The unit of this name, with what it can be shown in.
    pub(crate) fn named(unit: &'static str) -> Self {
        match unit {
            "rad" => Self::Angle,
            "rad/s" => Self::AngularSpeed,
            "N m" => Self::Torque(None),
            _ => Self::Plain(unit),
        }
    }

    /// The shown unit, and the factor from the core's unit to it.
    pub fn shown(self, choice: UnitChoice) -> (&'static str, f64) {
        let degrees = 1.0_f64.to_degrees();
        match self {
            Self::Angle if choice.degrees => ("°", degrees),
            Self::Angle => ("rad", 1.0),
            Self::AngularSpeed if choice.degrees => ("°/s", degrees),
            Self::AngularSpeed => ("rad/s", 1.0),
            Self::Torque(Some(nm_per_a)) if choice.amperes && nm_per_a > 0.0 => ("A", 1.0 / nm_per_a),
            Self::Torque(_) => ("N m", 1.0),
            Self::Plain(unit) => (unit, 1.0),
        }
    }
}

/// Name and unit, for an axis.
pub(super) fn label(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_follow_the_choice_where_they_can() {
        let choice = UnitChoice { degrees: false, amperes: true };
        assert_eq!(Unit::Torque(Some(0.5)).shown(choice), ("A", 2.0));
        assert_eq!(Unit::Torque(None).shown(choice), ("N m", 1.0));
        assert_eq!(Unit::Angle.shown(choice), ("rad", 1.0));
        assert_eq!(Unit::AngularSpeed.shown(UnitChoice::default()).0, "°/s");
    }
}
