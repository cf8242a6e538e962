//! What a search finds in simulated clean motors: axes of the fitted model that go through the recorded motion, with the
//! log's own noise, rates and quantisation, behind the same chain.
//!
//! The recorded motion, smoothed, is the true one; the effort that it takes is worked out, both are measured anew. So
//! nothing has to be tracked, and the columns of the library stay as they are but for noise that none of them shows.

use crate::friction::Stribeck;
use crate::parallel;
use crate::refine::{largest::exceeded_by, whiten::Whitener};
use crate::signal::filter::derivative;
use crate::simulate::Noise;

use super::candidates::Candidate;
use super::search::{Search, Thresholds};
use super::trace::{Part, Rows, second_difference};

/// Clean motors that are simulated.
const RUNS: u64 = 24;
/// Share of clean motors that the threshold lets through.
const LEVEL: f64 = 0.01;

/// The fitted model and the noise of its log.
pub(super) struct Clean {
    pub(super) inertia: f64,
    pub(super) curve: Option<Stribeck>,
    /// Variance of white noise in the effort, what nobody measures included.
    pub(super) effort_noise: f64,
    pub(super) seed: u64,
}

/// A stretch of the log as the truth of a simulated one.
struct Truth {
    position: Vec<f64>,
    friction: Vec<f64>,
    /// Speed that the chain makes of the position without noise.
    speed: Vec<f64>,
    /// Step of the encoder; 0 where it has none.
    step: f64,
}

/// Thresholds that one clean motor in a hundred would pass.
pub(super) fn thresholds(
    clean: &Clean,
    rows: &Rows,
    whitener: &Whitener,
    search: &Search<'_>,
    candidates: &[Candidate],
) -> Thresholds {
    let friction = |speed: f64| clean.curve.map_or(0.0, |curve| curve.torque_nm(speed));
    let fitted = |trace: usize| rows.rows.iter().any(|row| row.trace == trace && row.part == Part::Fit);
    let truths: Vec<Option<Truth>> = (0..rows.traces.len())
        .map(|index| {
            let trace = fitted(index).then(|| &rows.traces[index])?;
            let position = rows.kernel.apply(&trace.position);
            let speed = derivative(&rows.kernel.apply(&position), trace.step_s);
            let friction = trace.speed.iter().map(|&v| friction(v)).collect();
            Some(Truth { position, friction, speed, step: encoder_step(&trace.position) })
        })
        .collect();
    let gram = search.raw_gram(candidates);
    let runs: Vec<u64> = (0..RUNS).collect();
    let found = parallel::map(&runs, parallel::available(), |run| {
        let mut noise = Noise::new(clean.seed, *run);
        let measured: Vec<Vec<f64>> = rows
            .traces
            .iter()
            .zip(&truths)
            .map(|(trace, truth)| match truth {
                Some(truth) => residual(clean, rows, truth, trace.step_s, &mut noise, friction),
                None => vec![0.0; trace.position.len()],
            })
            .collect();
        let target: Vec<f64> = rows.rows.iter().map(|row| measured[row.trace][row.sample]).collect();
        search.best_of_noise(&gram, candidates, &whitener.apply(&target))
    });
    let largest: Vec<f64> = found.into_iter().flatten().collect();
    Thresholds::default().raised(exceeded_by(&largest, LEVEL, 0.0))
}

/// What the declared chain leaves of a clean motor's effort.
fn residual(
    clean: &Clean,
    rows: &Rows,
    truth: &Truth,
    step_s: f64,
    noise: &mut Noise,
    friction: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let own = (rows.position_noise - truth.step * truth.step / 12.0).max(0.0).sqrt();
    let off: Vec<f64> = truth
        .position
        .iter()
        .map(|&q| {
            let seen = q + noise.normal(own);
            let seen = if truth.step > 0.0 { (seen / truth.step).round() * truth.step } else { seen };
            seen - q
        })
        .collect();
    let speed_off = derivative(&rows.kernel.apply(&off), step_s);
    let acceleration_off = second_difference(&off, step_s);
    let deviation = clean.effort_noise.sqrt();
    let mut before = noise.normal(deviation);
    let left: Vec<f64> = (0..off.len())
        .map(|k| {
            let now = noise.normal(deviation);
            let between = 0.5 * (now + before);
            before = now;
            between - clean.inertia * acceleration_off[k] + truth.friction[k]
                - friction(truth.speed[k] + speed_off[k])
        })
        .collect();
    rows.kernel.apply(&left)
}

/// The step of which all changes are multiples, as far as a log shows one.
fn encoder_step(position: &[f64]) -> f64 {
    let changes = || position.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|change| *change > 0.0);
    let step = changes().fold(f64::INFINITY, f64::min);
    let whole = changes().filter(|change| ((change / step).round() * step - change).abs() < 0.05 * step);
    let (whole, all) = (whole.count(), changes().count());
    // Rounded numbers of a log are off by much less than the steps of an encoder.
    if all > 0 && 10 * whole > 9 * all { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_shows_its_step() {
        let motion = |i: i32| 3.0 * (f64::from(i) * 1e-3).sin();
        let encoder: Vec<f64> = (0..5000).map(|i| (motion(i) / 1e-4).round() * 1e-4).collect();
        assert!((encoder_step(&encoder) - 1e-4).abs() < 1e-9);
        let smooth: Vec<f64> = (0..5000).map(motion).collect();
        assert_eq!(encoder_step(&smooth), 0.0);
    }
}
