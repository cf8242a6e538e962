//! Friction beside the declared curve.

use super::effect::Effect;
use super::kind::{
    Declared, EffectKind, Feedforward, Form, Grid, Parameter, Place, Signal, Step, Trial, undeclared,
};
use super::law::{Action, Moment, Term};
use super::machine::MachineKind;
use crate::friction::{Stribeck, StribeckParameters};
use crate::model_file::{AxisModel, AxisParameters};
use crate::robot::Motor;

const EVERYWHERE: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];

/// A fan's law: air around a rotor, oil in a gear.
pub(super) static QUADRATIC_DRAG: EffectKind = EffectKind {
    id: "quadratic_drag",
    summary: "torque against the motion that grows with the square of the motor's speed",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude("drag_nm_s2_rad2", [-1.0, 1.0], "torque at 1 rad/s")
        .linear("drag_n_s2_m2", [-1e5, 1e5])
        .opposing()],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Speed),
    make_terms: |machine, _| {
        vec![Term::new(QUADRATIC_DRAG.parameters[0].key(machine.kind), |m: &Moment| {
            Action::motor(-m.motor_speed_rad_s * m.motor_speed_rad_s.abs())
        })]
    },
    separated_by: "speeds four times apart and more; wheels in the air have no drag of the robot's body",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Another viscous coefficient forward than backward.
pub(super) static VISCOUS_ASYMMETRY: EffectKind = EffectKind {
    id: "viscous_asymmetry",
    summary: "viscous coefficient that is larger forward and smaller backward",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "viscous_nm_s_rad",
        [-10.0, 10.0],
        "by how much it is larger forward, and smaller backward",
    )
    .linear("viscous_n_s_m", [-1e5, 1e5])],
    wave: None,
    trial: Trial { forms: &[Form::Law, Form::Forward(&VISCOUS_ERROR)], ..Trial::PLAIN.of(Signal::Speed) },
    make_terms: |machine, _| {
        vec![Term::new(VISCOUS_ASYMMETRY.parameters[0].key(machine.kind), |m: &Moment| {
            Action::motor(-m.motor_speed_rad_s.abs())
        })]
    },
    separated_by: "the same speeds forward and backward, at least two of each",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Another level of dry friction forward than backward. Beside a curve with an offset it is that offset's error.
pub(crate) static FRICTION_ASYMMETRY: EffectKind = EffectKind {
    id: "friction_asymmetry",
    summary: "dry friction that is larger forward and smaller backward, as an offset of the friction is",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "coulomb_nm",
        [-5.0, 5.0],
        "by how much it is larger forward, and smaller backward",
    )
    .linear("coulomb_n", [-1e4, 1e4])],
    wave: None,
    trial: Trial { forms: &[Form::Law, Form::Forward(&COULOMB_ERROR)], ..Trial::PLAIN },
    make_terms: |machine, _| {
        vec![Term::new(FRICTION_ASYMMETRY.parameters[0].key(machine.kind), |_: &Moment| Action::motor(-1.0))]
    },
    separated_by: "the same speed forward and backward, on level ground and on the same strip",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Friction at low speed that the declared curve lacks, or has too much of.
pub(super) static LOW_SPEED_FRICTION: EffectKind = EffectKind {
    id: "low_speed_friction",
    summary: "level of dry friction at low speed that fades with exp(−|speed|/scale), of either sign",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("speed_rad_s", [1e-3, 100.0], "speed over which it fades")
            .linear("speed_m_s", [1e-5, 10.0])
            .tried(Grid::Values(&[0.3, 0.7, 1.5]), Step::Factor(1.5)),
        Parameter::amplitude("level_nm", [-5.0, 5.0], "level at rest").linear("level_n", [-1e4, 1e4]),
    ],
    wave: None,
    trial: Trial::cautious(1.6).of(Signal::Speed),
    make_terms: |machine, shape| {
        let scale = shape[0];
        vec![Term::new(LOW_SPEED_FRICTION.parameters[1].key(machine.kind), move |m: &Moment| {
            Action::friction(libm::exp(-m.motor_speed_rad_s.abs() / scale))
        })]
    },
    separated_by: "constant speeds down to a tenth of a rad/s in both directions",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Friction of loaded bearings and gears.
pub(super) static LOAD_DEPENDENT_FRICTION: EffectKind = EffectKind {
    id: "load_dependent_friction",
    summary: "level of dry friction in proportion to the torque that is transmitted",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "coefficient",
        [0.0, 1.0],
        "level as a share of the torque's magnitude",
    )],
    wave: None,
    trial: Trial::PLAIN.of(Signal::MeasuredTorque),
    make_terms: |_, _| vec![Term::new("coefficient", |m: &Moment| Action::friction(m.torque_nm.abs()))],
    separated_by: "several loads at one speed",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Friction that fades as the grease warms up.
pub(super) static THERMAL_FRICTION: EffectKind = EffectKind {
    id: "thermal_friction",
    summary: "level of dry friction that falls from the start on, to its end by 1 − exp(−time/time constant)",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("time_constant_s", [1.0, 1e5], "time in which 63 % of it are gone")
            .tried(Grid::OfLog(&[0.1, 0.25, 0.6]), Step::Factor(1.5)),
        Parameter::amplitude("fall_nm", [-5.0, 5.0], "by how much the level falls in the end")
            .linear("fall_n", [-1e4, 1e4]),
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, shape| {
        let time_constant_s = shape[0];
        vec![Term::new(THERMAL_FRICTION.parameters[1].key(machine.kind), move |m: &Moment| {
            Action::friction(libm::expm1(-m.time_s / time_constant_s))
        })]
    },
    separated_by: "the same run cold and warm",
    feedforward: Feedforward::Never("how warm the motor was at the start is not measured"),
    declare: undeclared,
};

/// Dahl's bristles: friction that builds up over a way.
pub(super) static PRESLIDING: EffectKind = EffectKind {
    id: "presliding",
    summary: "part of the dry friction that builds up over a way after each reversal, as bristles bend (Dahl)",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("way_rad", [1e-6, 1.0], "way over which 63 % of it build up")
            .linear("way_m", [1e-7, 0.1])
            .tried(Grid::Values(&[0.01, 0.03, 0.1, 0.2]), Step::Factor(1.6)),
        Parameter::amplitude("level_nm", [0.0, 5.0], "level that builds up, part of the declared one")
            .linear("level_n", [0.0, 1e4]),
    ],
    wave: None,
    trial: Trial::cautious(1.6),
    make_terms: |machine, shape| {
        let way = shape[0];
        let (mut bend, mut before) = (0.0_f64, None);
        vec![Term::remembering(PRESLIDING.parameters[1].key(machine.kind), move |m: &Moment| {
            let moved = m.motor_angle_rad - before.unwrap_or(m.motor_angle_rad);
            before = Some(m.motor_angle_rad);
            if moved != 0.0 {
                let end = moved.signum();
                bend = end - (end - bend) * libm::exp(-moved.abs() / way);
            }
            Action { motor_nm: -bend, friction_nm: -1.0, ..Action::default() }
        })]
    },
    separated_by: "slow triangles of several sizes about a standstill",
    feedforward: Feedforward::Never("what has built up is remembered by the bristles and not measured"),
    declare: undeclared,
};

/// A declared f_c, with f_s, that is wrong.
pub(crate) static COULOMB_ERROR: EffectKind = EffectKind {
    id: "coulomb_error",
    summary: "level of the declared friction curve that is off by a constant",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "coulomb_nm",
        [-5.0, 5.0],
        "what is added to coulomb and static level",
    )
    .linear("coulomb_n", [-1e4, 1e4])],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Speed),
    make_terms: |machine, _| {
        vec![Term::new(COULOMB_ERROR.parameters[0].key(machine.kind), |_: &Moment| Action::friction(1.0))]
    },
    separated_by: "constant speeds in both directions from 1 rad/s up, with the wheel in the air",
    feedforward: Feedforward::Declared,
    declare: |effect, model| {
        correct_friction(effect, model, |curve, added| StribeckParameters {
            coulomb_nm: curve.coulomb_nm + added,
            static_nm: curve.static_nm + added,
            ..curve
        })
    },
};

/// A declared f_v that is wrong.
pub(crate) static VISCOUS_ERROR: EffectKind = EffectKind {
    id: "viscous_error",
    summary: "viscous coefficient of the declared friction curve that is off",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude("viscous_nm_s_rad", [-10.0, 10.0], "what is added to it")
        .linear("viscous_n_s_m", [-1e5, 1e5])],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Speed),
    make_terms: |machine, _| {
        vec![Term::new(VISCOUS_ERROR.parameters[0].key(machine.kind), |m: &Moment| {
            Action::motor(-m.motor_speed_rad_s)
        })]
    },
    separated_by: "constant speeds four times apart and more, with the wheel in the air",
    feedforward: Feedforward::Declared,
    declare: |effect, model| {
        correct_friction(effect, model, |curve, added| StribeckParameters {
            viscous_nm_s_rad: curve.viscous_nm_s_rad + added,
            ..curve
        })
    },
};

/// Corrects the declared curves of the motors that the effect is in. A correction that leaves no possible curve, as a
/// level below 0, is not made.
fn correct_friction(
    effect: &Effect,
    model: Declared<'_>,
    corrected: impl Fn(StribeckParameters, f64) -> StribeckParameters,
) -> bool {
    let added = effect.parameters()[0].1;
    let new = |curve: Option<Stribeck>| {
        Stribeck::new(corrected(curve.map_or(StribeckParameters::NONE, |curve| *curve.parameters()), added))
            .ok()
    };
    match model {
        Declared::Robot(robot) => {
            let wanted = Motor::BOTH.map(|motor| effect.is_in(motor));
            let curves = [0, 1].map(|i: usize| if wanted[i] { new(robot.friction[i]) } else { None });
            let possible = (0..2).all(|i| !wanted[i] || curves[i].is_some());
            for i in (0..2).filter(|&i| possible && wanted[i]) {
                robot.friction[i] = curves[i];
            }
            possible
        }
        Declared::Axis(AxisModel {
            parameters: AxisParameters::Rotary { friction, .. } | AxisParameters::Linear { friction, .. },
            ..
        }) => {
            let curve = new(*friction);
            *friction = curve.or(*friction);
            curve.is_some()
        }
    }
}
