//! Admission of new gains to a driven robot: stability margins of the sampled loop, and size of the change.

use std::f64::consts::PI;

use nalgebra::Matrix2x4;

use super::Reference;
use super::balance::{BalanceController, ControllerKind};
use super::odometry::Measurement;
use super::yaw::yaw_inertia_kg_m2;
use crate::lqr::{Margins, SampledLoop, margins, sampled_poles};
use crate::model::{RobotModel, State};

/// Least gain margin, up and down, as a factor: 3 dB. A torque constant, a mass or a supply voltage that is off by a
/// third leaves the loop stable.
pub const LEAST_GAIN_MARGIN: f64 = 1.413;
/// Least phase margin, rad: 20°. Below it a push rings for many seconds.
pub const LEAST_PHASE_MARGIN_RAD: f64 = 20.0 * PI / 180.0;
/// Least delay in addition to the model's own, s: one tick of the loop and one late frame.
pub const LEAST_DELAY_MARGIN_S: f64 = 0.002;
/// Slowest decay of a mode, 1/s: a robot that takes longer than 10 s to come back drifts off before.
pub const LEAST_DECAY_PER_S: f64 = 0.1;
/// Factor of a gain up to which it is changed without a question.
pub const LARGEST_FACTOR: f64 = 2.0;
/// Fraction of the torque limit by which a feedforward may exceed that of the robot's own model: more of it drives the
/// wheels on against the feedback.
pub const LARGEST_EXCESS: f64 = 0.1;

/// Motor speeds, rad/s, and fractions of the torque limit at which feedforwards are compared.
const PROBE_SPEEDS_RAD_S: [f64; 7] = [-30.0, -5.0, -0.5, 0.0, 0.5, 5.0, 30.0];
const PROBE_TORQUES: [f64; 3] = [-0.5, 0.0, 0.5];

/// States in the order of a gain's columns.
pub const STATES: [&str; 4] = ["x", "x_dot", "pitch", "pitch_rate"];
/// Motors in the order of its rows.
const MOTORS: [&str; 2] = ["left", "right"];

/// Verdict on new gains.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// They may be applied.
    Accept,
    /// They are safe but change by more than [`LARGEST_FACTOR`]: the operator confirms them first.
    Ask(Vec<GainChange>),
    /// They must not reach the robot.
    Refuse(Refusal),
}

/// One entry of K that changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainChange {
    /// `left` or `right`.
    pub motor: &'static str,
    /// `x`, `x_dot`, `pitch` or `pitch_rate`.
    pub state: &'static str,
    /// Present gain.
    pub old: f64,
    /// New gain.
    pub new: f64,
}

/// Reason for which a controller must not drive a robot.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A gain is infinite or not a number.
    #[error("the {motor} motor's gain of {state} is not a finite number: change the weights")]
    NotFinite {
        /// `left` or `right`.
        motor: &'static str,
        /// `x`, `x_dot`, `pitch` or `pitch_rate`.
        state: &'static str,
    },
    /// The sampled, delayed loop is unstable.
    #[error(
        "the loop is unstable with its sampling and {:.1} ms of delay: raise the weights R or lower Q", 1e3 * delay_s
    )]
    Unstable {
        /// Delay of the loop, s.
        delay_s: f64,
    },
    /// A gain margin is too small.
    #[error("the gain margin is {:.1} dB, at least 3 dB are required: {remedy}", decibels(*factor))]
    GainMargin {
        /// Factor of all gains at which the loop becomes unstable.
        factor: f64,
        /// Remedy.
        remedy: &'static str,
    },
    /// The phase margin is too small.
    #[error("the phase margin is {:.0}°, at least 20° are required: raise the weights R or lower Q", phase_rad.to_degrees())]
    PhaseMargin {
        /// Phase margin, rad.
        phase_rad: f64,
    },
    /// The delay margin is too small.
    #[error(
        "the delay margin is {:.1} ms, at least 2 ms are required: raise the weights R or lower Q",
        1e3 * delay_s
    )]
    DelayMargin {
        /// Delay margin, s.
        delay_s: f64,
    },
    /// A mode decays too slowly.
    #[error(
        "the slowest mode has a time constant of {seconds:.0} s, at most 10 s are allowed to prevent drift: \
         raise the weights of displacement and velocity, or lower R"
    )]
    Slow {
        /// Time constant, s.
        seconds: f64,
    },
    /// The yaw hold rings or is unstable.
    #[error(
        "the yaw hold has a phase margin of {:.0}° and a delay margin of {:.1} ms, at least 20° and 2 ms are required: lower \
         stiffness_nm_rad or raise damping_nm_s_rad in [yaw_hold], or lower both",
        phase_rad.to_degrees(), 1e3 * delay_s
    )]
    YawHold {
        /// Phase margin, rad; below 0 where the loop is unstable.
        phase_rad: f64,
        /// Delay margin, s.
        delay_s: f64,
    },
    /// The feedforward exceeds that of the robot's own model.
    #[error(
        "the feedforward exceeds that of the model used for the connection by {excess_nm:.2} N m, at most \
         {largest_nm:.2} N m are allowed: correct the friction, or reconnect with this model"
    )]
    Feedforward {
        /// Largest excess, N m.
        excess_nm: f64,
        /// Largest excess that is allowed, N m.
        largest_nm: f64,
    },
}

fn decibels(factor: f64) -> f64 {
    20.0 * factor.log10().abs()
}

/// Judges `new` for a robot that `current` gains drive.
pub fn judge(robot: &RobotModel, current: &Matrix2x4<f64>, new: &BalanceController) -> Verdict {
    if let Err(refusal) = check(robot, new) {
        return Verdict::Refuse(refusal);
    }
    let changes: Vec<_> = entries(current, &new.gain)
        .filter(|change| !(1.0 / LARGEST_FACTOR..=LARGEST_FACTOR).contains(&change.factor()))
        .collect();
    if changes.is_empty() { Verdict::Accept } else { Verdict::Ask(changes) }
}

/// Checks that `controller` keeps `robot` stable in the sampled, delayed loop with the least margins, and that its
/// feedforward does not overpower the feedback.
///
/// # Errors
/// The first condition that is not met.
///
/// ```
/// # let model = flqr_core::model_file::presets::paper();
/// # let robot = model.robot().ok_or("no robot")?;
/// # let linear = robot.parameters.linear_model();
/// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
/// # use flqr_core::control::{BalanceController, ControllerKind};
/// use flqr_core::control::gate;
///
/// let controller = BalanceController::new(ControllerKind::Flqr, robot, gain)?;
/// assert!(gate::check(robot, &controller).is_ok());
/// let reversed = BalanceController::new(ControllerKind::Flqr, robot, -gain)?;
/// assert!(gate::check(robot, &reversed).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn check(robot: &RobotModel, controller: &BalanceController) -> Result<(), Refusal> {
    if let Some(GainChange { motor, state, .. }) =
        entries(&controller.gain, &controller.gain).find(|entry| !entry.new.is_finite())
    {
        return Err(Refusal::NotFinite { motor, state });
    }
    let timing = SampledLoop::of(robot);
    let Margins { stable, gain_up, gain_down, phase_rad, delay_s, .. } =
        margins(&robot.parameters.linear_model(), &controller.gain, &timing);
    match () {
        () if !stable => Err(Refusal::Unstable { delay_s: timing.delay_s }),
        () if gain_up < LEAST_GAIN_MARGIN => {
            Err(Refusal::GainMargin { factor: gain_up, remedy: "raise the weights R or lower Q" })
        }
        () if gain_down > 1.0 / LEAST_GAIN_MARGIN => {
            Err(Refusal::GainMargin { factor: gain_down, remedy: "lower the weights R or raise Q" })
        }
        () if phase_rad < LEAST_PHASE_MARGIN_RAD => Err(Refusal::PhaseMargin { phase_rad }),
        () if delay_s < LEAST_DELAY_MARGIN_S => Err(Refusal::DelayMargin { delay_s }),
        () => check_decay(robot, controller, &timing)
            .and_then(|()| check_yaw_hold(robot, controller, &timing))
            .and_then(|()| check_feedforward(robot, controller)),
    }
}

/// Checks the loop of the heading, whose gain falls steadily with frequency: b (k + d s)/s² with the torque held for a
/// tick, and b the angular acceleration about the vertical by a torque in opposite senses.
fn check_yaw_hold(
    robot: &RobotModel,
    controller: &BalanceController,
    timing: &SampledLoop,
) -> Result<(), Refusal> {
    let (parameters, chassis) = (&robot.parameters, &robot.chassis);
    let response =
        chassis.track_width_m / (parameters.wheel_radius_m * yaw_inertia_kg_m2(parameters, chassis));
    let stiffness = response * controller.yaw_hold.stiffness_nm_rad;
    let damping = response * controller.yaw_hold.damping_nm_s_rad;
    // |L| = 1: ω⁴ = k² + d² ω².
    let half = 0.5 * damping * damping;
    let crossover_rad_s = (half + half.hypot(stiffness)).sqrt();
    if crossover_rad_s == 0.0 {
        return Ok(());
    }
    let lag_s = timing.delay_s + 0.5 * timing.tick_s;
    let phase_rad = libm::atan2(damping * crossover_rad_s, stiffness) - crossover_rad_s * lag_s;
    let delay_s = phase_rad / crossover_rad_s;
    // Not finite is not enough either.
    let is_enough = phase_rad >= LEAST_PHASE_MARGIN_RAD && delay_s >= LEAST_DELAY_MARGIN_S;
    if is_enough { Ok(()) } else { Err(Refusal::YawHold { phase_rad, delay_s }) }
}

fn check_decay(
    robot: &RobotModel,
    controller: &BalanceController,
    timing: &SampledLoop,
) -> Result<(), Refusal> {
    let poles = sampled_poles(&robot.parameters.linear_model(), &controller.gain, timing);
    match poles.first().map(|slowest| -slowest.s.re) {
        Some(decay_per_s) if decay_per_s < LEAST_DECAY_PER_S => {
            Err(Refusal::Slow { seconds: 1.0 / decay_per_s })
        }
        _ => Ok(()),
    }
}

/// Compares what is fed forward with what the robot's own model feeds forward, as torques of the whole controller.
fn check_feedforward(robot: &RobotModel, controller: &BalanceController) -> Result<(), Refusal> {
    let Some(limit_nm) = robot.limits.torque_nm else { return Ok(()) };
    let largest_nm = LARGEST_EXCESS * limit_nm;
    let made = |kind| {
        BalanceController::new(kind, robot, controller.gain).map(BalanceController::without_rotor_angle)
    };
    let Ok(plain) = made(ControllerKind::Lqr) else { return Ok(()) };
    let declared = made(ControllerKind::Flqr).unwrap_or_else(|_| plain.clone());
    let new = BalanceController { torque_limit_nm: limit_nm, ..controller.clone().without_rotor_angle() };
    let mut excess_nm: f64 = 0.0;
    for speed in PROBE_SPEEDS_RAD_S {
        for torque in PROBE_TORQUES {
            let measurement = probe(&controller.gain, torque * limit_nm, speed);
            let [plain, declared, new] = [&plain, &declared, &new]
                .map(|controller| controller.step(&measurement, &Reference::default()));
            for motor in 0..2 {
                let [low, high] = [plain[motor].min(declared[motor]), plain[motor].max(declared[motor])];
                excess_nm = excess_nm.max(new[motor] - high).max(low - new[motor]);
            }
        }
    }
    if excess_nm > largest_nm { Err(Refusal::Feedforward { excess_nm, largest_nm }) } else { Ok(()) }
}

/// A measurement at which the feedback asks the left motor for `torque_nm`, with both motors at a speed.
fn probe(gain: &Matrix2x4<f64>, torque_nm: f64, motor_speed_rad_s: f64) -> Measurement {
    let column = (0..4).max_by(|a, b| gain[(0, *a)].abs().total_cmp(&gain[(0, *b)].abs())).unwrap_or(0);
    let mut state = nalgebra::Vector4::zeros();
    if gain[(0, column)] != 0.0 {
        state[column] = -torque_nm / gain[(0, column)];
    }
    Measurement {
        state: State::from_vector(&state),
        motor_speed_rad_s: [motor_speed_rad_s; 2],
        ..Measurement::default()
    }
}

/// Every entry of two gains.
pub fn entries(old: &Matrix2x4<f64>, new: &Matrix2x4<f64>) -> impl Iterator<Item = GainChange> {
    let (old, new) = (*old, *new);
    (0..8).map(move |place| {
        let (row, column) = (place / 4, place % 4);
        let entry = (row, column);
        GainChange { motor: MOTORS[row], state: STATES[column], old: old[entry], new: new[entry] }
    })
}

impl GainChange {
    /// New gain over old gain; 1 if both are 0.
    pub fn factor(&self) -> f64 {
        if self.old == self.new { 1.0 } else { self.new / self.old }
    }
}
