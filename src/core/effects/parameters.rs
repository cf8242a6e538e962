//! Errors of declared parameters of body and wheels.

use super::kind::{Declared, EffectKind, Feedforward, Parameter, Place, Signal, Trial};
use super::law::{Action, MotionSample, Term};
use crate::model::{
    AxisModel, AxisParameters, Effect, MachineKind, ModelParameter, ParameterPlace, RobotParameters,
};

const ROBOT: &[MachineKind] = &[MachineKind::Robot];

/// Error of the declared body mass, at the same height.
pub(super) static MASS_ERROR: EffectKind = EffectKind {
    id: "mass_error",
    summary: "error of the body mass, at the declared height of the centre of mass",
    place: Place::Parameter,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("mass_kg", [-100.0, 100.0], "correction of the declared value")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let (height, gravity) = (machine.parameters.com_height_m, machine.parameters.gravity_m_s2);
        vec![Term::new("mass_kg", move |m: &MotionSample| {
            let (sin, cos) = libm::sincos(m.pitch_rad);
            let (rate, accel) = (m.pitch_rate_rad_s, m.pitch_accel_rad_s2);
            Action {
                axle_n: -(m.x_accel_m_s2 + height * (cos * accel - sin * rate * rate)),
                body_nm: -height * (height * accel + cos * m.x_accel_m_s2 - gravity * sin),
                ..Action::default()
            }
        })]
    },
    separated_by: "a scale; a second leg height",
    feedforward: Feedforward::Declared,
    declare: correct_robot,
};

/// Error of the declared height of the centre of mass.
pub(super) static COM_HEIGHT_ERROR: EffectKind = EffectKind {
    id: "com_height_error",
    summary: "error of the declared height of the centre of mass",
    place: Place::Parameter,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("height_m", [-3.0, 3.0], "correction, to first order")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let RobotParameters { body_mass_kg: mass, com_height_m: height, gravity_m_s2: gravity, .. } =
            machine.parameters;
        vec![Term::new("height_m", move |m: &MotionSample| {
            let (sin, cos) = libm::sincos(m.pitch_rad);
            let (rate, accel) = (m.pitch_rate_rad_s, m.pitch_accel_rad_s2);
            Action {
                axle_n: -mass * (cos * accel - sin * rate * rate),
                body_nm: -mass * (2.0 * height * accel + cos * m.x_accel_m_s2 - gravity * sin),
                ..Action::default()
            }
        })]
    },
    separated_by: "balancing the body on an edge; a second leg height",
    feedforward: Feedforward::Declared,
    declare: correct_robot,
};

/// Error of the declared body inertia.
pub(super) static BODY_INERTIA_ERROR: EffectKind = EffectKind {
    id: "body_inertia_error",
    summary: "error of the declared inertia of the body about its centre of mass",
    place: Place::Parameter,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("inertia_kg_m2", [-100.0, 100.0], "correction of the declared value")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |_, _| {
        vec![Term::new("inertia_kg_m2", |m: &MotionSample| Action::body(-m.pitch_accel_rad_s2))]
    },
    separated_by: "the period of the body as a pendulum, suspended at the axle",
    feedforward: Feedforward::Declared,
    declare: correct_robot,
};

/// Error of the declared wheel inertia or carriage mass.
pub(crate) static INERTIA_ERROR: EffectKind = EffectKind {
    id: "inertia_error",
    summary: "error of the declared inertia of each wheel with its rotor or of the shaft, or of the mass of the carriage",
    place: Place::Parameter,
    machines: &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear],
    parameters: &[Parameter::amplitude("inertia_kg_m2", [-100.0, 100.0], "correction of the declared value")
        .linear("mass_kg", [-1e4, 1e4])],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Acceleration),
    make_terms: |machine, _| {
        let key = INERTIA_ERROR.parameters[0].key(machine.kind);
        if machine.kind != MachineKind::Robot {
            return vec![Term::new(key, |m: &MotionSample| Action::motor(-m.motor_accel_rad_s2))];
        }
        let radius = machine.parameters.wheel_radius_m;
        let both = 2.0 / (radius * radius);
        vec![Term::new(key, move |m: &MotionSample| Action::force(-both * m.x_accel_m_s2, 0.0, 0.0))]
    },
    separated_by: "rapid speed changes with the wheel in the air",
    feedforward: Feedforward::Declared,
    declare: |effect, model| correct_moved(effect, model),
};

fn correct_moved(effect: &Effect, model: Declared<'_>) -> bool {
    let added = effect.parameters()[0].1;
    let moved = match model {
        Declared::Robot(_) => return correct_robot(effect, model),
        Declared::Axis(AxisModel {
            parameters:
                AxisParameters::Rotary { inertia_kg_m2: moved, .. }
                | AxisParameters::Linear { mass_kg: moved, .. },
            ..
        }) => moved,
    };
    let possible = *moved + added > 0.0;
    if possible {
        *moved += added;
    }
    possible
}

/// Corrects the parameter of a robot that an effect stands for, if the result is physically possible.
fn correct_robot(effect: &Effect, model: Declared<'_>) -> bool {
    let Declared::Robot(robot) = model else { return false };
    let parameter = ModelParameter::of_effect(effect.id(), MachineKind::Robot);
    let Some(ParameterPlace::Robot(place)) = parameter.map(|parameter| parameter.place) else { return false };
    let mut parameters = robot.parameters;
    *place(&mut parameters) += effect.parameters()[0].1;
    let possible = parameters.validate().is_ok();
    if possible {
        robot.set_parameters(parameters);
    }
    possible
}
