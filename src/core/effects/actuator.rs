//! Between the commanded torque and the shaft torque.
//!
//! Each is what has to be added to the torque that is requested.

use std::collections::VecDeque;

use super::kind::{EffectKind, Feedforward, Grid, Parameter, Place, Signal, Step, Trial, undeclared};
use super::law::{Action, MotionSample, Term};
use crate::model::MachineKind;

const EVERYWHERE: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];
/// Delays and time constants that are tried, s.
const TIMES: Grid = Grid::Values(&[1e-3, 1.8e-3, 3.2e-3, 5e-3, 7.5e-3, 11e-3, 16e-3]);

/// Bus, queue and firmware.
pub(super) static COMMAND_DELAY: EffectKind = EffectKind {
    id: "command_delay",
    summary: "fixed delay between the torque command and the torque",
    place: Place::Actuator,
    machines: EVERYWHERE,
    parameters: &[Parameter::shape("delay_s", [0.0, 0.5], "delay from command to torque")
        .sized()
        .searched(TIMES, Step::Factor(1.3))],
    wave: None,
    trial: Trial::PLAIN.of(Signal::MeasuredTorque),
    make_terms: |_, shape| {
        let mut line = DelayLine::new(shape[0]);
        vec![Term::fixed(move |m: &MotionSample| {
            Action::motor(line.delayed(m.torque_nm, m.dt_s) - m.torque_nm)
        })]
    },
    separated_by: "torque with most of its power above 30 Hz",
    feedforward: Feedforward::Never("a torque cannot act before it is commanded"),
    declare: undeclared,
};

/// The current's own control loop.
pub(super) static ACTUATOR_LAG: EffectKind = EffectKind {
    id: "actuator_lag",
    summary: "first-order lag between the torque command and the torque",
    place: Place::Actuator,
    machines: EVERYWHERE,
    parameters: &[Parameter::shape("time_constant_s", [1e-5, 1.0], "time to 63 % of a step")
        .sized()
        .searched(TIMES, Step::Factor(1.3))],
    wave: None,
    trial: Trial::PLAIN.of(Signal::MeasuredTorque),
    make_terms: |_, shape| {
        let mut lag = Lag::new(shape[0]);
        vec![Term::fixed(move |m: &MotionSample| Action::motor(lag.mean(m.torque_nm, m.dt_s) - m.torque_nm))]
    },
    separated_by: "torque with most of its power above 30 Hz",
    feedforward: Feedforward::Never("a lead compensation of the torque would amplify sensor noise"),
    declare: undeclared,
};

/// A torque constant, or its declared value, that is off.
pub(super) static TORQUE_GAIN: EffectKind = EffectKind {
    id: "torque_gain",
    summary: "error of the torque by a constant fraction of the torque command",
    place: Place::Actuator,
    machines: EVERYWHERE,
    parameters: &[Parameter::amplitude("gain", [-0.9, 10.0], "relative error of the torque gain")],
    wave: None,
    trial: Trial::PLAIN.of(Signal::WantedTorque),
    make_terms: |_, _| vec![Term::new("gain", |m: &MotionSample| Action::motor(m.torque_nm))],
    separated_by: "a known payload, or a known weight on a lever arm",
    feedforward: Feedforward::Causal,
    declare: undeclared,
};

/// A limit that the asker does not know of.
pub(super) static TORQUE_SATURATION: EffectKind = EffectKind {
    id: "torque_saturation",
    summary: "torque limited to a maximum",
    place: Place::Actuator,
    machines: EVERYWHERE,
    parameters: &[Parameter::shape("limit_nm", [1e-4, 1000.0], "largest torque")
        .linear("limit_n", [1e-3, 1e6])
        .searched(Grid::OfTorque(&[0.5, 0.6, 0.7, 0.8, 0.9]), Step::Factor(1.08))],
    wave: None,
    trial: Trial::PLAIN.of(Signal::MeasuredTorque),
    make_terms: |_, shape| {
        let limit = shape[0];
        let cut = move |torque: f64| torque.clamp(-limit, limit);
        vec![Term::fixed(move |m: &MotionSample| Action::motor(cut(m.torque_nm) - m.torque_nm))]
    },
    separated_by: "steps of increasing size",
    feedforward: Feedforward::Never("torque beyond the limit is not available"),
    declare: undeclared,
};

/// Small torques that are lost.
pub(super) static TORQUE_DEADZONE: EffectKind = EffectKind {
    id: "torque_deadzone",
    summary: "dead zone: a constant part of the torque command has no effect",
    place: Place::Actuator,
    machines: EVERYWHERE,
    parameters: &[Parameter::shape("width_nm", [0.0, 10.0], "half width of the dead zone")
        .linear("width_n", [0.0, 1e4])
        .searched(Grid::Values(&[0.01, 0.02, 0.04, 0.08]), Step::Factor(1.4))],
    wave: None,
    trial: Trial::cautious(1.6).of(Signal::MeasuredTorque),
    make_terms: |_, shape| {
        let width = shape[0];
        vec![Term::fixed(move |m: &MotionSample| Action::motor(-m.torque_nm.clamp(-width, width)))]
    },
    separated_by: "a slow triangle of torque about zero",
    feedforward: Feedforward::Never(
        "its inverse is discontinuous at zero torque, where the motors would chatter",
    ),
    declare: undeclared,
};

/// Play between rotor and wheel.
pub(super) static BACKLASH: EffectKind = EffectKind {
    id: "backlash",
    summary: "gap that transmits no torque while the rotor crosses it after each torque reversal",
    place: Place::Actuator,
    machines: EVERYWHERE,
    parameters: &[
        Parameter::shape("gap_rad", [0.0, 0.5], "angle of the gap")
            .linear("gap_m", [0.0, 0.05])
            .searched(Grid::Values(&[0.005, 0.02, 0.06]), Step::Factor(1.6)),
        Parameter::shape("rotor_inertia_kg_m2", [1e-8, 10.0], "inertia on the motor's side of the gap")
            .linear("rotor_mass_kg", [1e-4, 1e3])
            .searched(Grid::OfWheelInertia(0.2), Step::Fixed),
    ],
    wave: None,
    trial: Trial::cautious(1.6).of(Signal::MeasuredTorque),
    make_terms: |_, shape| {
        let mut gap = Gap { width: shape[0], inertia: shape[1], place: None, speed: 0.0 };
        vec![Term::fixed(move |m: &MotionSample| {
            let lost = gap.share_of_time_free(m.torque_nm, m.dt_s);
            Action::motor(-lost * m.torque_nm)
        })]
    },
    separated_by: "a slow triangle of torque about zero, and an encoder on each side of the gap",
    feedforward: Feedforward::Never("the position of the rotor in its gap is not measured"),
    declare: undeclared,
};

/// Torque command of a fixed time ago.
#[derive(Clone)]
struct DelayLine {
    delay_s: f64,
    /// Torques and their ages, newest first, back to the first that is older than the delay.
    asked: VecDeque<(f64, f64)>,
}

impl DelayLine {
    fn new(delay_s: f64) -> Self {
        Self { delay_s, asked: VecDeque::new() }
    }

    /// Mean of what acts until the next moment, where each torque is requested from its moment to the next; what was
    /// requested before the first moment is taken to be the same as then.
    fn delayed(&mut self, torque: f64, dt_s: f64) -> f64 {
        for (age_s, _) in &mut self.asked {
            *age_s += dt_s;
        }
        self.asked.push_front((0.0, torque));
        let older = self.asked.iter().position(|&(age_s, _)| age_s >= self.delay_s);
        let Some(older) = older else { return self.asked.back().map_or(torque, |&(_, oldest)| oldest) };
        self.asked.truncate(older + 1);
        let (old_age, old) = self.asked[older];
        let Some((young_age, young)) = older.checked_sub(1).map(|at| self.asked[at]) else { return old };
        old + (young - old) * (old_age - self.delay_s) / (old_age - young_age)
    }
}

/// A first-order lag, exact for an input that is constant between moments.
#[derive(Clone)]
pub(super) struct Lag {
    time_constant_s: f64,
    value: Option<f64>,
}

impl Lag {
    pub(super) fn new(time_constant_s: f64) -> Self {
        Self { time_constant_s, value: None }
    }

    /// The lagged value at a moment, and the one at the next, `dt_s` later; in balance at the first.
    pub(super) fn advance(&mut self, input: f64, dt_s: f64) -> [f64; 2] {
        let now = self.value.unwrap_or(input);
        let next = input + (now - input) * libm::exp(-dt_s / self.time_constant_s);
        self.value = Some(next);
        [now, next]
    }

    /// Mean between a moment and the next.
    fn mean(&mut self, input: f64, dt_s: f64) -> f64 {
        let [now, next] = self.advance(input, dt_s);
        if dt_s > 0.0 { input + (now - next) * self.time_constant_s / dt_s } else { now }
    }
}

/// Position of the rotor in its gap.
#[derive(Clone)]
struct Gap {
    width: f64,
    inertia: f64,
    /// From its backward end, rad or m; none before the first moment.
    place: Option<f64>,
    speed: f64,
}

impl Gap {
    /// Fraction of the time until the next moment in which the rotor touches neither side.
    fn share_of_time_free(&mut self, torque: f64, dt_s: f64) -> f64 {
        let end = if torque >= 0.0 { self.width } else { 0.0 };
        let place = self.place.unwrap_or(end);
        let acceleration = torque / self.inertia;
        let next = place + dt_s * (self.speed + 0.5 * dt_s * acceleration);
        let speed = self.speed + dt_s * acceleration;
        if (0.0..=self.width).contains(&next) && place != end {
            (self.place, self.speed) = (Some(next), speed);
            return 1.0;
        }
        // The side that it hits stops it.
        let landed = next.clamp(0.0, self.width);
        let way = next - place;
        (self.place, self.speed) = (Some(landed), 0.0);
        if way == 0.0 { 0.0 } else { ((landed - place) / way).clamp(0.0, 1.0) }
    }
}
