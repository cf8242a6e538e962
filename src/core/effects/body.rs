//! Effects in or on the body.

use std::f64::consts::TAU;

use super::kind::{
    EffectKind, Feedforward, Form, Grid, NOT_INSIDE, Parameter, Place, Step, Trial, undeclared,
};
use super::law::{Action, MotionSample, Term};
use crate::model::MachineKind;

const ROBOT: &[MachineKind] = &[MachineKind::Robot];

/// A centre of mass next to the line that the IMU calls upright.
pub(super) static PITCH_OFFSET: EffectKind = EffectKind {
    id: "pitch_offset",
    summary: "centre of mass in front of the axle at zero pitch reading, or an IMU tilted backward",
    place: Place::Pitch,
    machines: ROBOT,
    parameters: &[Parameter::amplitude(
        "angle_rad",
        [-0.5, 0.5],
        "angle of the centre of mass in front of the axle",
    )],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let p = machine.parameters;
        let weight_nm = p.body_mass_kg * p.gravity_m_s2 * p.com_height_m;
        vec![Term::new("angle_rad", move |m: &MotionSample| Action::body(weight_nm * libm::cos(m.pitch_rad)))]
    },
    separated_by: "a second leg height, or the body on a plumb line",
    feedforward: NOT_INSIDE,
    declare: undeclared,
};

/// A leg, body or coupling that is not stiff.
pub(super) static STRUCTURAL_MODE: EffectKind = EffectKind {
    id: "structural_mode",
    summary: "flexible part that follows the torque up to its resonance and lags above it",
    place: Place::Pitch,
    machines: &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear],
    parameters: &[
        Parameter::shape("frequency_hz", [0.5, 500.0], "resonance frequency")
            .searched(Grid::Geometric(2.5, 1.14, 14), Step::Factor(1.07)),
        Parameter::shape("damping_ratio", [1e-3, 0.99], "damping ratio")
            .searched(Grid::Values(&[0.04]), Step::Factor(1.6)),
        Parameter::amplitude("fraction", [-2.0, 2.0], "fraction of the torque that drives it").opposing(),
    ],
    wave: None,
    trial: Trial { repeats: true, forms: &[Form::Law, Form::Driven], ..Trial::cautious(6.0) },
    make_terms: |machine, shape| {
        let mut mode = Oscillator::new(shape[0], shape[1]);
        let on_robot = machine.kind == MachineKind::Robot;
        vec![Term::remembering("fraction", move |m: &MotionSample| {
            // On a robot the motors' reaction drives the body.
            let torque = if on_robot { -m.torque_sum_nm } else { m.torque_nm };
            let late = mode.advance(torque, m.dt_s) - torque;
            if on_robot { Action::body(late) } else { Action::motor(late) }
        })]
    },
    separated_by: "a slow sine sweep of the torque; a second leg height",
    feedforward: Feedforward::Never(
        "its phase reverses at the resonance, where a feedforward torque would excite it",
    ),
    declare: undeclared,
};

/// Liquid in a tank, or a part that swings.
pub(super) static SLOSH: EffectKind = EffectKind {
    id: "slosh",
    summary: "part of the body's mass on a spring that lags behind the motion of the body",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::shape("frequency_hz", [0.1, 50.0], "resonance frequency")
            .searched(Grid::Geometric(0.5, 1.16, 14), Step::Factor(1.08)),
        Parameter::shape("damping_ratio", [1e-3, 0.99], "damping ratio")
            .searched(Grid::Values(&[0.05]), Step::Factor(1.6)),
        Parameter::shape("height_m", [-1.0, 3.0], "height above the axle along the body")
            .or(0.0)
            .searched(Grid::OfHeight(&[1.0]), Step::OfHeight(0.3)),
        Parameter::amplitude("mass_kg", [0.0, 100.0], "moving part of the declared mass"),
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, shape| {
        let mut mass = Oscillator::new(shape[0], shape[1]);
        let (stiffness, height_m, gravity) =
            (mass.omega * mass.omega, shape[2], machine.parameters.gravity_m_s2);
        vec![Term::remembering("mass_kg", move |m: &MotionSample| {
            // Driven by the acceleration of its place, against which it moves by s: s̈ = −a − 2ζω ṡ − ω² s.
            let driven = m.x_accel_m_s2 + height_m * m.pitch_accel_rad_s2;
            let place = mass.advance(-driven / stiffness, m.dt_s);
            let acceleration = mass.acceleration;
            let force = Action::force(-acceleration, height_m, m.pitch_rad);
            Action { body_nm: force.body_nm + gravity * place, ..force }
        })]
    },
    separated_by: "the decay after a push, with the tank full, half full and empty",
    feedforward: Feedforward::Never("the state of the moving mass is not measured"),
    declare: undeclared,
};

/// z̈ + 2ζω ż + ω² (z − u) = 0, exact for an input u that is constant between moments.
#[derive(Clone)]
struct Oscillator {
    omega: f64,
    damping: f64,
    /// z − u of the last input, in balance at the first.
    place: Option<f64>,
    speed: f64,
    /// z̈ at the last moment.
    acceleration: f64,
}

impl Oscillator {
    fn new(frequency_hz: f64, damping: f64) -> Self {
        Self { omega: TAU * frequency_hz, damping, place: None, speed: 0.0, acceleration: 0.0 }
    }

    /// z at a moment; moves on to the next, `dt_s` later.
    fn advance(&mut self, input: f64, dt_s: f64) -> f64 {
        let place = self.place.unwrap_or(input);
        let Self { omega, damping, speed, .. } = *self;
        let away = place - input;
        self.acceleration = -omega * (2.0 * damping * speed + omega * away);
        let decay = damping * omega;
        let swing = omega * (1.0 - damping * damping).sqrt();
        let (sin, cos) = libm::sincos(swing * dt_s);
        let fade = libm::exp(-decay * dt_s);
        let lead = (speed + decay * away) / swing;
        self.place = Some(input + fade * (away * cos + lead * sin));
        self.speed = fade * (speed * cos - (decay * lead + swing * away) * sin);
        place
    }
}
