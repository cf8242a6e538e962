//! The one place where the window meets the core's experiments.

use std::ops::ControlFlow;
use std::path::Path;

use flqr_core::model::{Model, Motor, Rig};
use flqr_core::record::{BenchSample, Log, Sample};
use flqr_core::simulate::{
    self, BenchRun, ControllerChoice, Experiment, ExperimentError, Fall, Outcome, Run, Scenario, SpeedGains,
    Statistics, StepResponse, Summary, TimedPose,
};

use crate::shell_word::quoted;

/// Longest run here, s; the command runs longer ones.
pub(super) const LONGEST_S: f64 = 600.0;
pub(super) const SHORTEST_S: f64 = 0.1;

/// Settings of both runs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    pub(super) scenario: Scenario,
    pub(super) seconds: f64,
    pub(super) seed: u64,
    /// Gains of the speed control in the air; none for the scenario's own.
    pub(super) speed_gains: Option<SpeedGains>,
}

impl Default for Settings {
    fn default() -> Self {
        let scenario = Scenario::Flat;
        Self { scenario, seconds: scenario.default_seconds(), seed: 1, speed_gains: None }
    }
}

impl Settings {
    /// Another scenario with its own duration and gains; the seed stays.
    pub(super) fn choose(&mut self, scenario: Scenario) {
        if scenario != self.scenario {
            *self =
                Self { scenario, seconds: scenario.default_seconds(), speed_gains: None, seed: self.seed };
        }
    }

    /// For a session file.
    pub(super) fn to_value(&self) -> serde_json::Value {
        serde_json::json!({
            "scenario": self.scenario.name(),
            "seconds": self.seconds,
            "seed": self.seed,
            "speed_gains": self.speed_gains.map(|gains| [gains.kp, gains.ki]),
        })
    }

    /// From a session file.
    pub(super) fn from_value(value: &serde_json::Value) -> Result<Self, String> {
        let refused = |key: &str| format!("“{key}” of the experiment cannot be read");
        let name = value["scenario"].as_str().ok_or_else(|| refused("scenario"))?;
        let scenario: Scenario = name.parse().map_err(|_| refused("scenario"))?;
        let seconds = value["seconds"].as_f64().filter(|seconds| seconds.is_finite());
        let gain = |index: usize| value["speed_gains"][index].as_f64().filter(|gain| *gain >= 0.0);
        Ok(Self {
            scenario,
            seconds: seconds.ok_or_else(|| refused("seconds"))?.clamp(SHORTEST_S, LONGEST_S),
            seed: value["seed"].as_u64().ok_or_else(|| refused("seed"))?,
            speed_gains: gain(0).zip(gain(1)).map(|(kp, ki)| SpeedGains { kp, ki }),
        })
    }

    fn experiment(&self, variant: Variant) -> Experiment {
        Experiment {
            seconds: self.seconds,
            seed: self.seed,
            speed_gains: self.speed_gains,
            ..Experiment::new(self.scenario, variant.controller(self.scenario))
        }
    }
}

/// The two controllers that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variant {
    /// Without friction feedforward.
    Plain,
    /// With it.
    Compensated,
}

impl Variant {
    pub(super) const ALL: [Self; 2] = [Self::Plain, Self::Compensated];

    fn controller(self, scenario: Scenario) -> ControllerChoice {
        match self {
            Self::Plain if scenario.on_ground() => ControllerChoice::Lqr,
            Self::Plain => ControllerChoice::Pi,
            Self::Compensated => ControllerChoice::Flqr,
        }
    }

    /// Name for people.
    pub(super) fn title(self, scenario: Scenario) -> &'static str {
        match (self, scenario.on_ground()) {
            (Self::Plain, true) => "LQR",
            (Self::Compensated, true) => "FLQR",
            (Self::Plain, false) => "PI",
            (Self::Compensated, false) => "PI+FF",
        }
    }

    /// Name in the command and in names of files.
    pub(super) fn name(self, scenario: Scenario) -> &'static str {
        self.controller(scenario).name()
    }
}

/// A run, ready for plots.
#[derive(Debug)]
pub(super) struct Recorded {
    outcome: Outcome,
    /// Reason of an early end, if the motion became non-finite.
    problem: Option<String>,
    /// True if there is one shaft in place of two.
    single: bool,
    pub(super) time_s: Vec<f64>,
    /// One column for each of the signals.
    pub(super) columns: Vec<Vec<f64>>,
    /// Speed that the motors are to have, rad/s, in the air.
    pub(super) target_rad_s: Option<Vec<f64>>,
}

impl Recorded {
    fn new(outcome: Outcome, problem: Option<String>, model: &Model) -> Self {
        let single = matches!(model.rig, Rig::Axis(_));
        let (time_s, columns, target_rad_s) = match &outcome {
            Outcome::Ground(run) => (column(&run.samples, |s| s.time_s), ground_columns(run), None),
            Outcome::Bench(run) => {
                let target = column(&run.samples, |sample| sample.target_speed_rad_s);
                (column(&run.samples, |s| s.time_s), bench_columns(run, single), Some(target))
            }
        };
        Self { outcome, problem, single, time_s, columns, target_rad_s }
    }

    /// Time of the last sample, s.
    pub(super) fn end_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }

    /// Start of the core's statistics, s.
    pub(super) fn statistics_from_s(&self) -> f64 {
        match &self.outcome {
            Outcome::Ground(run) => run.statistics.from_s,
            Outcome::Bench(_) => 0.0,
        }
    }

    /// The core's statistics from one time to another, one for each of the signals; none without samples.
    pub(super) fn statistics_between(&self, range_s: [f64; 2]) -> Option<Vec<Summary>> {
        match &self.outcome {
            Outcome::Ground(Run { samples, .. }) => Statistics::between(samples, range_s)
                .map(|found| vec![found.x_m, found.x_dot_m_s, found.pitch_rad]),
            Outcome::Bench(run) => {
                let motors = self.motors().iter().map(|motor| run.statistics_between(*motor, range_s));
                motors.collect::<Option<Vec<_>>>().map(|motors| motors.concat())
            }
        }
    }

    fn motors(&self) -> &'static [Motor] {
        if self.single { &[Motor::Left] } else { &[Motor::Left, Motor::Right] }
    }

    /// Step responses of the motors, if any.
    pub(super) fn tracking(&self) -> Option<&[StepResponse]> {
        match &self.outcome {
            Outcome::Ground(_) => None,
            Outcome::Bench(run) => Some(&run.tracking.as_ref()?[..self.motors().len()]),
        }
    }

    /// Returns whether x stayed within the core's limit in the end; none in the air.
    pub(super) fn settled(&self) -> Option<bool> {
        match &self.outcome {
            Outcome::Ground(run) => Some(run.statistics.settled),
            Outcome::Bench(_) => None,
        }
    }

    /// Returns whether the robot fell at any time; none in the air.
    pub(super) fn fell(&self) -> Option<bool> {
        match &self.outcome {
            Outcome::Ground(run) => Some(run.statistics.fell),
            Outcome::Bench(_) => None,
        }
    }

    pub(super) fn fall(&self) -> Option<&Fall> {
        match &self.outcome {
            Outcome::Ground(run) => run.fall.as_ref(),
            Outcome::Bench(_) => None,
        }
    }

    /// Describes a fall or another early end in one sentence.
    pub(super) fn failure(&self) -> Option<String> {
        if let Some(problem) = &self.problem {
            return Some(format!("{problem}."));
        }
        let Fall { time_s, state } = self.fall()?;
        let text = format!(
            "fell at {time_s:.3} s, at x {:.3} m with {:.3} m/s, pitch {:.3} rad with {:.3} rad/s.",
            state.x_m, state.x_dot_m_s, state.pitch_rad, state.pitch_rate_rad_s
        );
        Some(text.replace('-', "−"))
    }

    /// Warnings known before the run.
    pub(super) fn warnings(&self) -> &[String] {
        self.outcome.warnings()
    }

    /// True position of the robot, every 10 ms; empty in the air.
    pub(super) fn poses(&self) -> &[TimedPose] {
        match &self.outcome {
            Outcome::Ground(run) => &run.poses,
            Outcome::Bench(_) => &[],
        }
    }

    /// Position setpoint, m; `None` if it stays or returns.
    pub(super) fn target_x_m(&self) -> Option<f64> {
        match &self.outcome {
            Outcome::Ground(run) => Some(run.target_x_m).filter(|target| *target != 0.0),
            Outcome::Bench(_) => None,
        }
    }

    /// Motor angles at a sample, in the air, rad.
    pub(super) fn motor_angles_rad(&self, index: usize) -> Option<[f64; 2]> {
        match &self.outcome {
            Outcome::Ground(_) => None,
            Outcome::Bench(run) => run.samples.get(index).map(|sample| sample.motor_angle_rad),
        }
    }

    /// The run as logs in the formats that every command reads, each with what its file's name ends in.
    pub(super) fn logs(&self) -> Vec<(&'static str, Log)> {
        match (&self.outcome, self.single) {
            (Outcome::Ground(_), _) | (Outcome::Bench(_), true) => vec![("", self.outcome.log(Motor::Left))],
            (Outcome::Bench(_), false) => [("-left", Motor::Left), ("-right", Motor::Right)]
                .map(|(suffix, motor)| (suffix, self.outcome.log(motor)))
                .into(),
        }
    }
}

fn column<T>(samples: &[T], value: impl Fn(&T) -> f64) -> Vec<f64> {
    samples.iter().map(value).collect()
}

fn ground_columns(run: &Run) -> Vec<Vec<f64>> {
    let values: [fn(&Sample) -> f64; 3] = [|s| s.x_m, |s| s.x_dot_m_s, |s| s.pitch_rad];
    values.into_iter().map(|value| column(&run.samples, value)).collect()
}

/// Speed and torque of the left motor, then of the right one.
fn bench_columns(run: &BenchRun, single: bool) -> Vec<Vec<f64>> {
    let motors = if single { 1 } else { 2 };
    let pairs: [fn(&BenchSample) -> [f64; 2]; 2] = [|s| s.motor_speed_rad_s, |s| s.torque_nm];
    (0..motors)
        .flat_map(|motor| pairs.map(|pair| column(&run.samples, |sample| pair(sample)[motor])))
        .collect()
}

/// Outcome of a run.
#[derive(Debug)]
pub(super) enum End {
    Complete(Box<Recorded>),
    /// The user stopped it.
    Cancelled,
    /// It could not be made; one sentence says why and the remedy.
    Refused(String),
}

/// Makes one run. `watch` gets the share done and may stop it.
pub(super) fn run(
    settings: &Settings,
    variant: Variant,
    model: &Model,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> End {
    let mut cancelled = false;
    let mut watch = |share: f64| {
        let flow = watch(share);
        cancelled |= flow.is_break();
        flow
    };
    let result = simulate::run(&settings.experiment(variant), model, model, &mut watch);
    let complete = |outcome, problem| End::Complete(Box::new(Recorded::new(outcome, problem, model)));
    match result {
        _ if cancelled => End::Cancelled,
        Ok(outcome) => complete(outcome, None),
        Err(ExperimentError::NotFinite { problem, kept }) => complete(*kept, Some(problem.to_string())),
        Err(problem) => End::Refused(problem.to_string()),
    }
}

/// Checks before a run, in sentences, or why there can be none.
pub(super) fn check(settings: &Settings, variant: Variant, model: &Model) -> Result<Vec<String>, String> {
    settings.experiment(variant).check(model, model).map_err(|problem| problem.to_string())
}

/// The command that makes a run again from the file that holds its model.
pub(super) fn command_line(settings: &Settings, variant: Variant, model: Option<&Path>) -> String {
    let model = model.map_or_else(|| "MODEL.toml".to_owned(), |path| quoted(&path.display().to_string()));
    let Settings { scenario, seconds, seed, speed_gains } = settings;
    let gains = speed_gains.map(|SpeedGains { kp, ki }| format!(" --kp {kp} --ki {ki}")).unwrap_or_default();
    format!(
        "flqr simulate {model} --scenario {scenario} --controller {} --seconds {seconds} --seed {seed}{gains}",
        variant.name(*scenario)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_holds_what_differs_from_another_run() {
        let mut settings = Settings { seed: 7, ..Settings::default() };
        assert_eq!(
            command_line(&settings, Variant::Compensated, Some(Path::new("my robot's.toml"))),
            "flqr simulate 'my robot'\\''s.toml' --scenario flat --controller flqr --seconds 60 --seed 7"
        );
        settings.choose(Scenario::SpeedTracking);
        settings.speed_gains = Some(SpeedGains { kp: 0.05, ki: 0.01 });
        assert_eq!(
            command_line(&settings, Variant::Plain, Some(Path::new("a.toml"))),
            "flqr simulate a.toml --scenario speed-tracking --controller pi --seconds 60 --seed 7 --kp 0.05 --ki 0.01"
        );
    }
}
