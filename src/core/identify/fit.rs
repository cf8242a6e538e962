//! The one entry: what the logs hold decides what is fitted.

use std::ops::ControlFlow;

use super::{
    FitError, FitOptions, FitProgress, FitReport, FrictionPair, Motor, PairSet, fit_pairs, pairs_from_log,
};
use crate::model_file::Model;
use crate::record::{HealthFinding, Log, LogKind, Severity, data_health};

/// What a log holds.
enum Content {
    Pairs(PairSet),
    Motion,
}

impl Content {
    fn name(&self) -> &'static str {
        match self {
            Self::Pairs(_) => "constant speeds",
            Self::Motion => "another motion",
        }
    }
}

/// Fits friction, and for motions inertia or mass, to one or more logs of one motor or axis.
///
/// Pairs of several logs are merged. `watch` is called after every iteration and may break off.
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
    let mut pairs: Vec<FrictionPair> = Vec::new();
    let mut health: Vec<HealthFinding> = Vec::new();
    let contents = logs.iter().map(|log| content(log, motor, options)).collect::<Result<Vec<_>, _>>()?;
    let first = contents.first().ok_or(FitError::NoLogs)?;
    for (log, content) in logs.iter().zip(&contents) {
        if content.name() != first.name() {
            return Err(FitError::MixedLogs {
                first: logs[0].source.clone(),
                first_kind: first.name(),
                second: log.source.clone(),
                second_kind: content.name(),
            });
        }
        health.extend(data_health(log));
        if let Content::Pairs(set) = content {
            pairs.extend_from_slice(&set.pairs);
            health.extend(set.warnings.iter().map(|problem| dwell_finding(problem)));
        }
    }
    let source = logs.iter().map(|log| log.source.as_str()).collect::<Vec<_>>().join(", ");
    let mut report = match first {
        Content::Pairs(_) => fit_pairs(&pairs, &source, options, watch)?,
        Content::Motion => unimplemented!("{:?}", model.is_some()),
    };
    report.data_health = health;
    Ok(report)
}

fn content(log: &Log, motor: Motor, options: &FitOptions) -> Result<Content, FitError> {
    let asks_for_motion = options.estimate.iter().any(|name| name == "inertia_kg_m2" || name == "mass_kg");
    let kind = log.kind()?;
    match kind {
        LogKind::FrictionPairs => Ok(Content::Pairs(pairs_from_log(log, motor)?)),
        LogKind::LinearAxis => Ok(Content::Motion),
        LogKind::Bench if asks_for_motion => Ok(Content::Motion),
        LogKind::Bench => {
            Ok(pairs_from_log(log, motor).ok().filter(PairSet::is_constant_speed).map_or(Content::Motion, Content::Pairs))
        }
        LogKind::Robot => pairs_from_log(log, motor)
            .ok()
            .filter(PairSet::is_constant_speed)
            .map(Content::Pairs)
            .ok_or_else(|| FitError::RobotMotion { file: log.source.clone() }),
    }
}

fn dwell_finding(problem: &str) -> HealthFinding {
    HealthFinding {
        severity: Severity::Info,
        column: "motor_speed_rad_s".to_owned(),
        problem: problem.to_owned(),
        mend: "hold each speed longer and steadier".to_owned(),
    }
}
