//! Declared numbers of the body and the wheels that are off.

use super::effect::Effect;
use super::kind::{Declared, EffectKind, Feedforward, Parameter, Place, Signal, Trial};
use super::law::{Action, Moment, Term};
use super::machine::MachineKind;
use crate::model_file::{AxisModel, AxisParameters};
use crate::robot::RobotParameters;

const ROBOT: &[MachineKind] = &[MachineKind::Robot];

/// A declared M that is wrong, at the same height.
pub(super) static MASS_ERROR: EffectKind = EffectKind {
    id: "mass_error",
    summary: "mass of the body that is off, at the declared height",
    place: Place::Parameter,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("mass_kg", [-100.0, 100.0], "what is added to it")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let (height, gravity) = (machine.parameters.com_height_m, machine.parameters.gravity_m_s2);
        vec![Term::new("mass_kg", move |m: &Moment| {
            let (sin, cos) = libm::sincos(m.pitch_rad);
            let (rate, accel) = (m.pitch_rate_rad_s, m.pitch_accel_rad_s2);
            Action {
                axle_n: -(m.x_accel_m_s2 + height * (cos * accel - sin * rate * rate)),
                body_nm: -height * (height * accel + cos * m.x_accel_m_s2 - gravity * sin),
                ..Action::default()
            }
        })]
    },
    separated_by: "scales; a second height of the legs",
    feedforward: Feedforward::Declared,
    declare: |effect, model| {
        let added = effect.parameters()[0].1;
        correct_robot(model, |p| RobotParameters { body_mass_kg: p.body_mass_kg + added, ..p })
    },
};

/// A declared l that is wrong.
pub(super) static COM_HEIGHT_ERROR: EffectKind = EffectKind {
    id: "com_height_error",
    summary: "height of the centre of mass that is off",
    place: Place::Parameter,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("height_m", [-3.0, 3.0], "what is added to it, to first order")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let RobotParameters { body_mass_kg: mass, com_height_m: height, gravity_m_s2: gravity, .. } =
            machine.parameters;
        vec![Term::new("height_m", move |m: &Moment| {
            let (sin, cos) = libm::sincos(m.pitch_rad);
            let (rate, accel) = (m.pitch_rate_rad_s, m.pitch_accel_rad_s2);
            Action {
                axle_n: -mass * (cos * accel - sin * rate * rate),
                body_nm: -mass * (2.0 * height * accel + cos * m.x_accel_m_s2 - gravity * sin),
                ..Action::default()
            }
        })]
    },
    separated_by: "balancing the body on an edge; a second height of the legs",
    feedforward: Feedforward::Declared,
    declare: |effect, model| {
        let added = effect.parameters()[0].1;
        correct_robot(model, |p| RobotParameters { com_height_m: p.com_height_m + added, ..p })
    },
};

/// A declared J that is wrong.
pub(super) static BODY_INERTIA_ERROR: EffectKind = EffectKind {
    id: "body_inertia_error",
    summary: "inertia of the body about its centre of mass that is off",
    place: Place::Parameter,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("inertia_kg_m2", [-100.0, 100.0], "what is added to it")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |_, _| vec![Term::new("inertia_kg_m2", |m: &Moment| Action::body(-m.pitch_accel_rad_s2))],
    separated_by: "the period of the body as a pendulum, hung up by the axle",
    feedforward: Feedforward::Declared,
    declare: |effect, model| {
        let added = effect.parameters()[0].1;
        correct_robot(model, |p| RobotParameters { body_inertia_kg_m2: p.body_inertia_kg_m2 + added, ..p })
    },
};

/// A declared I, or the mass of a carriage, that is wrong.
pub(crate) static INERTIA_ERROR: EffectKind = EffectKind {
    id: "inertia_error",
    summary: "inertia of each wheel with its rotor, of the shaft, or mass of the carriage that is off",
    place: Place::Parameter,
    machines: &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear],
    parameters: &[Parameter::amplitude("inertia_kg_m2", [-100.0, 100.0], "what is added to it")
        .linear("mass_kg", [-1e4, 1e4])],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Acceleration),
    make_terms: |machine, _| {
        let key = INERTIA_ERROR.parameters[0].key(machine.kind);
        if machine.kind != MachineKind::Robot {
            return vec![Term::new(key, |m: &Moment| Action::motor(-m.motor_accel_rad_s2))];
        }
        let radius = machine.parameters.wheel_radius_m;
        let both = 2.0 / (radius * radius);
        vec![Term::new(key, move |m: &Moment| Action::force(-both * m.x_accel_m_s2, 0.0, 0.0))]
    },
    separated_by: "fast changes of speed with the wheel in the air",
    feedforward: Feedforward::Declared,
    declare: |effect, model| correct_moved(effect, model),
};

fn correct_moved(effect: &Effect, model: Declared<'_>) -> bool {
    let added = effect.parameters()[0].1;
    let moved = match model {
        Declared::Robot(_) => {
            let corrected = |p: RobotParameters| RobotParameters {
                wheel_inertia_kg_m2: p.wheel_inertia_kg_m2 + added,
                ..p
            };
            return correct_robot(model, corrected);
        }
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

/// Corrects the parameters of a robot; not into those that no robot can have.
fn correct_robot(model: Declared<'_>, corrected: impl Fn(RobotParameters) -> RobotParameters) -> bool {
    let Declared::Robot(robot) = model else { return false };
    let parameters = corrected(robot.parameters);
    let possible = parameters.validate().is_ok();
    if possible {
        robot.set_parameters(parameters);
    }
    possible
}
