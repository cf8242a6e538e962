//! Effects that return with every turn of a motor, or with every period of an axis.

use std::f64::consts::TAU;

use super::kind::{EffectKind, Feedforward, Grid, Parameter, Place, Signal, Step, Trial, undeclared};
use super::law::{Action, MotionSample, Term};
use super::machine::Machine;
use crate::model::MachineKind;

/// Orders up to 20,000, of fine encoders' errors; on a linear axis periods from 10 µm to 10 m.
const ORDER: Parameter = Parameter::shape("order_#", [1.0, 20_000.0], "cycles per turn")
    .whole()
    .linear("period_#_m", [1e-5, 10.0]);
/// Orders that are tried.
const fn orders(most: u32) -> Parameter {
    ORDER.searched(Grid::Orders(most), Step::Fixed)
}

/// Torque that depends on the rotor's angle: magnets that prefer some of the stator's teeth, errors of the current's
/// phase at a constant current, a joint that runs unevenly.
pub(super) static COGGING: EffectKind = EffectKind {
    id: "cogging",
    summary: "torque as a function of the motor angle: Σ cos cos(order q) + sin sin(order q)",
    place: Place::Motor,
    machines: &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear],
    parameters: &[
        orders(60),
        Parameter::amplitude("cos_#_nm", [-20.0, 20.0], "cosine part").linear("cos_#_n", [-1e4, 1e4]),
        Parameter::amplitude("sin_#_nm", [-20.0, 20.0], "sine part").linear("sin_#_n", [-1e4, 1e4]),
    ],
    wave: Some(cogging),
    trial: Trial::PLAIN,
    make_terms: |machine, shape| {
        harmonics(machine, shape, ["cos_#_nm", "sin_#_nm"], ["cos_#_n", "sin_#_n"], cogging)
    },
    separated_by: "several slow turns in each direction, with the wheel in the air",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Torque constant that depends on the rotor's angle.
pub(super) static TORQUE_RIPPLE: EffectKind = EffectKind {
    id: "torque_ripple",
    summary: "torque constant as a function of the motor angle: T Σ cos cos(order q) + sin sin(order q)",
    place: Place::Motor,
    machines: &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear],
    parameters: &[
        orders(40),
        Parameter::amplitude("cos_#", [-1.0, 1.0], "cosine part relative to the torque"),
        Parameter::amplitude("sin_#", [-1.0, 1.0], "sine part relative to the torque"),
    ],
    wave: Some(ripple),
    trial: Trial::PLAIN.of(Signal::MeasuredTorque),
    make_terms: |machine, shape| {
        let keys = ["cos_#", "sin_#"];
        harmonics(machine, shape, keys, keys, ripple)
    },
    separated_by: "two torques at one speed",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// Dry friction that depends on the angle.
pub(super) static POSITION_DEPENDENT_FRICTION: EffectKind = EffectKind {
    id: "position_dependent_friction",
    summary: "dry friction as a function of the motor angle: Σ cos cos(order q) + sin sin(order q)",
    place: Place::Motor,
    machines: &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear],
    parameters: &[
        orders(10),
        Parameter::amplitude("cos_#_nm", [-5.0, 5.0], "cosine part").linear("cos_#_n", [-1e4, 1e4]),
        Parameter::amplitude("sin_#_nm", [-5.0, 5.0], "sine part").linear("sin_#_n", [-1e4, 1e4]),
    ],
    wave: Some(friction),
    trial: Trial::PLAIN,
    make_terms: |machine, shape| {
        harmonics(machine, shape, ["cos_#_nm", "sin_#_nm"], ["cos_#_n", "sin_#_n"], friction)
    },
    separated_by: "slow turns in both directions: friction changes sign with the direction, cogging does not",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

fn cogging(wave: f64, _: &MotionSample) -> Action {
    Action::motor(wave)
}

fn ripple(wave: f64, moment: &MotionSample) -> Action {
    Action::motor(wave * moment.torque_nm)
}

fn friction(wave: f64, _: &MotionSample) -> Action {
    Action::friction(wave)
}

/// Two terms for each order, or period on a linear axis: an action of cos and of sin.
fn harmonics(
    machine: &Machine,
    shape: &[f64],
    keys: [&str; 2],
    linear_keys: [&str; 2],
    action: fn(f64, &MotionSample) -> Action,
) -> Vec<Term> {
    let linear = machine.kind == MachineKind::Linear;
    let keys = if linear { linear_keys } else { keys };
    let mut terms = Vec::with_capacity(2 * shape.len());
    for (&shape, number) in shape.iter().zip(1..) {
        let per_angle = if linear { TAU / shape } else { shape };
        let [cos, sin] = keys.map(|key| key.replace('#', &number.to_string()));
        terms.push(Term::new(cos, move |m: &MotionSample| {
            action(libm::cos(per_angle * m.motor_angle_rad), m)
        }));
        terms.push(Term::new(sin, move |m: &MotionSample| {
            action(libm::sin(per_angle * m.motor_angle_rad), m)
        }));
    }
    terms
}
