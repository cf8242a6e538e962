//! The one entry: what the logs hold decides what is fitted.

use std::ops::ControlFlow;

use super::motion::{Axis, KnownAxis, MotionError, fit_motion};
use super::{
    Estimate, FitError, FitOptions, FitProgress, FitReport, FrictionPair, Motor, PairSet, StopReason,
    fit_pairs, pairs_from_log,
};
use crate::friction::Stribeck;
use crate::model_file::{AxisModel, Model, Rig};
use crate::record::{HealthFinding, Log, LogKind, Severity, data_health};

/// What a log holds.
enum Content {
    Pairs(PairSet),
    Motion(Axis),
}

impl Content {
    fn name(&self) -> &'static str {
        match self {
            Self::Pairs(_) => "constant speeds",
            Self::Motion(Axis::Rotary) => "a motion of a shaft",
            Self::Motion(Axis::Linear) => "a motion of a carriage",
        }
    }
}

/// Fits friction, and for motions inertia or mass, to one or more logs of one motor or axis.
///
/// Pairs of several logs are merged. `model` gives what a fit from motion holds fixed, and says which axis is meant
/// where a log has the columns of both; without it the columns choose. `motor` picks the side of a robot's log or
/// model. `watch` is called after every iteration and may break off.
///
/// # Errors
/// See [`FitError`].
pub fn fit(
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
        Content::Pairs(_) => fit_pairs(&merged(&contents), &sources(logs), options, watch)?,
        Content::Motion(axis) => motion_report(logs, *axis, model, motor, options, watch)?,
    };
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
    let constant =
        || pairs_from_log(log, motor).map(|set| set.is_constant_speed().then_some(Content::Pairs(set)));
    match kind(log, model)? {
        LogKind::FrictionPairs => Ok(Content::Pairs(pairs_from_log(log, motor)?)),
        LogKind::LinearAxis => Ok(Content::Motion(Axis::Linear)),
        LogKind::Bench if asks_for_motion => Ok(Content::Motion(Axis::Rotary)),
        LogKind::Bench => Ok(constant().ok().flatten().unwrap_or(Content::Motion(Axis::Rotary))),
        LogKind::Robot => {
            constant().ok().flatten().ok_or_else(|| FitError::RobotMotion { file: log.source.clone() })
        }
    }
}

/// The kind of a log; the model's axis decides where the columns serve both axes, and must fit them.
fn kind(log: &Log, model: Option<&Model>) -> Result<LogKind, FitError> {
    let kind = log.kind()?;
    let wanted = match model.map(|model| &model.rig) {
        Some(Rig::Axis(AxisModel::Linear { .. })) => LogKind::LinearAxis,
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
        Content::Motion(_) => Vec::new(),
    };
    contents.iter().flat_map(pairs).collect()
}

fn sources(logs: &[Log]) -> String {
    logs.iter().map(|log| log.source.as_str()).collect::<Vec<_>>().join(", ")
}

fn findings(log: &Log, content: &Content) -> Vec<HealthFinding> {
    let mut findings = data_health(log);
    if let Content::Pairs(set) = content {
        findings.extend(set.warnings.iter().map(|problem| HealthFinding {
            severity: Severity::Info,
            column: "motor_speed_rad_s".to_owned(),
            problem: problem.clone(),
            mend: "hold each speed longer and steadier".to_owned(),
        }));
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
        iterations: 0,
        history: Vec::new(),
        data_health: Vec::new(),
        warnings: found.warnings,
        stop: StopReason::Converged,
    })
}

/// What a model knows of the axis on the bench; of a robot it is one wheel in the air.
fn known_axis(model: &Model, motor: Motor) -> KnownAxis {
    let parameters = |friction: &Option<Stribeck>| friction.as_ref().map(|curve| *curve.parameters());
    match &model.rig {
        Rig::Robot(robot) => KnownAxis {
            inertia: robot.parameters.wheel_inertia_kg_m2,
            friction: parameters(&robot.friction[motor as usize]),
            gravity_torque_nm: 0.0,
        },
        Rig::Axis(AxisModel::Rotary { inertia_kg_m2, gravity_torque_nm, friction }) => KnownAxis {
            inertia: *inertia_kg_m2,
            friction: parameters(friction),
            gravity_torque_nm: *gravity_torque_nm,
        },
        Rig::Axis(AxisModel::Linear { mass_kg, friction }) => {
            KnownAxis { inertia: *mass_kg, friction: parameters(friction), gravity_torque_nm: 0.0 }
        }
    }
}
