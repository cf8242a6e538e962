//! Errors of a model on the held-out rows.

use crate::refine::verdict::{Channels, Errors, Quantity};

use super::floor::Floor;
use super::rig::Declared;
use super::trace::{Part, Rows};

/// Errors of what a model leaves of the measured effort, at the held-out rows.
///
/// `floor` is what noise leaves of it.
pub(super) fn errors(
    declared: &Declared,
    rows: &Rows,
    measured: &[f64],
    left: &[f64],
    floor: &Floor,
) -> Errors {
    let unit = declared.effort_unit();
    let rms = |values: &[f64]| rms(rows, Part::HeldOut, values);
    let channel = |value: f64, unit| Channels(vec![(declared.channel(), Quantity::new(value, unit))]);
    Errors {
        rmse: channel(rms(left), unit),
        noise_floor: channel(floor.variance.sqrt(), unit),
        nrmse: channel(rms(left) / rms(measured), "1"),
        prediction: Vec::new(),
    }
}

/// Root mean square over the rows of a part.
pub(super) fn rms(rows: &Rows, part: Part, values: &[f64]) -> f64 {
    let own = rows.rows.iter().zip(values).filter(|(row, _)| row.part == part);
    let (sum, count) = own.fold((0.0, 0_usize), |(sum, count), (_, v)| (sum + v * v, count + 1));
    (sum / count.max(1) as f64).sqrt()
}
