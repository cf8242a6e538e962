//! The parameters of a model: keys, units, tolerances, plausible ranges and places, one row each.

use std::ops::RangeInclusive;

use super::{MachineKind, RobotParameters};
use crate::friction::StribeckParameters;
use crate::unit_slip::{
    CENTIMETRES, DEGREES_PER_SECOND, GRAM_SQUARE_CENTIMETRES, GRAMS, KILOGRAM_SQUARE_CENTIMETRES,
    KILOGRAM_SQUARE_MILLIMETRES, MILLIMETRES, MILLINEWTON_METRES, RPM, STANDARD_GRAVITIES, UnitSlip,
};

/// A parameter of a robot, a motor shaft or a linear axis.
#[derive(Clone, Debug)]
pub struct ModelParameter {
    /// Key in the model file, which ends in the unit.
    pub key: &'static str,
    /// Name for people.
    pub name: &'static str,
    /// Unit; empty for a number without one.
    pub unit: &'static str,
    /// Explanation in a few words.
    pub help: &'static str,
    /// Table of the model file.
    pub table: &'static str,
    /// Machines that have it.
    pub machines: &'static [MachineKind],
    /// Tolerance group.
    pub tolerance: ToleranceGroup,
    /// Values that a real machine is likely to have.
    pub(crate) plausible: RangeInclusive<f64>,
    /// Units that it is likely to be given in by mistake.
    pub(crate) slips: &'static [UnitSlip],
    /// Effect that stands for an error of it.
    pub(crate) effect: Option<&'static str>,
    /// True if a robot's log can correct it.
    pub(crate) refined_on_robot: bool,
    /// ParameterPlace of the value.
    pub place: ParameterPlace,
}

/// ParameterPlace of a parameter's value.
#[derive(Clone, Copy, Debug)]
pub enum ParameterPlace {
    /// In a robot's parameters.
    Robot(fn(&mut RobotParameters) -> &mut f64),
    /// In a friction curve.
    Friction(fn(&mut StribeckParameters) -> &mut f64),
    /// In the parameters of an axis.
    Axis,
}

/// Parameters that share a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToleranceGroup {
    /// Masses.
    Masses,
    /// Lengths.
    Lengths,
    /// Moments of inertia.
    Inertias,
    /// Friction.
    Friction,
    /// A mass on a lever: known as well as both together.
    MassesAndLengths,
    /// Taken as exact.
    Exact,
}

const ROBOT: &[MachineKind] = &[MachineKind::Robot];
const ROTARY: &[MachineKind] = &[MachineKind::Rotary];
const LINEAR: &[MachineKind] = &[MachineKind::Linear];
const TURNING: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary];
const ALL: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];

const LENGTH: &[UnitSlip] = &[MILLIMETRES, CENTIMETRES];
const INERTIA: &[UnitSlip] =
    &[KILOGRAM_SQUARE_CENTIMETRES, KILOGRAM_SQUARE_MILLIMETRES, GRAM_SQUARE_CENTIMETRES];
const TORQUE: &[UnitSlip] = &[MILLINEWTON_METRES];

/// Row of a robot's parameter; [`ModelParameter`] updates what differs.
const BODY: ModelParameter = ModelParameter {
    key: "",
    name: "",
    unit: "",
    help: "",
    table: "robot",
    machines: ROBOT,
    tolerance: ToleranceGroup::Exact,
    plausible: f64::NEG_INFINITY..=f64::INFINITY,
    slips: &[],
    effect: None,
    refined_on_robot: true,
    place: ParameterPlace::Axis,
};
/// Row of a friction parameter of a motor.
const CURVE: ModelParameter =
    ModelParameter { table: "friction", machines: TURNING, tolerance: ToleranceGroup::Friction, ..BODY };

/// All parameters. A plausible range reaches from toys of 50 g to machines of 300 kg; a zero that is allowed is
/// plausible.
pub static PARAMETERS: [ModelParameter; 21] = [
    ModelParameter {
        key: "body_mass_kg",
        name: "body mass",
        unit: "kg",
        help: "Everything above the axle",
        tolerance: ToleranceGroup::Masses,
        plausible: 0.02..=300.0,
        slips: &[GRAMS],
        effect: Some("mass_error"),
        place: ParameterPlace::Robot(|p| &mut p.body_mass_kg),
        ..BODY
    },
    ModelParameter {
        key: "com_height_m",
        name: "centre of mass",
        unit: "m",
        help: "Axle to the body's centre of mass",
        tolerance: ToleranceGroup::Lengths,
        plausible: 0.005..=1.5,
        slips: LENGTH,
        effect: Some("com_height_error"),
        place: ParameterPlace::Robot(|p| &mut p.com_height_m),
        ..BODY
    },
    ModelParameter {
        key: "body_inertia_kg_m2",
        name: "body inertia",
        unit: "kg m²",
        help: "About the body's centre of mass",
        tolerance: ToleranceGroup::Inertias,
        plausible: 1e-7..=100.0,
        slips: INERTIA,
        effect: Some("body_inertia_error"),
        place: ParameterPlace::Robot(|p| &mut p.body_inertia_kg_m2),
        ..BODY
    },
    ModelParameter {
        key: "wheel_inertia_kg_m2",
        name: "wheel inertia",
        unit: "kg m²",
        help: "One wheel and its rotor about the axle",
        tolerance: ToleranceGroup::Inertias,
        plausible: 1e-8..=5.0,
        slips: INERTIA,
        effect: Some("inertia_error"),
        place: ParameterPlace::Robot(|p| &mut p.wheel_inertia_kg_m2),
        ..BODY
    },
    ModelParameter {
        key: "wheel_mass_kg",
        name: "wheel mass",
        unit: "kg",
        help: "One wheel",
        tolerance: ToleranceGroup::Masses,
        plausible: 0.002..=50.0,
        slips: &[GRAMS],
        place: ParameterPlace::Robot(|p| &mut p.wheel_mass_kg),
        ..BODY
    },
    ModelParameter {
        key: "wheel_radius_m",
        name: "wheel radius",
        unit: "m",
        help: "Axle to ground",
        tolerance: ToleranceGroup::Lengths,
        plausible: 0.01..=0.6,
        slips: LENGTH,
        refined_on_robot: false,
        place: ParameterPlace::Robot(|p| &mut p.wheel_radius_m),
        ..BODY
    },
    ModelParameter {
        key: "gravity_m_s2",
        name: "gravity",
        unit: "m/s²",
        help: "Gravitational acceleration",
        plausible: 1.5..=30.0,
        slips: &[STANDARD_GRAVITIES],
        refined_on_robot: false,
        place: ParameterPlace::Robot(|p| &mut p.gravity_m_s2),
        ..BODY
    },
    ModelParameter {
        key: "coulomb_nm",
        name: "Coulomb",
        unit: "N m",
        help: "Coulomb friction",
        plausible: 0.0..=10.0,
        slips: TORQUE,
        effect: Some("coulomb_error"),
        place: ParameterPlace::Friction(|p| &mut p.coulomb_nm),
        ..CURVE
    },
    ModelParameter {
        key: "static_nm",
        name: "static",
        unit: "N m",
        help: "Static (breakaway) friction",
        plausible: 0.0..=10.0,
        slips: TORQUE,
        place: ParameterPlace::Friction(|p| &mut p.static_nm),
        ..CURVE
    },
    ModelParameter {
        key: "viscous_nm_s_rad",
        name: "viscous",
        unit: "N m s/rad",
        help: "Viscous friction coefficient",
        plausible: 0.0..=1.0,
        effect: Some("viscous_error"),
        place: ParameterPlace::Friction(|p| &mut p.viscous_nm_s_rad),
        ..CURVE
    },
    ModelParameter {
        key: "stribeck_speed_rad_s",
        name: "Stribeck speed",
        unit: "rad/s",
        help: "Stribeck speed",
        plausible: 1e-4..=200.0,
        slips: &[RPM, DEGREES_PER_SECOND],
        refined_on_robot: false,
        place: ParameterPlace::Friction(|p| &mut p.stribeck_speed_rad_s),
        ..CURVE
    },
    ModelParameter {
        key: "stribeck_exponent",
        name: "exponent",
        help: "Stribeck exponent",
        machines: ALL,
        refined_on_robot: false,
        place: ParameterPlace::Friction(|p| &mut p.stribeck_exponent),
        ..CURVE
    },
    ModelParameter {
        key: "offset_nm",
        name: "offset",
        unit: "N m",
        help: "Constant offset",
        plausible: -5.0..=5.0,
        slips: TORQUE,
        place: ParameterPlace::Friction(|p| &mut p.offset_nm),
        ..CURVE
    },
    ModelParameter {
        key: "inertia_kg_m2",
        name: "inertia",
        unit: "kg m²",
        help: "About the shaft",
        table: "axis",
        machines: ROTARY,
        tolerance: ToleranceGroup::Inertias,
        plausible: 1e-9..=1e3,
        slips: INERTIA,
        effect: Some("inertia_error"),
        ..BODY
    },
    ModelParameter {
        key: "gravity_torque_nm",
        name: "gravity torque",
        unit: "N m",
        help: "Torque of the load with the shaft horizontal",
        table: "axis",
        machines: ROTARY,
        tolerance: ToleranceGroup::MassesAndLengths,
        plausible: -1e3..=1e3,
        slips: TORQUE,
        ..BODY
    },
    ModelParameter {
        key: "mass_kg",
        name: "mass",
        unit: "kg",
        help: "Moved mass",
        table: "axis",
        machines: LINEAR,
        tolerance: ToleranceGroup::Masses,
        plausible: 1e-3..=1e5,
        slips: &[GRAMS],
        effect: Some("inertia_error"),
        ..BODY
    },
    ModelParameter {
        key: "coulomb_n",
        name: "Coulomb",
        unit: "N",
        help: "Coulomb friction",
        machines: LINEAR,
        plausible: 0.0..=1e4,
        effect: Some("coulomb_error"),
        place: ParameterPlace::Friction(|p| &mut p.coulomb_nm),
        ..CURVE
    },
    ModelParameter {
        key: "static_n",
        name: "static",
        unit: "N",
        help: "Static (breakaway) friction",
        machines: LINEAR,
        plausible: 0.0..=1e4,
        place: ParameterPlace::Friction(|p| &mut p.static_nm),
        ..CURVE
    },
    ModelParameter {
        key: "viscous_n_s_m",
        name: "viscous",
        unit: "N s/m",
        help: "Viscous friction coefficient",
        machines: LINEAR,
        effect: Some("viscous_error"),
        place: ParameterPlace::Friction(|p| &mut p.viscous_nm_s_rad),
        ..CURVE
    },
    ModelParameter {
        key: "stribeck_speed_m_s",
        name: "Stribeck speed",
        unit: "m/s",
        help: "Stribeck speed",
        machines: LINEAR,
        plausible: 1e-6..=5.0,
        place: ParameterPlace::Friction(|p| &mut p.stribeck_speed_rad_s),
        ..CURVE
    },
    ModelParameter {
        key: "offset_n",
        name: "offset",
        unit: "N",
        help: "Constant offset",
        machines: LINEAR,
        plausible: -5e3..=5e3,
        place: ParameterPlace::Friction(|p| &mut p.offset_nm),
        ..CURVE
    },
];

impl ModelParameter {
    /// Looks a parameter up by its key.
    pub fn of_key(key: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|parameter| parameter.key == key)
    }

    /// Returns the parameter of a kind of machine whose error an effect stands for.
    pub(crate) fn of_effect(effect: &str, machine: MachineKind) -> Option<&'static Self> {
        PARAMETERS
            .iter()
            .find(|parameter| parameter.effect == Some(effect) && parameter.machines.contains(&machine))
    }

    /// Returns the parameters in [`RobotParameters`] with their places.
    pub fn of_robot() -> impl Iterator<Item = (&'static Self, fn(&mut RobotParameters) -> &mut f64)> {
        PARAMETERS.iter().filter_map(|parameter| match parameter.place {
            ParameterPlace::Robot(place) => Some((parameter, place)),
            ParameterPlace::Friction(_) | ParameterPlace::Axis => None,
        })
    }

    /// Returns the keys of the parameters that a robot's log can correct.
    pub(crate) fn refined_on_robot() -> impl Iterator<Item = &'static str> {
        let refined = |row: &&Self| row.refined_on_robot && row.machines.contains(&MachineKind::Robot);
        PARAMETERS.iter().filter(refined).map(|row| row.key)
    }

    /// Returns the parameters of a motor's friction curve with their places.
    pub fn of_motor_friction()
    -> impl Iterator<Item = (&'static Self, fn(&mut StribeckParameters) -> &mut f64)> {
        PARAMETERS.iter().filter(|parameter| parameter.machines.contains(&MachineKind::Robot)).filter_map(
            |parameter| match parameter.place {
                ParameterPlace::Friction(place) => Some((parameter, place)),
                ParameterPlace::Robot(_) | ParameterPlace::Axis => None,
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_unique_and_places_are_all_of_them() {
        for (at, parameter) in PARAMETERS.iter().enumerate() {
            assert!(PARAMETERS[..at].iter().all(|other| other.key != parameter.key), "{}", parameter.key);
            assert!(!parameter.name.is_empty() && !parameter.help.is_empty(), "{}", parameter.key);
        }
        let mut robot = RobotParameters {
            body_mass_kg: 0.0,
            wheel_mass_kg: 0.0,
            wheel_inertia_kg_m2: 0.0,
            wheel_radius_m: 0.0,
            com_height_m: 0.0,
            body_inertia_kg_m2: 0.0,
            gravity_m_s2: 0.0,
        };
        ModelParameter::of_robot()
            .zip(1_u8..)
            .for_each(|((_, place), value)| *place(&mut robot) = f64::from(value));
        let RobotParameters { body_mass_kg, wheel_mass_kg, wheel_inertia_kg_m2, wheel_radius_m, .. } = robot;
        let RobotParameters { com_height_m, body_inertia_kg_m2, gravity_m_s2, .. } = robot;
        let values = [body_mass_kg, com_height_m, body_inertia_kg_m2, wheel_inertia_kg_m2, wheel_mass_kg];
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!([wheel_radius_m, gravity_m_s2], [6.0, 7.0]);
        assert_eq!(ModelParameter::of_motor_friction().count(), 6);
    }
}
