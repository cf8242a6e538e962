//! The noise floor of a residual, from its own spectrum.

use std::f64::consts::TAU;

use super::rig::Declared;
use super::trace::{Part, Rows};

/// Rows of a segment, the longest that gives enough of them first.
const SEGMENTS: [usize; 3] = [256, 128, 64];
/// Fewest segments of which a median says something.
const FEWEST: usize = 8;
/// Part of the kernel's band that is looked at, as shares of the cut-off.
const BAND: [f64; 2] = [0.1, 1.0];
/// Share of the cut-off below which noise of the position counts for little.
const SLOW: f64 = 0.15;

/// What noise makes of a residual: that of the position, as it was measured, and a torque that is white.
///
/// The torque's power is the median over the band of the median over the segments, so that neither lines nor single
/// moments count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Floor {
    /// Variance of a row.
    pub(super) variance: f64,
    /// Variance of white noise in the effort, what nobody measures included.
    pub(super) effort: f64,
    /// Whether it comes from the residual, and not from the sensors alone.
    pub(super) measured: bool,
}

impl Floor {
    /// From the rows of a part of the data; where they are too few, what noise of the sensors alone makes.
    pub(super) fn new(declared: &Declared, rows: &Rows, part: Part, left: &[f64]) -> Self {
        let kernel = &rows.kernel;
        let position = rows.position_noise * declared.inertia.powi(2);
        let of_sensors = position * total(|f| kernel.acceleration_noise(f))
            + rows.effort_noise * total(|f| kernel.effort_noise(f));
        let Some(found) = Spectrum::new(rows, part, left) else {
            return Self { variance: of_sensors, effort: rows.effort_noise, measured: false };
        };
        // Power of a bin that noise of 1 gives, at a frequency in cycles per row.
        let bin = |power: f64| 2.0 * power / (found.length * kernel.thinning) as f64;
        let per_sample = |index: usize| index as f64 / (found.length * kernel.thinning) as f64;
        let known = |index: usize| position * bin(kernel.acceleration_noise(per_sample(index)));
        let shape = |index: usize| bin(kernel.effort_noise(per_sample(index)));
        let hz = |index: usize| per_sample(index) / kernel.step_s;
        let band =
            |index: &usize| (BAND[0] * kernel.cutoff_hz..BAND[1] * kernel.cutoff_hz).contains(&hz(*index));
        let last = found.power.len();
        let mut levels: Vec<f64> =
            (1..last).filter(band).map(|index| (found.power[index] - known(index)) / shape(index)).collect();
        let effort = median(&mut levels).unwrap_or(0.0).max(0.0);
        let variance =
            position * total(|f| kernel.acceleration_noise(f)) + effort * total(|f| kernel.effort_noise(f));
        Self { variance, effort, measured: true }
    }
}

/// Frequency, Hz, at which noise of the position makes as much of the residual as everything else: beyond it the
/// information falls with its fourth power. `None` where the rows are too few.
pub(super) fn crossover_hz(declared: &Declared, rows: &Rows, left: &[f64]) -> Option<f64> {
    let kernel = &rows.kernel;
    let found = Spectrum::new(rows, Part::Fit, left)?;
    let per_sample = |index: usize| index as f64 / (found.length * kernel.thinning) as f64;
    let slow = |index: &usize| per_sample(*index) / kernel.step_s < SLOW * kernel.cutoff_hz;
    let bin = 2.0 / (found.length * kernel.thinning) as f64;
    let mut levels: Vec<f64> = (1..found.power.len())
        .filter(slow)
        .map(|index| found.power[index] / (bin * kernel.effort_noise(per_sample(index))))
        .collect();
    let effort = median(&mut levels)?;
    let position = rows.position_noise * declared.inertia.powi(2);
    Some((effort / position).powf(0.25) / TAU)
}

/// Mean of a power over the frequencies up to half the sample rate.
fn total(power: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 2000;
    (0..STEPS).map(|index| power((index as f64 + 0.5) / (2 * STEPS) as f64)).sum::<f64>() / STEPS as f64
}

/// Power over the frequency, in segments of rows without a gap.
struct Spectrum {
    length: usize,
    /// Of each bin, as white noise of the segments' median would have it.
    power: Vec<f64>,
}

impl Spectrum {
    fn new(rows: &Rows, part: Part, left: &[f64]) -> Option<Self> {
        let segments = |length: usize| {
            let mut found: Vec<&[f64]> = Vec::new();
            let mut start = 0;
            for index in 0..rows.rows.len() {
                if !rows.rows[index].follows || rows.rows[index].part != part {
                    start = index;
                }
                if rows.rows[index].part == part && index + 1 - start >= length {
                    found.push(&left[index + 1 - length..=index]);
                    start += length / 2;
                }
            }
            found
        };
        let (length, segments) =
            SEGMENTS.into_iter().map(|length| (length, segments(length))).find(|(_, s)| s.len() >= FEWEST)?;
        let window: Vec<f64> =
            (0..length).map(|i| 0.5 - 0.5 * (TAU * (i as f64 + 0.5) / length as f64).cos()).collect();
        let scale = window.iter().map(|w| w * w).sum::<f64>();
        let turn: Vec<[f64; 2]> = (0..length)
            .map(|i| [(TAU * i as f64 / length as f64).cos(), (TAU * i as f64 / length as f64).sin()])
            .collect();
        let mut powers = vec![Vec::with_capacity(segments.len()); length / 2];
        for segment in segments {
            let shaped: Vec<f64> = segment.iter().zip(&window).map(|(value, w)| value * w).collect();
            for (bin, powers) in powers.iter_mut().enumerate() {
                let (mut re, mut im) = (0.0, 0.0);
                for (i, value) in shaped.iter().enumerate() {
                    let [cos, sin] = turn[bin * i % length];
                    re += value * cos;
                    im += value * sin;
                }
                // One-sided: all bins sum to the variance.
                powers.push(2.0 * (re * re + im * im) / (scale * length as f64));
            }
        }
        let power =
            powers.iter_mut().map(|powers| median(powers).unwrap_or(0.0) / std::f64::consts::LN_2).collect();
        Some(Self { length, power })
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
