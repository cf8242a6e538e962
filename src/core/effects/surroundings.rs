//! Forces from outside the robot.

use super::actuator::Lag;
use super::kind::{
    EffectKind, Feedforward, Form, Grid, NOT_INSIDE, Parameter, Place, Step, Trial, undeclared,
};
use super::law::{Action, MotionSample, Term};
use crate::model::MachineKind;

const ROBOT: &[MachineKind] = &[MachineKind::Robot];
/// Speed over which rolling resistance turns over, m/s.
const ROLLING_SPEED_M_S: f64 = 0.002;

/// A cable that pulls the robot back.
pub(super) static TETHER_SPRING: EffectKind = EffectKind {
    id: "tether_spring",
    summary: "horizontal force at the axle that is linear in x: pull − stiffness x",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::amplitude("stiffness_n_m", [-1e4, 1e4], "stiffness; the force is 0 at pull / stiffness")
            .opposing(),
        Parameter::amplitude("pull_n", [-1e3, 1e3], "force at x = 0").or(0.0),
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |_, _| {
        vec![
            Term::new("stiffness_n_m", |m: &MotionSample| Action::force(-m.x_m, 0.0, 0.0)),
            Term::new("pull_n", |_: &MotionSample| Action::force(1.0, 0.0, 0.0)),
        ]
    },
    separated_by: "the same run at another place, and with the cable unplugged",
    feedforward: NOT_INSIDE,
    declare: undeclared,
};

/// A floor that is not level.
pub(super) static GROUND_SLOPE: EffectKind = EffectKind {
    id: "ground_slope",
    summary: "horizontal force of gravity on a slope, uphill in the direction of positive x",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("slope_rad", [-0.5, 0.5], "slope (small angle)")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let weight_n = machine.weight_n();
        vec![Term::new("slope_rad", move |_: &MotionSample| Action::force(-weight_n, 0.0, 0.0))]
    },
    separated_by: "the same track in both directions",
    feedforward: NOT_INSIDE,
    declare: undeclared,
};

/// Air about a moving robot.
pub(super) static AERO_DRAG: EffectKind = EffectKind {
    id: "aero_drag",
    summary: "horizontal force against the motion, proportional to the square of the robot's speed",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::shape("height_m", [-1.0, 3.0], "height of the force above the axle along the body")
            .or(0.0)
            .searched(Grid::OfHeight(&[0.0, 1.0]), Step::Fixed),
        Parameter::amplitude("drag_n_s2_m2", [-1e3, 1e3], "force at 1 m/s").opposing(),
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |_, shape| {
        let height_m = shape[0];
        vec![Term::new("drag_n_s2_m2", move |m: &MotionSample| {
            Action::force(-m.x_dot_m_s * m.x_dot_m_s.abs(), height_m, m.pitch_rad)
        })]
    },
    separated_by: "speeds a factor of four apart or more; absent with the wheels in the air",
    feedforward: NOT_INSIDE,
    declare: undeclared,
};

/// Tyres that deform.
pub(super) static ROLLING_RESISTANCE: EffectKind = EffectKind {
    id: "rolling_resistance",
    summary: "horizontal force against the motion, proportional to the weight",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::amplitude("coefficient", [-0.5, 0.5], "force as a fraction of the weight").opposing()
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let weight_n = machine.weight_n();
        vec![Term::new("coefficient", move |m: &MotionSample| {
            Action::force(-weight_n * libm::tanh(m.x_dot_m_s / ROLLING_SPEED_M_S), 0.0, 0.0)
        })]
    },
    separated_by: "absent with the wheels in the air; another payload",
    feedforward: NOT_INSIDE,
    declare: undeclared,
};

/// A wheel that is not round, or sits off its middle.
pub(super) static WHEEL_ECCENTRICITY: EffectKind = EffectKind {
    id: "wheel_eccentricity",
    summary: "horizontal force with one cycle per wheel turn, from wheels that raise and lower the robot",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::amplitude("cos_m", [-0.1, 0.1], "eccentricity, cosine part of x/r"),
        Parameter::amplitude("sin_m", [-0.1, 0.1], "sine part of x/r"),
    ],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |machine, _| {
        let radius_m = machine.parameters.wheel_radius_m;
        let force_n_m = machine.weight_n() / radius_m;
        let force = move |wave: f64| Action::force(force_n_m * wave, 0.0, 0.0);
        vec![
            Term::new("cos_m", move |m: &MotionSample| force(libm::cos(m.x_m / radius_m))),
            Term::new("sin_m", move |m: &MotionSample| force(libm::sin(m.x_m / radius_m))),
        ]
    },
    separated_by: "absent with the wheels in the air, where cogging of order 1 remains",
    feedforward: NOT_INSIDE,
    declare: undeclared,
};

/// Tyres that creep under load.
pub(super) static WHEEL_SLIP: EffectKind = EffectKind {
    id: "wheel_slip",
    summary: "wheel slip in proportion to the transmitted force: the wheels turn faster than the robot moves",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::shape("relaxation_s", [1e-3, 1.0], "time for 63 % of the slip to build up")
            .searched(Grid::Values(&[0.005, 0.02]), Step::Factor(1.6)),
        Parameter::amplitude("slip_m_s_n", [0.0, 1.0], "slip speed per force"),
    ],
    wave: None,
    trial: Trial::cautious(2.0),
    make_terms: |machine, shape| {
        let p = machine.parameters;
        let (mass_kg, moment_kg_m) =
            (p.body_mass_kg + 2.0 * p.wheel_mass_kg, p.body_mass_kg * p.com_height_m);
        let mut force_n = Lag::new(shape[0]);
        // With x as the wheels' way, the robot's acceleration is ẍ less that of the slip.
        vec![Term::remembering("slip_m_s_n", move |m: &MotionSample| {
            let [now, next] = force_n.advance(m.torque_sum_nm / p.wheel_radius_m, m.dt_s);
            let rate = if m.dt_s > 0.0 { (next - now) / m.dt_s } else { 0.0 };
            Action {
                axle_n: mass_kg * rate,
                body_nm: moment_kg_m * libm::cos(m.pitch_rad) * rate,
                ..Action::default()
            }
        })]
    },
    separated_by: "a camera or a free-running measuring wheel, on dry and on dusty ground",
    feedforward: Feedforward::Never("neither the slip nor the robot's own speed is measured"),
    declare: undeclared,
};

/// A bump in the floor.
pub(super) static TERRAIN: EffectKind = EffectKind {
    id: "terrain",
    summary: "horizontal force of gravity on a bump or dip of the ground with a Gaussian profile",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::shape("at_m", [-1e3, 1e3], "position of its centre")
            .searched(Grid::Distance, Step::OfNext(0.3)),
        Parameter::shape("width_m", [0.01, 10.0], "distance from its centre to its steepest point")
            .searched(Grid::Values(&[0.04, 0.1, 0.25]), Step::Factor(1.25)),
        Parameter::amplitude("height_m", [-0.5, 0.5], "height of its centre"),
    ],
    wave: None,
    trial: Trial { repeats: true, forms: &[Form::Law, Form::Wave], ..Trial::cautious(1.3) },
    make_terms: |machine, shape| {
        let (weight_n, at_m, width_m) = (machine.weight_n(), shape[0], shape[1]);
        vec![Term::new("height_m", move |m: &MotionSample| {
            let away = (m.x_m - at_m) / width_m;
            let slope_per_m = -away / width_m * libm::exp(-0.5 * away * away);
            Action::force(-weight_n * slope_per_m, 0.0, 0.0)
        })]
    },
    separated_by: "the same track again: its position is unchanged",
    feedforward: Feedforward::Never("the ground ahead is not measured, and odometry drifts"),
    declare: undeclared,
};

/// A shove.
pub(super) static EXTERNAL_PUSH: EffectKind = EffectKind {
    id: "external_push",
    summary: "constant horizontal force for a limited time",
    place: Place::Translation,
    machines: ROBOT,
    parameters: &[
        Parameter::shape("start_s", [0.0, 1e6], "start time").searched(Grid::Default, Step::Sum(0.04)),
        Parameter::shape("duration_s", [1e-3, 1e4], "duration").searched(Grid::Default, Step::Factor(1.25)),
        Parameter::shape("height_m", [-1.0, 3.0], "height above the axle along the body").or(0.0),
        Parameter::amplitude("force_n", [-1e4, 1e4], "force, forward positive"),
    ],
    wave: None,
    trial: Trial { repeats: true, brief: true, ..Trial::cautious(4.0) },
    make_terms: |_, shape| {
        let (start_s, end_s, height_m) = (shape[0], shape[0] + shape[1], shape[2]);
        vec![Term::new("force_n", move |m: &MotionSample| {
            let pushes = (start_s..end_s).contains(&m.time_s);
            if pushes { Action::force(1.0, height_m, m.pitch_rad) } else { Action::default() }
        })]
    },
    separated_by: "the same run again: it does not recur",
    feedforward: Feedforward::Never("it cannot be predicted"),
    declare: undeclared,
};
