//! The paper's data set (section 3.1): at each constant speed the first and the last tenth of the samples are
//! dropped, and the means of eight segments of the rest are eight pairs.
//!
//! Paper: 10K samples for each speed, recorded one by one. Here: any number from 40 on, K = a tenth of them, and a
//! log that runs through many speeds is split by itself ([`super::staircase`]).
//! - Rows without a finite measured speed are left out.
//! - A gap of more than ten sample times and 0.1 s ends a dwell: no segment reaches across it.
//! - Dwells that are too short or whose speed drifts are dropped; a sentence with their time says so.
//! - Standstill gives no pair: friction at standstill has no single value.
//! - The speed of a segment is the slope of the motor angle over time, because the mean of a quantised speed is
//!   biased; where angle and speed disagree (an angle that wraps), it is the mean of the speed column.

use super::staircase::{Recording, split};
use super::{FitError, FrictionPair};
use crate::model::Motor;
use crate::record::{Log, LogKind};

/// Segments of one dwell.
const SEGMENTS: usize = 8;
/// Fraction of the moving time that a log spends at constant speeds, from which on it counts as such a recording.
const CONSTANT_SHARE: f64 = 0.5;

/// A stretch of constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell {
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// Mean speed, rad/s.
    pub speed_rad_s: f64,
}

/// The pairs of one log.
#[derive(Clone, Debug, PartialEq)]
pub struct PairSet {
    /// Eight for each dwell, in the order of time; or the rows of a pairs file.
    pub pairs: Vec<FrictionPair>,
    /// The stretches that they come from; empty for a pairs file.
    pub dwells: Vec<Dwell>,
    /// Time at constant speeds / time in motion, 0 to 1; 1 for a pairs file.
    pub constant_share: f64,
    /// Stretches that were dropped, and why.
    pub warnings: Vec<String>,
}

impl PairSet {
    /// Returns whether the log is a recording of constant speeds rather than of some other motion.
    pub fn is_constant_speed(&self) -> bool {
        !self.pairs.is_empty() && self.constant_share >= CONSTANT_SHARE
    }
}

/// Makes the pairs of one log: of a bench log, of one `motor` of a robot log whose wheels are in the air, or the
/// rows of a pairs file as they are.
///
/// # Errors
/// A log of another kind, or one without a stretch of constant speed.
///
/// ```
/// use flqr_core::identify::pairs_from_log;
/// use flqr_core::model::Motor;
/// use flqr_core::record::Log;
///
/// let columns = [("speed_rad_s", vec![-1.0, 1.0]), ("torque_nm", vec![-0.2, 0.2])];
/// let found = pairs_from_log(&Log::from_columns("pairs.csv", columns), Motor::Left)?;
/// assert_eq!((found.pairs.len(), found.pairs[1].torque_nm), (2, 0.2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn pairs_from_log(log: &Log, motor: Motor) -> Result<PairSet, FitError> {
    let kind = log.kind()?;
    let required = |name: &str| log.required(kind, name);
    let time = match kind {
        LogKind::FrictionPairs => {
            return Ok(pairs_file(required("speed_rad_s")?, required("torque_nm")?));
        }
        _ => required("time_s")?,
    };
    let names = match (kind, motor) {
        (LogKind::Robot, Motor::Left) => ["motor_angle_left_rad", "torque_left_nm", "motor_speed_left_rad_s"],
        (LogKind::Robot, Motor::Right) => {
            ["motor_angle_right_rad", "torque_right_nm", "motor_speed_right_rad_s"]
        }
        _ => ["motor_angle_rad", "torque_nm", "motor_speed_rad_s"],
    };
    let columns = [log.required(LogKind::Bench, names[0])?, log.required(LogKind::Bench, names[1])?];
    let recording =
        Recording::new(time, columns[0], columns[1], log.column(names[2]), log.column("target_speed_rad_s"));
    let (set, short_dwells) = pairs_of(&recording);
    if set.pairs.is_empty() {
        return Err(FitError::NoPairs {
            file: log.source.clone(),
            reason: set.warnings.first().cloned().unwrap_or_else(|| "the speed is never constant".to_owned()),
            short_dwells,
            seconds: super::staircase::LEAST_DWELL_S,
        });
    }
    Ok(set)
}

fn pairs_file(speed: &[f64], torque: &[f64]) -> PairSet {
    let pairs = speed.iter().zip(torque);
    PairSet {
        pairs: pairs.map(|(&speed_rad_s, &torque_nm)| FrictionPair { speed_rad_s, torque_nm }).collect(),
        dwells: Vec::new(),
        constant_share: 1.0,
        warnings: Vec::new(),
    }
}

/// The pairs, and how many dwells are too short for them.
fn pairs_of(recording: &Recording) -> (PairSet, usize) {
    let found = split(recording);
    let mut set = PairSet {
        pairs: Vec::new(),
        dwells: Vec::new(),
        constant_share: found.constant_share,
        warnings: found.warnings,
    };
    for rows in found.dwells {
        let edge = rows.len() / 10;
        let (start, end) = (rows.start + edge, rows.end - edge);
        let count = end - start;
        let cut = |k: usize| start + k * count / SEGMENTS;
        set.pairs.extend((0..SEGMENTS).map(|k| segment_pair(recording, cut(k)..cut(k + 1))));
        set.dwells.push(Dwell {
            start_s: recording.time[rows.start],
            end_s: recording.time[rows.end - 1],
            speed_rad_s: recording.mean_speed(start..end),
        });
    }
    (set, found.short_dwells)
}

fn segment_pair(recording: &Recording, rows: std::ops::Range<usize>) -> FrictionPair {
    let torque = &recording.torque[rows.clone()];
    FrictionPair {
        speed_rad_s: recording.mean_speed(rows),
        torque_nm: torque.iter().sum::<f64>() / torque.len() as f64,
    }
}
