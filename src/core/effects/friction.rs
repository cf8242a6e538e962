//! Friction next to the declared curve.

use super::kind::{
    Declared, EffectKind, Feedforward, Form, Grid, Parameter, Place, Signal, Step, Trial, undeclared,
};
use super::law::{Action, MotionSample, Term};
use crate::friction::{Stribeck, StribeckParameters};
use crate::model::Effect;
use crate::model::MachineKind;
use crate::model::{AxisModel, AxisParameters, Motor};

const EVERYWHERE: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];

/// A fan's law: air around a rotor, oil in a gear.
pub(super) static QUADRATIC_DRAG: EffectKind = EffectKind {
    id: "quadratic_drag",
    summary: "torque against the motion, proportional to the square of the motor speed",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude("drag_nm_s2_rad2", [-1.0, 1.0], "torque at 1 rad/s")
        .linear("drag_n_s2_m2", [-1e5, 1e5])
        .opposing()],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Speed),
    make_terms: |machine, _| {
        vec![Term::new(QUADRATIC_DRAG.parameters[0].key(machine.kind), |m: &MotionSample| {
            Action::motor(-m.motor_speed_rad_s * m.motor_speed_rad_s.abs())
        })]
    },
    separated_by: "speeds a factor of four apart or more; without the drag of the body with the wheels in the air",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Another viscous coefficient forward than backward.
pub(super) static VISCOUS_ASYMMETRY: EffectKind = EffectKind {
    id: "viscous_asymmetry",
    summary: "viscous coefficient larger forward and smaller backward",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "viscous_nm_s_rad",
        [-10.0, 10.0],
        "half the difference, forward minus backward",
    )
    .linear("viscous_n_s_m", [-1e5, 1e5])],
    wave: None,
    trial: Trial { forms: &[Form::Law, Form::Forward(&VISCOUS_ERROR)], ..Trial::PLAIN.of(Signal::Speed) },
    make_terms: |machine, _| {
        vec![Term::new(VISCOUS_ASYMMETRY.parameters[0].key(machine.kind), |m: &MotionSample| {
            Action::motor(-m.motor_speed_rad_s.abs())
        })]
    },
    separated_by: "the same speeds forward and backward, at least two of each",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Another dry friction forward than backward. Next to a curve with an offset it is that offset's error.
pub(crate) static FRICTION_ASYMMETRY: EffectKind = EffectKind {
    id: "friction_asymmetry",
    summary: "dry friction that is larger forward and smaller backward, equivalent to a friction offset",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "coulomb_nm",
        [-5.0, 5.0],
        "half the difference, forward minus backward",
    )
    .linear("coulomb_n", [-1e4, 1e4])],
    wave: None,
    trial: Trial { forms: &[Form::Law, Form::Forward(&COULOMB_ERROR)], ..Trial::PLAIN },
    make_terms: |machine, _| {
        vec![Term::new(FRICTION_ASYMMETRY.parameters[0].key(machine.kind), |_: &MotionSample| {
            Action::motor(-1.0)
        })]
    },
    separated_by: "the same speed forward and backward, on level ground and on the same track",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Friction at low speed that the declared curve lacks, or has too much of.
pub(super) static LOW_SPEED_FRICTION: EffectKind = EffectKind {
    id: "low_speed_friction",
    summary: "additional dry friction at low speed, of either sign, that decays with exp(−|speed|/scale)",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("speed_rad_s", [1e-3, 100.0], "decay speed")
            .linear("speed_m_s", [1e-5, 10.0])
            .searched(Grid::Values(&[0.3, 0.7, 1.5]), Step::Factor(1.5)),
        Parameter::amplitude("amplitude_nm", [-5.0, 5.0], "friction amplitude at zero speed")
            .linear("amplitude_n", [-1e4, 1e4]),
    ],
    wave: None,
    trial: Trial::cautious(1.6).of(Signal::Speed),
    make_terms: |machine, shape| {
        let scale = shape[0];
        vec![Term::new(LOW_SPEED_FRICTION.parameters[1].key(machine.kind), move |m: &MotionSample| {
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
    summary: "dry friction proportional to the transmitted torque",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "coefficient",
        [0.0, 1.0],
        "friction as a fraction of the magnitude of the torque",
    )],
    wave: None,
    trial: Trial::PLAIN.of(Signal::MeasuredTorque),
    make_terms: |_, _| vec![Term::new("coefficient", |m: &MotionSample| Action::friction(m.torque_nm.abs()))],
    separated_by: "several loads at one speed",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Friction that fades as the grease warms up.
pub(super) static THERMAL_FRICTION: EffectKind = EffectKind {
    id: "thermal_friction",
    summary: "dry friction that decreases from the start with 1 − exp(−time/time constant)",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("time_constant_s", [1.0, 1e5], "time for 63 % of the decrease")
            .searched(Grid::OfLog(&[0.1, 0.25, 0.6]), Step::Factor(1.5)),
        Parameter::amplitude("fall_nm", [-5.0, 5.0], "total decrease").linear("fall_n", [-1e4, 1e4]),
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, shape| {
        let time_constant_s = shape[0];
        vec![Term::new(THERMAL_FRICTION.parameters[1].key(machine.kind), move |m: &MotionSample| {
            Action::friction(libm::expm1(-m.time_s / time_constant_s))
        })]
    },
    separated_by: "the same run cold and warm",
    feedforward: Feedforward::Never("the initial temperature of the motor is not measured"),
    declare: undeclared,
};

/// Dahl's bristles: friction that builds up over a way.
pub(super) static PRESLIDING: EffectKind = EffectKind {
    id: "presliding",
    summary: "part of the dry friction that builds up over a displacement after each reversal (Dahl model)",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("breakaway_displacement_rad", [1e-6, 1.0], "displacement for 63 % of the build-up")
            .linear("breakaway_displacement_m", [1e-7, 0.1])
            .searched(Grid::Values(&[0.01, 0.03, 0.1, 0.2]), Step::Factor(1.6)),
        Parameter::amplitude(
            "amplitude_nm",
            [0.0, 5.0],
            "friction amplitude that builds up, part of the declared friction",
        )
        .linear("amplitude_n", [0.0, 1e4]),
    ],
    wave: None,
    trial: Trial::cautious(1.6),
    make_terms: |machine, shape| {
        let way = shape[0];
        let (mut bend, mut before) = (0.0_f64, None);
        vec![Term::remembering(PRESLIDING.parameters[1].key(machine.kind), move |m: &MotionSample| {
            let moved = m.motor_angle_rad - before.unwrap_or(m.motor_angle_rad);
            before = Some(m.motor_angle_rad);
            if moved != 0.0 {
                let end = moved.signum();
                bend = end - (end - bend) * libm::exp(-moved.abs() / way);
            }
            Action { motor_nm: -bend, friction_nm: -1.0, ..Action::default() }
        })]
    },
    separated_by: "slow triangles of several amplitudes around standstill",
    feedforward: Feedforward::Never("the state of the bristles is not measured"),
    declare: undeclared,
};

/// A declared f_c, with f_s, that is wrong.
pub(crate) static COULOMB_ERROR: EffectKind = EffectKind {
    id: "coulomb_error",
    summary: "constant error of the declared dry friction",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "coulomb_nm",
        [-5.0, 5.0],
        "correction of the Coulomb and static friction",
    )
    .linear("coulomb_n", [-1e4, 1e4])],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Speed),
    make_terms: |machine, _| {
        vec![Term::new(COULOMB_ERROR.parameters[0].key(machine.kind), |_: &MotionSample| {
            Action::friction(1.0)
        })]
    },
    separated_by: "constant speeds above 1 rad/s in both directions, with the wheel in the air",
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
    summary: "error of the declared viscous coefficient",
    place: Place::Motor,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude(
        "viscous_nm_s_rad",
        [-10.0, 10.0],
        "correction of the declared value",
    )
    .linear("viscous_n_s_m", [-1e5, 1e5])],
    wave: None,
    trial: Trial::PLAIN.of(Signal::Speed),
    make_terms: |machine, _| {
        vec![Term::new(VISCOUS_ERROR.parameters[0].key(machine.kind), |m: &MotionSample| {
            Action::motor(-m.motor_speed_rad_s)
        })]
    },
    separated_by: "constant speeds a factor of four apart or more, with the wheel in the air",
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
