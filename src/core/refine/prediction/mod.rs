//! Short predictions: from the log's own states on, the model moves under the recorded torques, and its end is compared
//! with the log's.
//!
//! States of a log are local fits of what its sensors said around a row. Their noise is known from the readings' own
//! scatter; moved on by the model from a state that is off by so much, it gives the part of the error that is no fault of
//! the model's. A robot that balances is unstable: beyond a second that part is all there is.

mod moving;
mod record;
mod start;

use std::num::NonZeroUsize;

use super::verdict::{Prediction, Quantity};
use crate::model::{AxisParameters, Model, Motor, Rig};
use crate::parallel;
use crate::record::Log;

use moving::Moving;
pub(super) use record::moments;
use record::{Record, Scatter};
use start::{Ends, Start, starts_of};

/// Lengths of the predictions, s.
const HORIZONS_S: [f64; 3] = [0.05, 0.2, 1.0];
/// Most starts in all logs together.
const STARTS: usize = 40;

/// Which rows predictions start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    All,
    LastThird,
}

/// Errors of the model's predictions; empty where the logs are too short for any.
pub(super) fn predictions(
    model: &Model,
    logs: &[Log],
    rows: Rows,
    motor: Motor,
    seed: u64,
) -> Vec<Prediction> {
    let robot = model.robot().filter(|_| logs.iter().all(|log| log.column("pitch_rad").is_some()));
    let records: Vec<Record> = logs.iter().filter_map(|log| Record::new(log, robot.is_some())).collect();
    let starts: usize = records.iter().map(|record| record.starts(rows).len()).sum();
    let every = starts.div_ceil(STARTS).max(1);
    let mut runs: Vec<(Moving, Scatter, Start)> = Vec::new();
    for record in &records {
        let scatter = record.scatter();
        let first = Moving::new(model, motor, robot.is_some());
        runs.extend(
            starts_of(record, first, rows, every).into_iter().map(|(moving, start)| (moving, scatter, start)),
        );
    }
    let places: Vec<usize> = (0..runs.len()).collect();
    let threads = NonZeroUsize::new(2).expect("2 is not 0");
    let errors = parallel::map(&places, threads, |&place| {
        let (moving, scatter, start) = &runs[place];
        start.errors(moving, scatter, seed, place as u64)
    });
    let names: &[(&'static str, &'static str)] = match (robot.is_some(), &model.rig) {
        (true, _) => &[("pitch_rad", "rad"), ("x_m", "m"), ("motor_angle_rad", "rad")],
        (false, Rig::Axis(axis)) if matches!(axis.parameters, AxisParameters::Linear { .. }) => {
            &[("position_m", "m")]
        }
        _ => &[("motor_angle_rad", "rad")],
    };
    summed(names, &errors)
}

fn summed(names: &[(&'static str, &'static str)], runs: &[Ends]) -> Vec<Prediction> {
    let finite = |end: &[f64; 3]| end.iter().all(|value| value.is_finite());
    let mut found = Vec::new();
    for (place, (variable, unit)) in names.iter().enumerate() {
        for (horizon, horizon_s) in HORIZONS_S.into_iter().enumerate() {
            let ends: Vec<[f64; 3]> =
                runs.iter().filter_map(|run| run.get(horizon)?.get(place).copied()).filter(finite).collect();
            if ends.is_empty() {
                continue;
            }
            let rms = |n: usize| {
                let sum: f64 = ends.iter().map(|end| end[n] * end[n]).sum();
                Quantity::new((sum / ends.len() as f64).sqrt(), unit)
            };
            let [rmse, motion, noise_floor] = [0, 1, 2].map(rms);
            let informative = noise_floor.value < motion.value;
            found.push(Prediction { variable, horizon_s, rmse, motion, noise_floor, informative });
        }
    }
    found
}

#[cfg(test)]
mod tests;
