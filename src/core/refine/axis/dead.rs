//! Columns that stay the same though the axis goes on: sensors that died.

use std::ops::Range;

use crate::record::runs::longest_run;

/// Share of a log for which a column stays the same from which on it may be dead.
const DEAD: f64 = 0.2;
/// Of the width of the effort elsewhere, what it then has while the position stands.
const AS_BEFORE: f64 = 0.8;
/// Of the turning of the speed elsewhere, what it then has while the effort stays, and how many times its range that is at
/// least: a constant torque speeds a shaft up or slows it down, and does no more.
const TURNS_AS_BEFORE: f64 = 0.5;
const TO_AND_FRO: f64 = 2.5;
/// Differences of the position in the part that is looked at.
const DIFFERENCES: usize = 50;

/// Rows in which a position stands still though the effort does there what it does elsewhere.
pub(super) fn position(position: &[f64], effort: &[f64]) -> Option<Range<usize>> {
    let rows = unchanged(position).filter(|_| effort.len() == position.len())?;
    let inside = width(effort[rows.clone()].iter());
    let outside = width(effort[..rows.start].iter().chain(&effort[rows.end..]));
    (inside > AS_BEFORE * outside).then_some(rows)
}

/// Rows in which the effort on a shaft that no load turns stays the same though its speed goes up and down as elsewhere.
pub(super) fn effort(position: &[f64], effort: &[f64]) -> Option<Range<usize>> {
    let rows = unchanged(effort).filter(|_| effort.len() == position.len())?;
    let step = (rows.len() / DIFFERENCES).max(1);
    let speeds = |part: &[f64]| -> Vec<f64> {
        let ends: Vec<f64> = part.iter().step_by(step).copied().collect();
        ends.windows(2).map(|pair| pair[1] - pair[0]).collect()
    };
    let way = |speeds: &[f64]| speeds.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>();
    let inside = speeds(&position[rows.clone()]);
    let outside = way(&speeds(&position[..rows.start])) + way(&speeds(&position[rows.end..]));
    let turned = way(&inside);
    let as_before =
        turned * (position.len() - rows.len()) as f64 > TURNS_AS_BEFORE * outside * rows.len() as f64;
    (as_before && turned > TO_AND_FRO * width(inside.iter())).then_some(rows)
}

/// The longest run of equal values that is a fair part of a column, and not all of it.
fn unchanged(values: &[f64]) -> Option<Range<usize>> {
    let longest = longest_run(values)?;
    (longest.len() as f64 >= DEAD * values.len() as f64 && longest.len() < values.len()).then_some(longest)
}

fn width<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let [low, high] =
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)]);
    high - low
}
