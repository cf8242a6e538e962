//! The one entry: what the logs hold decides what is fitted.

use std::ops::ControlFlow;

use super::motion::{Axis, KnownAxis, MotionError, fit_motion};
use super::parameters::KEYS;
use super::{
    Estimate, FitError, FitOptions, FitProgress, FitReport, FrictionPair, PairSet, StopReason, fit_pairs,
    pairs_from_log,
};
use crate::model::Motor;
use crate::model::{AxisModel, AxisParameters, Model, Rig};
use crate::record::{HealthFinding, Log, LogKind, Severity, data_health};

/// From this many short dwells on a log looks like a staircase.
const FEW_DWELLS: usize = 3;

/// Kind of data of a log.
enum Content {
    Pairs(PairSet),
    /// With why it gave no pairs, where it looks like a recording of constant speeds.
    Motion(Axis, Option<String>),
}

impl Content {
    fn name(&self) -> &'static str {
        match self {
            Self::Pairs(_) => "constant speeds",
            Self::Motion(Axis::Rotary, _) => "a motion of a shaft",
            Self::Motion(Axis::Linear, _) => "a motion of a carriage",
        }
    }

    fn note(&self) -> Option<String> {
        match self {
            Self::Pairs(_) => None,
            Self::Motion(_, note) => note.clone(),
        }
    }
}

/// Returns whether constant speeds give the parameters that are named; a warning where they are not all of them.
fn check_estimate(names: &[String]) -> Result<Option<String>, FitError> {
    let is_known = |name: &str| name == "all" || KEYS.contains(&name);
    if let Some(name) = names.iter().find(|name| !is_known(name)) {
        return Err(FitError::UnknownParameter { name: name.clone(), allowed: KEYS.join(", ") });
    }
    let named = |key: &str| names.iter().any(|name| name == "all" || name == key);
    let partly = !names.is_empty() && !KEYS.into_iter().all(named);
    Ok(partly.then(|| {
        format!(
            "`{}` was requested, but constant speeds give all six parameters only together",
            names.join("`, `")
        )
    }))
}

/// Fits friction, and for motions inertia or mass, to one or more logs of one motor or axis.
///
/// Pairs of several logs are merged. `model` gives what a fit from motion holds fixed, and says which axis is meant
/// where a log has the columns of both; without it the columns choose. `motor` picks the side of a robot's log or
/// model. `watch` is called after every iteration and may break off.
///
/// # Errors
/// See [`FitError`].
///
/// ```
/// use std::ops::ControlFlow;
///
/// use flqr_core::identify::{FitOptions, fit};
/// use flqr_core::model::Motor;
/// use flqr_core::model_file::presets;
/// use flqr_core::simulate::{ControllerChoice, Experiment, Scenario, run};
///
/// let model = presets::paper();
/// let experiment = Experiment { seconds: 60.0, ..Experiment::new(Scenario::FrictionSweep, ControllerChoice::Pi) };
/// let log = run(&experiment, &model, &model, &mut |_| ControlFlow::Continue(()))?.log(Motor::Left);
/// let fit = fit(&[log], None, Motor::Left, &FitOptions::default(), &mut |_| ControlFlow::Continue(()))?;
/// assert!(fit.relative_error < 0.05 && fit.parameters["coulomb_nm"].value > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit(
    logs: &[Log],
    model: Option<&Model>,
    motor: Motor,
    options: &FitOptions,
    watch: &mut dyn FnMut(&FitProgress) -> ControlFlow<()>,
) -> Result<FitReport, FitError> {
    fit_read(logs, model, motor, options, watch).map_err(|error| with_unread(error, logs))
}

/// A refusal for want of data, with what of the logs could not be read.
fn with_unread(refusal: FitError, logs: &[Log]) -> FitError {
    let wants_data = matches!(
        refusal,
        FitError::NoPairs { .. }
            | FitError::OneSpeed { .. }
            | FitError::TooFewSpeeds { .. }
            | FitError::Motion(MotionError::TooShort { .. } | MotionError::NothingExcited { .. })
    );
    let unread: Vec<String> = logs.iter().filter_map(Log::unread).collect();
    if !wants_data || unread.is_empty() {
        return refusal;
    }
    let unread = format!("{}; correct them there, or record the log again", unread.join("; "));
    FitError::Unread { refusal: Box::new(refusal), unread }
}

fn fit_read(
    logs: &[Log],
    model: Option<&Model>,
    motor: Motor,
    options: &FitOptions,
    watch: &mut dyn FnMut(&FitProgress) -> ControlFlow<()>,
) -> Result<FitReport, FitError> {
    let contents =
        logs.iter().map(|log| content(log, model, motor, options)).collect::<Result<Vec<_>, _>>()?;
    let first = contents.first().ok_or(FitError::NoLogs)?;
    if let Some(other) = contents.iter().position(|content| content.name() != first.name()) {
        return Err(FitError::MixedLogs {
            first: logs[0].source.clone(),
            first_kind: first.name(),
            second: logs[other].source.clone(),
            second_kind: contents[other].name(),
        });
    }
    let mut report = match first {
        Content::Pairs(_) => {
            let together = check_estimate(&options.estimate)?;
            let mut report = fit_pairs(&merged(&contents), &sources(logs), options, watch)?;
            report.warnings.extend(together);
            report
        }
        Content::Motion(axis, _) => motion_report(logs, *axis, model, motor, options, watch)?,
    };
    report.warnings.extend(contents.iter().filter_map(Content::note));
    report.data_health =
        logs.iter().zip(&contents).flat_map(|(log, content)| findings(log, content)).collect();
    Ok(report)
}

fn content(
    log: &Log,
    model: Option<&Model>,
    motor: Motor,
    options: &FitOptions,
) -> Result<Content, FitError> {
    let asks_for_motion = options.estimate.iter().any(|name| name == "inertia_kg_m2" || name == "mass_kg");
    match kind(log, model)? {
        LogKind::FrictionPairs => Ok(Content::Pairs(pairs_from_log(log, motor)?)),
        LogKind::LinearAxis => Ok(Content::Motion(Axis::Linear, None)),
        LogKind::Bench if asks_for_motion => Ok(Content::Motion(Axis::Rotary, None)),
        LogKind::Bench => Ok(match pairs_from_log(log, motor) {
            Ok(set) if set.is_constant_speed() => Content::Pairs(set),
            Ok(_) => Content::Motion(Axis::Rotary, None),
            Err(error) => Content::Motion(Axis::Rotary, note_of(log, &error)),
        }),
        LogKind::Robot => {
            let set = pairs_from_log(log, motor).ok().filter(PairSet::is_constant_speed);
            set.map(Content::Pairs).ok_or_else(|| FitError::RobotMotion { file: log.source.clone() })
        }
    }
}

/// Says why a log that was to hold constant speeds, as short dwells or a target speed tell, is fitted as a motion.
fn note_of(log: &Log, error: &FitError) -> Option<String> {
    let FitError::NoPairs { short_dwells, .. } = error else { return None };
    let target = log.column("target_speed_rad_s");
    let has_target = target.is_some_and(|values| values.iter().any(|value| value.is_finite()));
    (has_target || *short_dwells >= FEW_DWELLS)
        .then(|| format!("fitted as a general motion instead: {error}"))
}

/// The kind of a log; the model's axis decides where the columns serve both axes, and must fit them.
fn kind(log: &Log, model: Option<&Model>) -> Result<LogKind, FitError> {
    let kind = log.kind()?;
    let wanted = match model.map(|model| &model.rig) {
        Some(Rig::Axis(AxisModel { parameters: AxisParameters::Linear { .. }, .. })) => LogKind::LinearAxis,
        Some(_) => LogKind::Bench,
        None => return Ok(kind),
    };
    match kind {
        LogKind::Bench | LogKind::LinearAxis if log.serves(wanted) => Ok(wanted),
        LogKind::Bench | LogKind::LinearAxis => {
            Err(FitError::WrongModel { file: log.source.clone(), kind, wanted })
        }
        other => Ok(other),
    }
}

fn merged(contents: &[Content]) -> Vec<FrictionPair> {
    let pairs = |content: &Content| match content {
        Content::Pairs(set) => set.pairs.clone(),
        Content::Motion(..) => Vec::new(),
    };
    contents.iter().flat_map(pairs).collect()
}

fn sources(logs: &[Log]) -> String {
    logs.iter().map(|log| log.source.as_str()).collect::<Vec<_>>().join(", ")
}

fn findings(log: &Log, content: &Content) -> Vec<HealthFinding> {
    let mut findings = data_health(log);
    if let Content::Pairs(set) = content {
        let remedy = "hold each speed longer and more constant";
        let finding = |problem| HealthFinding::new(Severity::Info, "motor_speed_rad_s", problem, remedy);
        findings.extend(set.warnings.iter().map(finding));
    }
    findings
}

fn motion_report(
    logs: &[Log],
    axis: Axis,
    model: Option<&Model>,
    motor: Motor,
    options: &FitOptions,
    watch: &mut dyn FnMut(&FitProgress) -> ControlFlow<()>,
) -> Result<FitReport, FitError> {
    const PARTS: usize = 100;
    let mut iteration = 0;
    let known = model.map(|model| known_axis(model, motor));
    let found = fit_motion(logs, axis, known.as_ref(), &options.estimate, &mut |share| {
        iteration = (share * PARTS as f64) as usize;
        watch(&FitProgress { iteration, iterations: PARTS, best_error: f64::NAN, best: None })
    });
    let found = found.map_err(|error| match error {
        MotionError::Cancelled => FitError::Cancelled { iteration, iterations: PARTS },
        other => FitError::Motion(other),
    })?;
    let estimate = |p: &super::motion::MotionParameter| (p.key, Estimate { value: p.value, ci95: p.ci95 });
    Ok(FitReport {
        parameters: found.parameters.iter().map(estimate).collect(),
        rmse: found.rmse,
        rmse_unit: found.rmse_unit,
        relative_error: found.relative_error,
        pairs: Vec::new(),
        series: Some(found.series),
        iterations: 0,
        history: Vec::new(),
        data_health: Vec::new(),
        warnings: found.warnings,
        stop: StopReason::Converged,
    })
}

/// Model of the axis on the bench; for a robot, one wheel in the air.
fn known_axis(model: &Model, motor: Motor) -> KnownAxis {
    match &model.rig {
        Rig::Robot(robot) => KnownAxis {
            inertia: robot.parameters.wheel_inertia_kg_m2,
            friction: robot.friction[motor as usize].map(|curve| *curve.parameters()),
            gravity_torque_nm: 0.0,
        },
        Rig::Axis(axis) => axis.into(),
    }
}
