//! The experiments behind the report: all independent of each other, so that they run side by side.

use std::ops::ControlFlow;

use super::paper::{Range, SPEED_GAINS};
use super::{ReproduceError, Settings};
use crate::control::DEFAULT_COMPENSATION;
use crate::friction::{Compensation, Stribeck, StribeckParameters};
use crate::identify::{self, Bounds, FitOptions, FitReport, Method, SearchBox};
use crate::model::{Actuation, Model, Motor, MotorLimits, Rig, RobotModel, SensorSettings};
use crate::parallel;
use crate::record::Sample;
use crate::simulate::{
    ControllerChoice, Experiment, Outcome, Push, Scenario, SpeedGains, Statistics, StepResponse, Summary, run,
};

/// Duration of the disturbance by a kick, s.
const DISTURBED_S: f64 = 5.0;
/// End of a speed tracking that shows whether it comes to rest, s.
const LAST_S: f64 = 1.0;
/// Length of the figure of a run with a kick, s.
const KICK_SHOWN_S: f64 = 30.0;

/// One motor's identification on the bench.
pub(super) struct Identified {
    /// The friction that the bench had.
    pub(super) curve: Stribeck,
    /// Bounds from the data, polished.
    pub(super) fit: FitReport,
    /// The swarm alone within Table 3 as printed.
    pub(super) as_printed: FitReport,
    /// Least root mean square error that any curve within Table 3 has, N m.
    pub(super) least_as_printed_nm: f64,
}

/// One run of the speed tracking.
pub(super) struct Tracked {
    pub(super) gains: [f64; 2],
    pub(super) response: [StepResponse; 2],
    /// Peak to peak of the measured speed over the last second, rad/s.
    pub(super) ripple_rad_s: [f64; 2],
    /// Warnings known before the run.
    pub(super) warnings: Vec<String>,
    /// Measured speed over time of both motors.
    pub(super) speed: [Vec<[f64; 2]>; 2],
}

/// One balance run, its x about where the robot is to stand.
pub(super) struct Balanced {
    pub(super) seconds: f64,
    pub(super) statistics: Statistics,
    pub(super) fell_at_s: Option<f64>,
    /// x, ẋ and pitch over time; empty where nothing shows them.
    pub(super) curves: [Vec<[f64; 2]>; 3],
}

/// LQR's and FLQR's runs, one for each seed.
pub(super) type Runs = [Vec<Balanced>; 2];

/// When the kick comes, and the spans that Table 7 is made from.
#[derive(Clone, Copy)]
pub(super) struct KickWindows {
    pub(super) kick_s: f64,
    pub(super) force_n: f64,
    pub(super) duration_s: f64,
    pub(super) steady_s: Range,
    pub(super) disturbed_s: Range,
    pub(super) shown_s: Range,
}

/// Everything that was run.
pub(super) struct Trials {
    /// Left and right.
    pub(super) motors: [Identified; 2],
    /// For each pair of gains without and with compensation.
    pub(super) tracking: Vec<[Tracked; 2]>,
    pub(super) target_speed_rad_s: f64,
    pub(super) flat: Runs,
    pub(super) bridge: Runs,
    pub(super) kick: Runs,
    pub(super) windows: KickWindows,
    /// FLQR on flat ground with one imperfection taken away; the first with none.
    pub(super) causes: Vec<(&'static str, Balanced)>,
}

/// A change of the robot that the controller is made for, and of the one that is simulated.
type Change = fn([&mut RobotModel; 2]);

/// Causes of the residual motion with FLQR, each taken away by itself.
const CAUSES: [(&str, Change); 7] = [
    ("as modelled", |_| ()),
    ("no torque noise", |[_, actual]| actual.actuation.torque_noise_nm = 0.0),
    ("sensors without noise and quantization", |[_, actual]| exact_sensors(actual)),
    ("no delay", |[_, actual]| actual.actuation.delay_s = 0.0),
    ("full friction compensation", |[declared, _]| compensate_all(declared)),
    ("none of these, no limits and no sample-and-hold", |[declared, actual]| {
        compensate_all(declared);
        ideal(actual);
    }),
    ("none of these, and no friction", |[declared, actual]| {
        ideal(actual);
        without_friction([declared, actual]);
    }),
];

fn exact_sensors(robot: &mut RobotModel) {
    robot.sensors = robot.sensors.exact();
}

fn ideal(robot: &mut RobotModel) {
    robot.actuation = Actuation { delay_s: 0.0, torque_noise_nm: 0.0, torque_step_nm: 0.0 };
    robot.limits = MotorLimits::default();
    robot.sensors = SensorSettings { imu_rate_hz: 1000.0, ..SensorSettings::default().exact() };
}

fn without_friction([declared, actual]: [&mut RobotModel; 2]) {
    let none = Stribeck::new(StribeckParameters::NONE).expect("no friction is a friction");
    for robot in [declared, actual] {
        robot.friction = [Some(none); 2];
    }
}

fn compensate_all(robot: &mut RobotModel) {
    let compensation = robot.compensation.unwrap_or(DEFAULT_COMPENSATION);
    robot.compensation = Some(Compensation { ratio: 1.0, ..compensation });
}

/// A balance run to be done.
struct BalanceJob {
    scenario: Scenario,
    controller: ControllerChoice,
    seed: u64,
    keep_curves: bool,
    change: Change,
}

const BALANCE: [ControllerChoice; 2] = [ControllerChoice::Lqr, ControllerChoice::Flqr];
const SPEED: [ControllerChoice; 2] = [ControllerChoice::Pi, ControllerChoice::Flqr];

/// Runs everything; `watch` is told the share that is done.
pub(super) fn run_all(
    model: &Model,
    settings: &Settings<'_>,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Trials, ReproduceError> {
    let motors = [Motor::Left, Motor::Right];
    let speeds: Vec<_> =
        SPEED_GAINS.into_iter().flat_map(|gains| SPEED.map(|controller| (gains, controller))).collect();
    let balances = balance_jobs(settings);
    let mut crew = Crew { settings, watch, done: 0, all: motors.len() + speeds.len() + balances.len() };
    let identified = crew.run(&motors, |motor| identify(model, *motor, settings.seed))?;
    let tracked =
        crew.run(&speeds, |(gains, controller)| track(model, *gains, *controller, settings.seed))?;
    let mut balanced = crew.run(&balances, |job| balance(model, job))?.into_iter();
    let seeds = settings.seeds.get();
    let mut take = || [(); 2].map(|()| balanced.by_ref().take(seeds).collect::<Vec<_>>());
    let (flat, bridge, kick) = (take(), take(), take());
    Ok(Trials {
        motors: pairs(identified).remove(0),
        tracking: pairs(tracked),
        target_speed_rad_s: Experiment::new(Scenario::SpeedTracking, ControllerChoice::Pi).target_speed_rad_s,
        windows: windows(&kick),
        flat,
        bridge,
        kick,
        causes: CAUSES.into_iter().map(|(name, _)| name).zip(balanced).collect(),
    })
}

/// Runs batches of experiments and counts them.
struct Crew<'a> {
    settings: &'a Settings<'a>,
    watch: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    done: usize,
    all: usize,
}

impl Crew<'_> {
    fn run<T: Sync, R: Send>(
        &mut self,
        jobs: &[T],
        f: impl Fn(&T) -> Result<R, ReproduceError> + Sync,
    ) -> Result<Vec<R>, ReproduceError> {
        let before = self.done;
        let results = parallel::map_watched(jobs, self.settings.threads, f, &mut |done| {
            (self.watch)((before + done) as f64 / self.all as f64)
        });
        self.done += jobs.len();
        results.ok_or(ReproduceError::Cancelled)?.into_iter().collect()
    }
}

/// Neighbours together.
fn pairs<T>(items: Vec<T>) -> Vec<[T; 2]> {
    let mut items = items.into_iter();
    let mut pairs = Vec::new();
    while let (Some(first), Some(second)) = (items.next(), items.next()) {
        pairs.push([first, second]);
    }
    pairs
}

/// Flat, bridge and kick under both controllers with every seed, then the causes.
fn balance_jobs(settings: &Settings<'_>) -> Vec<BalanceJob> {
    let mut jobs = Vec::new();
    for scenario in [Scenario::Flat, Scenario::Bridge, Scenario::Kick] {
        for controller in BALANCE {
            for number in 0..settings.seeds.get() {
                let seed = settings.seed_number(number);
                let keep_curves = number == 0 || scenario == Scenario::Kick;
                jobs.push(BalanceJob { scenario, controller, seed, keep_curves, change: |_| () });
            }
        }
    }
    jobs.extend(CAUSES.map(|(_, change)| BalanceJob {
        scenario: Scenario::Flat,
        controller: ControllerChoice::Flqr,
        seed: settings.seed,
        keep_curves: false,
        change,
    }));
    jobs
}

fn identify(model: &Model, motor: Motor, seed: u64) -> Result<Identified, ReproduceError> {
    let robot = model.robot().expect("the caller has checked that the model is a robot");
    let curve = robot.friction[motor as usize].ok_or(ReproduceError::NoFriction)?;
    let sweep = Experiment { seed, ..Experiment::new(Scenario::FrictionSweep, ControllerChoice::Pi) };
    let log = run(&sweep, model, model, &mut |_| ControlFlow::Continue(()))?.log(motor);
    let fit = |method, bounds| {
        let options = FitOptions { method, bounds, seed, ..FitOptions::default() };
        identify::fit(std::slice::from_ref(&log), None, motor, &options, &mut |_| ControlFlow::Continue(()))
    };
    let (fit, as_printed) = (fit(Method::Best, Bounds::Data)?, fit(Method::Pso, Bounds::Paper)?);
    let least = identify::polish_pairs(&fit.pairs, &SearchBox::paper());
    let least_as_printed_nm = least.map_or(f64::NAN, |(_, error)| error);
    Ok(Identified { curve, fit, as_printed, least_as_printed_nm })
}

fn track(
    model: &Model,
    gains: [f64; 2],
    controller: ControllerChoice,
    seed: u64,
) -> Result<Tracked, ReproduceError> {
    let [kp, ki] = gains;
    let experiment = Experiment {
        seed,
        speed_gains: Some(SpeedGains { kp, ki }),
        ..Experiment::new(Scenario::SpeedTracking, controller)
    };
    let outcome = run(&experiment, model, model, &mut |_| ControlFlow::Continue(()))?;
    let Outcome::Bench(bench) = outcome else { unreachable!("speed tracking runs in the air") };
    let response = bench.tracking.expect("speed tracking has a step");
    let speed = |motor: usize| {
        let points = bench.samples.iter().map(|sample| [sample.time_s, sample.motor_speed_rad_s[motor]]);
        points.collect::<Vec<_>>()
    };
    let speed = [0, 1].map(speed);
    let last = [experiment.seconds - LAST_S, experiment.seconds];
    let ripple_rad_s = speed.each_ref().map(|curve| {
        let [low, high] = range_within(curve, last);
        high - low
    });
    Ok(Tracked { gains, response, ripple_rad_s, warnings: bench.warnings, speed })
}

fn balance(model: &Model, job: &BalanceJob) -> Result<Balanced, ReproduceError> {
    let experiment = Experiment { seed: job.seed, ..Experiment::new(job.scenario, job.controller) };
    let (mut declared, mut actual) = (model.clone(), model.clone());
    if let (Rig::Robot(declared), Rig::Robot(actual)) = (&mut declared.rig, &mut actual.rig) {
        (job.change)([declared, actual]);
    }
    let outcome = run(&experiment, &declared, &actual, &mut |_| ControlFlow::Continue(()))?;
    let Outcome::Ground(run) = outcome else { unreachable!("the balance experiments run on the ground") };
    let about = |summary: Summary| Summary {
        min: summary.min - run.target_x_m,
        max: summary.max - run.target_x_m,
        mean: summary.mean - run.target_x_m,
        ..summary
    };
    let values: [fn(&Sample) -> f64; 3] =
        [|sample| sample.x_m, |sample| sample.x_dot_m_s, |sample| sample.pitch_rad];
    let mut curves = values.map(|value| {
        let kept = run.samples.iter().filter(|_| job.keep_curves);
        kept.map(|sample| [sample.time_s, value(sample)]).collect::<Vec<_>>()
    });
    for point in &mut curves[0] {
        point[1] -= run.target_x_m;
    }
    Ok(Balanced {
        seconds: experiment.seconds,
        statistics: Statistics { x_m: about(run.statistics.x_m), ..run.statistics },
        fell_at_s: run.fall.map(|fall| fall.time_s),
        curves,
    })
}

fn windows(kick: &Runs) -> KickWindows {
    let Push { start_s, force_n, duration_s, .. } =
        Experiment::new(Scenario::Kick, ControllerChoice::Lqr).kick;
    let first = &kick[0][0];
    let disturbed_s = [start_s, start_s + DISTURBED_S];
    KickWindows {
        kick_s: start_s,
        force_n,
        duration_s,
        steady_s: [first.statistics.from_s.max(disturbed_s[1]), first.seconds],
        disturbed_s,
        shown_s: [0.0, first.seconds.min(KICK_SHOWN_S)],
    }
}

impl Balanced {
    /// Ranges of x, ẋ and pitch, steady and disturbed.
    pub(super) fn ranges(&self, windows: &KickWindows) -> [[Range; 2]; 3] {
        std::array::from_fn(|quantity| {
            [windows.steady_s, windows.disturbed_s].map(|span| range_within(&self.curves[quantity], span))
        })
    }
}

/// Least and greatest value of a curve over a span of time.
fn range_within(curve: &[[f64; 2]], [from, to]: Range) -> Range {
    let inside = curve.iter().filter(|point| point[0] >= from && point[0] <= to);
    inside.fold([f64::NAN; 2], |[low, high], point| [low.min(point[1]), high.max(point[1])])
}
