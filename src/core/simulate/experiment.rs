//! One experiment from settings to outcome: the declared model makes the controller, the actual one is
//! simulated.

use std::ops::ControlFlow;

use nalgebra::Matrix2x4;

use super::balance_run::{Course, Run};
use super::bench_run::{self, BenchRig, BenchRun};
use super::scenario::{MAX_SECONDS, Scenario};
use super::simulation::{NotFinite, SimulationError, TICK_S};
use crate::ParameterError;
use crate::control::{
    BalanceController, ControlError, ControllerKind, DEFAULT_COMPENSATION, SpeedGains, SpeedPi, SpeedProgram,
};
use crate::effects::EffectFeedforward;
use crate::excitation::{SpeedSweep, Step};
use crate::friction::{Compensation, Feedforward};
use crate::lqr::{self, DesignError, SampledLoop};
use crate::model::{Model, Motor, Payload, Rig, RobotModel};
use crate::parameter::{finite, not_negative, within};
use crate::record::{BenchSample, Log, Sample};

/// Target of the speed tracking (section 4.3), rad/s.
const TARGET_RAD_S: f64 = 5.0;

/// A push on the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Start, s.
    pub start_s: f64,
    /// Force, forward positive, N.
    pub force_n: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Where it acts: above the axle along the body, m; none for the centre of mass.
    pub height_m: Option<f64>,
}

impl Push {
    /// The paper's kick comes at 8.5 s (section 4.4); force, duration and height are not given. Assumed: 30 N
    /// for 0.1 s at the centre of mass, which moves the robot about as far as the paper's.
    pub const KICK: Self = Self { start_s: 8.5, force_n: 30.0, duration_s: 0.1, height_m: None };
}

/// Controller of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerChoice {
    /// State feedback; in the air PI speed control.
    Lqr,
    /// With friction feedforward.
    Flqr,
    /// PI speed control, for experiments in the air.
    Pi,
}

impl ControllerChoice {
    /// Every choice.
    pub const ALL: [Self; 3] = [Self::Lqr, Self::Flqr, Self::Pi];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lqr => "lqr",
            Self::Flqr => "flqr",
            Self::Pi => "pi",
        }
    }
}

/// Settings of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Scenario.
    pub scenario: Scenario,
    /// Controller.
    pub controller: ControllerChoice,
    /// Simulated time, s, at most 3600, rounded to 1 ms.
    pub seconds: f64,
    /// Seed of all noise.
    pub seed: u64,
    /// Gains of the speed control in the air; none for the scenario's own: [`SpeedGains::PAPER`] for speed
    /// tracking, [`SpeedGains::firm`] for the sweep, [`SpeedGains::loose`] for the multisine.
    pub speed_gains: Option<SpeedGains>,
    /// Target of the speed tracking, rad/s.
    pub target_speed_rad_s: f64,
    /// Push of the kick.
    pub kick: Push,
    /// K in place of the model's design.
    pub gain: Option<Matrix2x4<f64>>,
    /// Height of the legs of both models in place of their own, m; the gain is designed for it.
    pub leg_height_m: Option<f64>,
    /// Slope of the ground on top of the model's, upward in the direction of x, rad.
    pub slope_rad: f64,
    /// A load on the body in place of the model's, which the controller does not know of.
    pub payload: Option<Payload>,
    /// Torques of a multisine on the ground as a fraction of the usual ones.
    pub torque_scale: f64,
}

/// Reason why an experiment has no outcome.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExperimentError {
    /// Speed control cannot balance.
    #[error(
        "pi controls the speed of wheels in the air and cannot balance the robot in {scenario}: use lqr or flqr, \
         or a scenario in the air (speed-tracking, friction-sweep, multisine)"
    )]
    PiOnGround {
        /// Requested value.
        scenario: Scenario,
    },
    /// A setting that would change nothing.
    #[error("{setting} has no effect in {scenario} with {}: leave it out, or use {place}", controller.name())]
    NoEffect {
        /// Setting.
        setting: &'static str,
        /// Requested value.
        scenario: Scenario,
        /// The controller with it.
        controller: ControllerChoice,
        /// Scenarios in which it has an effect.
        place: &'static str,
    },
    /// A problem of the robot that is simulated, where it is not the one that makes the controller.
    #[error("{0}")]
    Actual(Box<ExperimentError>),
    /// A single axis that is to balance.
    #[error(
        "{scenario} with {} needs a robot, but {name:?} is a single axis: give a model with a [robot] table",
        controller.name()
    )]
    NeedsRobot {
        /// Requested value.
        scenario: Scenario,
        /// The controller with it.
        controller: ControllerChoice,
        /// Name of the model.
        name: String,
    },
    /// A carriage that is to turn.
    #[error(
        "{scenario} needs a motor shaft, but {name:?} is a linear axis: give a [robot] or an [axis] with \
         kind = \"rotary\""
    )]
    NeedsShaft {
        /// Requested value.
        scenario: Scenario,
        /// Name of the model.
        name: String,
    },
    /// Nothing to design with.
    #[error(
        "the model has no [lqr] table: add q_diagonal = [4 numbers] and r_diagonal = [2 numbers], or give a gain"
    )]
    NoWeights,
    /// A design that does not exist.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A controller that cannot be made.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// A setting out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A robot that cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A sweep whose dwells are too short.
    #[error("{seconds} s are too short for 33 speeds: give at least {least} s")]
    SweepTooShort {
        /// Asked for, s.
        seconds: f64,
        /// Needed, s.
        least: f64,
    },
    /// A motion that became infinite or undefined.
    #[error("{problem}")]
    NotFinite {
        /// When it happened.
        problem: NotFinite,
        /// The run up to there.
        kept: Box<Outcome>,
    },
}

/// Outcome of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The robot on the ground.
    Ground(Run),
    /// Motors with their wheels in the air.
    Bench(BenchRun),
}

impl Outcome {
    /// Recording: a robot log, or a bench log of one motor with its measured and its target speed.
    pub fn log(&self, motor: Motor) -> Log {
        match self {
            Self::Ground(run) => log_of(Sample::COLUMNS, run.samples.iter().map(Sample::to_row)),
            Self::Bench(run) => {
                log_of(BenchSample::COLUMNS, run.samples.iter().map(|sample| sample.to_row(motor)))
            }
        }
    }

    /// Warnings known before the run.
    pub fn warnings(&self) -> &[String] {
        match self {
            Self::Ground(run) => &run.warnings,
            Self::Bench(run) => &run.warnings,
        }
    }

    fn not_finite(&self) -> Option<NotFinite> {
        match self {
            Self::Ground(run) => run.not_finite,
            Self::Bench(run) => run.not_finite,
        }
    }
}

fn log_of<const COLUMNS: usize>(
    names: [&'static str; COLUMNS],
    rows: impl ExactSizeIterator<Item = [f64; COLUMNS]>,
) -> Log {
    let mut columns = names.map(|name| (name, Vec::with_capacity(rows.len())));
    for row in rows {
        for (column, value) in columns.iter_mut().zip(row) {
            column.1.push(value);
        }
    }
    Log::from_columns("simulated", columns)
}

/// Runs an experiment on `actual` under the controller that `declared` makes; normally both are the same.
/// `watch` hears the share that is done, every 10 ms of simulated time, and may stop the run, which then ends
/// there.
///
/// # Errors
/// Settings or models that do not fit the scenario, a design that does not exist, a motion that does not stay
/// finite; what was recorded of it comes with the error.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use flqr_core::model_file::presets;
/// use flqr_core::simulate::{ControllerChoice, Experiment, Outcome, Scenario, run};
///
/// let model = presets::paper();
/// let experiment = Experiment { seconds: 20.0, ..Experiment::new(Scenario::Flat, ControllerChoice::Flqr) };
/// let outcome = run(&experiment, &model, &model, &mut |_| ControlFlow::Continue(()))?;
/// let Outcome::Ground(run) = outcome else { return Err("not on the ground".into()) };
/// assert!(run.statistics.settled && !run.statistics.fell);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn run(
    experiment: &Experiment,
    declared: &Model,
    actual: &Model,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Outcome, ExperimentError> {
    let plan = Plan::new(experiment, declared, actual)?;
    let warnings = plan.warnings();
    let ticks = (experiment.seconds / TICK_S).round() as usize;
    let outcome = match plan {
        Plan::Ground { controller, actual, .. } => {
            let course = Course::new(experiment);
            Outcome::Ground(course.run(&actual, controller, experiment.seed, warnings, watch)?)
        }
        Plan::Bench { control, fed, program, actual, .. } => {
            let run = bench_run::run(&actual, &control, fed, &program, ticks, experiment.seed, watch);
            Outcome::Bench(BenchRun { warnings, ..run })
        }
    };
    match outcome.not_finite() {
        Some(problem) => Err(ExperimentError::NotFinite { problem, kept: Box::new(outcome) }),
        None => Ok(outcome),
    }
}

/// An experiment that can start.
enum Plan {
    Ground {
        controller: BalanceController,
        /// True if the gain was given rather than designed.
        given: bool,
        declared: Box<RobotModel>,
        actual: Box<RobotModel>,
    },
    Bench {
        control: [SpeedPi; 2],
        fed: Option<EffectFeedforward>,
        program: SpeedProgram,
        gains: SpeedGains,
        declared: Box<BenchRig>,
        actual: Box<BenchRig>,
    },
}

impl Experiment {
    /// An experiment with the defaults of its scenario.
    pub fn new(scenario: Scenario, controller: ControllerChoice) -> Self {
        Self {
            scenario,
            controller,
            seconds: scenario.default_seconds(),
            seed: 1,
            speed_gains: None,
            target_speed_rad_s: TARGET_RAD_S,
            kick: Push::KICK,
            gain: None,
            leg_height_m: None,
            slope_rad: 0.0,
            payload: None,
            torque_scale: 1.0,
        }
    }

    /// Returns whether the robot balances; otherwise its wheels are in the air.
    pub fn on_ground(&self) -> bool {
        self.scenario.on_ground()
            && !(self.scenario == Scenario::Multisine && self.controller == ControllerChoice::Pi)
    }

    /// Returns warnings known before the run: a gain whose loop is unstable when sampled.
    ///
    /// # Errors
    /// As [`run`], except for the motion.
    pub fn check(&self, declared: &Model, actual: &Model) -> Result<Vec<String>, ExperimentError> {
        Ok(Plan::new(self, declared, actual)?.warnings())
    }

    /// Returns whether scenario, controller and settings go together, whatever the models.
    ///
    /// # Errors
    /// Speed control on the ground, and settings that would change nothing; all are wrong usage.
    pub fn check_usage(&self) -> Result<(), ExperimentError> {
        if self.on_ground() && self.controller == ControllerChoice::Pi {
            return Err(ExperimentError::PiOnGround { scenario: self.scenario });
        }
        let default = Self::new(self.scenario, self.controller);
        let ground = "a scenario on the ground";
        let ignored = [
            ("a gain", !self.on_ground() && self.gain.is_some(), ground),
            ("a leg height", !self.on_ground() && self.leg_height_m.is_some(), ground),
            ("a slope", !self.on_ground() && self.slope_rad != 0.0, ground),
            ("a payload", !self.on_ground() && self.payload.is_some(), ground),
            (
                "a scale of the torques",
                !(self.on_ground() && self.scenario == Scenario::Multisine) && self.torque_scale != 1.0,
                "the scenario multisine on the ground",
            ),
            ("a pair of kp and ki", self.on_ground() && self.speed_gains.is_some(), "a scenario in the air"),
            ("a kick", self.scenario != Scenario::Kick && self.kick != default.kick, "the scenario kick"),
            (
                "a target speed",
                self.scenario != Scenario::SpeedTracking
                    && self.target_speed_rad_s != default.target_speed_rad_s,
                "the scenario speed-tracking",
            ),
        ];
        let (scenario, controller) = (self.scenario, self.controller);
        match ignored.into_iter().find(|(_, ignored, _)| *ignored) {
            Some((setting, _, place)) => {
                Err(ExperimentError::NoEffect { setting, scenario, controller, place })
            }
            None => Ok(()),
        }
    }

    fn validate(&self) -> Result<(), ExperimentError> {
        self.check_usage()?;
        within("seconds", self.seconds, TICK_S..=MAX_SECONDS, "from 0.001 to 3600")?;
        within("target_speed_rad_s", self.target_speed_rad_s, -1e3..=1e3, "from -1000 to 1000")?;
        if self.target_speed_rad_s == 0.0 {
            let allowed = "other than 0, the initial speed";
            return Err(
                ParameterError { name: "target_speed_rad_s", value: 0.0, allowed: allowed.into() }.into()
            );
        }
        if let Some(SpeedGains { kp, ki }) = self.speed_gains {
            not_negative("kp", kp)?;
            not_negative("ki", ki)?;
        }
        within("torque_scale", self.torque_scale, 0.0..=100.0, "from 0 to 100")?;
        within("start_s", self.kick.start_s, 0.0..=MAX_SECONDS, "from 0 to 3600")?;
        within("duration_s", self.kick.duration_s, 0.0..=MAX_SECONDS, "from 0 to 3600")?;
        finite("force_n", self.kick.force_n)?;
        Ok(finite("height_m", self.kick.height_m.unwrap_or(0.0))?)
    }

    /// The robot with its legs as requested.
    fn robot(&self, model: &Model) -> Result<Box<RobotModel>, ExperimentError> {
        let Rig::Robot(robot) = &model.rig else {
            let (scenario, controller) = (self.scenario, self.controller);
            return Err(ExperimentError::NeedsRobot { scenario, controller, name: model.name.clone() });
        };
        Ok(match self.leg_height_m {
            Some(height) => Box::new(robot.at_leg_height(height)?),
            None => robot.clone(),
        })
    }

    fn rig(&self, model: &Model) -> Result<BenchRig, ExperimentError> {
        match &model.rig {
            Rig::Robot(robot) => {
                robot.validate()?;
                Ok(BenchRig::of_robot(robot))
            }
            Rig::Axis(axis) => BenchRig::of_axis(axis).ok_or_else(|| ExperimentError::NeedsShaft {
                scenario: self.scenario,
                name: model.name.clone(),
            }),
        }
    }

    fn program(&self, declared: &BenchRig) -> Result<(SpeedProgram, SpeedGains), ExperimentError> {
        let inertia = declared.inertia_kg_m2;
        let (program, gains) = match self.scenario {
            Scenario::FrictionSweep => {
                let least = SpeedSweep::least_seconds();
                let sweep = SpeedSweep::new(self.seconds)
                    .ok_or(ExperimentError::SweepTooShort { seconds: self.seconds, least })?;
                (SpeedProgram::Sweep(sweep), SpeedGains::firm(inertia))
            }
            Scenario::Multisine => {
                (SpeedProgram::multisine(inertia, &declared.friction), SpeedGains::loose(inertia))
            }
            _ => {
                let step = Step { start_s: 0.0, before: 0.0, after: self.target_speed_rad_s };
                (SpeedProgram::Step(step), SpeedGains::PAPER)
            }
        };
        Ok((program, self.speed_gains.unwrap_or(gains)))
    }
}

impl Plan {
    fn new(experiment: &Experiment, declared: &Model, actual: &Model) -> Result<Self, ExperimentError> {
        experiment.validate()?;
        if experiment.on_ground() {
            let [declared, mut actual] =
                [experiment.robot(declared)?, experiment.robot(actual).map_err(of_actual)?];
            actual.surroundings.slope_rad += experiment.slope_rad;
            actual.surroundings.payload = experiment.payload.or(actual.surroundings.payload);
            actual.surroundings.validate()?;
            let gain = match experiment.gain {
                Some(gain) => gain,
                None => {
                    let weights = declared.weights.ok_or(ExperimentError::NoWeights)?;
                    lqr::design(&declared.parameters.linear_model(), &weights)?.gain
                }
            };
            let kind = match experiment.controller {
                ControllerChoice::Flqr => ControllerKind::Flqr,
                ControllerChoice::Lqr | ControllerChoice::Pi => ControllerKind::Lqr,
            };
            let controller = BalanceController::new(kind, &declared, gain)?;
            return Ok(Self::Ground { controller, given: experiment.gain.is_some(), declared, actual });
        }
        let compensation = declared.robot().and_then(|robot| robot.compensation);
        let [declared, actual] = [experiment.rig(declared)?, experiment.rig(actual).map_err(of_actual)?];
        let (program, gains) = experiment.program(&declared)?;
        let compensated = experiment.controller == ControllerChoice::Flqr;
        let compensation = compensated.then_some(compensation.unwrap_or(DEFAULT_COMPENSATION));
        let control = speed_control(&declared, gains, compensation)?;
        let fed = compensation.and_then(|compensation| declared.feedforward(compensation));
        let (declared, actual) = (Box::new(declared), Box::new(actual));
        Ok(Self::Bench { control, fed, program, gains, declared, actual })
    }

    fn warnings(&self) -> Vec<String> {
        let unstable = |declared: bool, actual: bool, loop_of: &str, remedy: &str| match (declared, actual) {
            (true, _) => Some(format!("{loop_of} is unstable on the model, including its delay: {remedy}")),
            (false, true) => Some(format!(
                "{loop_of} is stable on the model but unstable on the simulated robot: {remedy}"
            )),
            (false, false) => None,
        };
        match self {
            Self::Ground { controller, given, declared, actual } => {
                let fails = |robot: &RobotModel| !is_stable(robot, &controller.gain);
                let remedy = if *given {
                    "use the gain of the design, or choose another one"
                } else {
                    "design it with other weights, or shorten the delay"
                };
                unstable(fails(declared), fails(actual), "the balance loop with this gain", remedy)
            }
            Self::Bench { gains, declared, actual, .. } => {
                let fails =
                    |rig: &BenchRig| gains.phase_margin_rad(rig.inertia_kg_m2, rig.loop_delay_s()) <= 0.0;
                unstable(
                    fails(declared),
                    fails(actual),
                    "the speed control",
                    "lower kp and ki, or shorten the delay",
                )
            }
        }
        .into_iter()
        .collect()
    }
}

fn of_actual(error: ExperimentError) -> ExperimentError {
    ExperimentError::Actual(Box::new(error))
}

fn speed_control(
    rig: &BenchRig,
    gains: SpeedGains,
    compensation: Option<Compensation>,
) -> Result<[SpeedPi; 2], ExperimentError> {
    let fed = compensation.and_then(|compensation| rig.feedforward(compensation));
    if compensation.is_some() && fed.is_none() && rig.friction.iter().all(Option::is_none) {
        return Err(ControlError::NoFriction.into());
    }
    let mut control = [SpeedPi {
        proportional_nm_s_rad: gains.kp,
        integral_nm_rad: gains.ki,
        feedforward: None,
        torque_limit_nm: rig.torque_limit_nm(),
    }; 2];
    for (motor, curve) in control.iter_mut().zip(rig.friction) {
        let both = curve.zip(compensation);
        motor.feedforward = both.map(|(curve, how)| Feedforward::new(curve, how)).transpose()?;
    }
    Ok(control)
}

/// Returns whether the sampled loop on a robot is stable: sampled, delayed, with a held IMU.
fn is_stable(robot: &RobotModel, gain: &Matrix2x4<f64>) -> bool {
    lqr::margins(&robot.parameters.linear_model(), gain, &SampledLoop::of(robot)).stable
}
