//! From a log to speed and acceleration on uniform time.

use std::f64::consts::PI;

use crate::record::row_time_s;
use crate::signal::filter::{ZeroPhase, derivative};

/// Highest cut-off of the position filter, Hz: faster than the friction and inertia of an axis are seen in
/// practice, and what the published procedures on 1 kHz data use.
const HIGHEST_CUTOFF_HZ: f64 = 100.0;
/// The position filter's fraction of the acceleration's variance that may be noise; an inertia comes out too low
/// by about that share.
const NOISE_SHARE: f64 = 0.001;

/// A shorter stretch is left out.
const LEAST_ROWS: usize = 4;
/// More samples than this for each row, and the uniform time has the mean step.
const MOST_SAMPLES_PER_ROW: f64 = 4.0;

/// A stretch of a log without gaps, on uniform time.
pub struct Stretch {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Distance of samples, s.
    pub step_s: f64,
    /// Position, rad or m.
    pub position: Vec<f64>,
    /// Torque or force, N m or N.
    pub effort: Vec<f64>,
}

/// Filtering and decimation of the segments of a log.
pub(super) struct Sieve {
    /// Cut-off of the position filter, Hz.
    pub(super) cutoff_hz: f64,
    /// Every how many samples become a row of the regression.
    pub(super) thinning: usize,
    position: ZeroPhase,
    rows: Option<ZeroPhase>,
    /// Fraction of the acceleration's variance that is noise.
    pub(super) noise_share: f64,
}

/// Speed and acceleration of a stretch.
pub(super) struct Kinematics {
    pub(super) speed: Vec<f64>,
    pub(super) acceleration: Vec<f64>,
}

/// Splits a log where it has gaps, and puts each stretch on uniform time: the position by cubics, so
/// that jitter adds no corners to be differentiated, the effort linearly. Rows with a value
/// that is not finite are gaps.
pub fn stretches(time_s: &[f64], position: &[f64], effort: &[f64]) -> Vec<Stretch> {
    let rows: Vec<[f64; 3]> = (0..time_s.len())
        .map(|row| [time_s[row], position[row], effort[row]])
        .filter(|row| row.iter().all(|value| value.is_finite()))
        .collect();
    let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let step_s = row_time_s(&times).unwrap_or(f64::NAN);
    let longest = gap_s(step_s);
    let pieces = || {
        rows.chunk_by(|a, b| (0.0..=longest).contains(&(b[0] - a[0]))).filter(|rows| rows.len() >= LEAST_ROWS)
    };
    let step_s = grid_step_s(step_s, pieces());
    pieces()
        .map(|rows| uniform(rows, step_s))
        .filter(|stretch| stretch.position.len() >= LEAST_ROWS)
        .collect()
}

/// The usual step; the mean one where rows come in bursts, in which the usual step says nothing of their number.
fn grid_step_s<'a>(usual_step_s: f64, pieces: impl Iterator<Item = &'a [[f64; 3]]>) -> f64 {
    let (mut seconds, mut steps) = (0.0, 0);
    for rows in pieces {
        seconds += rows[rows.len() - 1][0] - rows[0][0];
        steps += rows.len() - 1;
    }
    let mean_step_s = seconds / steps.max(1) as f64;
    if mean_step_s > MOST_SAMPLES_PER_ROW * usual_step_s { mean_step_s } else { usual_step_s }
}

/// The longest step that is bridged: what the filters cannot see, at least two lost samples.
fn gap_s(step_s: f64) -> f64 {
    (1.0 / highest_cutoff_hz(step_s)).max(3.5 * step_s)
}

fn highest_cutoff_hz(step_s: f64) -> f64 {
    HIGHEST_CUTOFF_HZ.min(0.25 / step_s)
}

fn uniform(rows: &[[f64; 3]], usual_step_s: f64) -> Stretch {
    let (start, end) = (rows[0][0], rows[rows.len() - 1][0]);
    let mean_step_s = (end - start) / (rows.len() - 1) as f64;
    let on_grid = |(index, row): (usize, &[f64; 3])| {
        (row[0] - start - index as f64 * mean_step_s).abs() < 0.01 * mean_step_s
    };
    let is_usual = (0.5..2.0).contains(&(mean_step_s / usual_step_s));
    if is_usual && rows.iter().enumerate().all(on_grid) {
        let column = |index: usize| rows.iter().map(|row| row[index]).collect();
        return Stretch { start_s: start, step_s: mean_step_s, position: column(1), effort: column(2) };
    }
    let count = ((end - start) / usual_step_s) as usize + 1;
    let (mut position, mut effort) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut left = 0;
    for index in 0..count {
        let time = (start + index as f64 * usual_step_s).min(end);
        while left + 2 < rows.len() && rows[left + 1][0] <= time {
            left += 1;
        }
        let share = (time - rows[left][0]) / (rows[left + 1][0] - rows[left][0]);
        position.push(cubic(rows, left, time));
        effort.push(rows[left][2] + share * (rows[left + 1][2] - rows[left][2]));
    }
    Stretch { start_s: start, step_s: usual_step_s, position, effort }
}

/// Position at a time between rows `left` and `left + 1`: a cubic whose slope at each row is between those of
/// the straight lines next to it (harmonic mean, after Fritsch and Butland), so that jitter that bunches the time
/// stamps makes no overshoot.
fn cubic(rows: &[[f64; 3]], left: usize, time: f64) -> f64 {
    let line = |from: usize| (rows[from + 1][1] - rows[from][1]) / (rows[from + 1][0] - rows[from][0]);
    let slope = |row: usize| match (row.checked_sub(1).map(line), (row + 1 < rows.len()).then(|| line(row))) {
        (Some(before), Some(after)) if before * after > 0.0 => 2.0 * before * after / (before + after),
        (Some(_), Some(_)) => 0.0,
        (before, after) => before.or(after).unwrap_or(0.0),
    };
    let length = rows[left + 1][0] - rows[left][0];
    let share = (time - rows[left][0]) / length;
    let rise = rows[left + 1][1] - rows[left][1];
    let (start, end) = (slope(left) * length - rise, slope(left + 1) * length - rise);
    rows[left][1] + share * rise + share * (1.0 - share) * ((1.0 - share) * start - share * end)
}

impl Sieve {
    /// The highest cut-off at which noise of the position adds at most [`NOISE_SHARE`] to the acceleration's
    /// variance; where none is low enough, the one with the least share.
    pub(super) fn choose(stretches: &[Stretch]) -> Self {
        let step_s = stretches.first().map_or(1.0, |stretch| stretch.step_s);
        let highest = highest_cutoff_hz(step_s);
        let noise = noise_variance(stretches);
        let mut best: Option<Self> = None;
        for divisor in [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0] {
            let mut sieve = Self::new(highest / divisor, step_s);
            sieve.noise_share = sieve.share_of_noise(stretches, noise);
            let better = best.as_ref().is_none_or(|best| sieve.noise_share < best.noise_share);
            if better {
                let enough = sieve.noise_share <= NOISE_SHARE;
                best = Some(sieve);
                if enough {
                    break;
                }
            }
        }
        best.unwrap_or_else(|| Self::new(highest, step_s))
    }

    /// Position: Butterworth of order 4 at the cut-off. Rows: one for each cut-off period; before the others
    /// are left out, every column passes Chebyshev of order 8 with 0.05 dB at 0.8 of the rows' Nyquist
    /// frequency, so that nothing is folded down.
    fn new(cutoff_hz: f64, step_s: f64) -> Self {
        let cutoff = cutoff_hz * step_s;
        let thinning = (1.0 / cutoff).round() as usize;
        let rows = (thinning > 1).then(|| ZeroPhase::chebyshev(8, 0.05, 0.4 / thinning as f64));
        let position = ZeroPhase::butterworth(4, cutoff);
        Self { cutoff_hz, thinning, position, rows, noise_share: 0.0 }
    }

    pub(super) fn kinematics(&self, stretch: &Stretch) -> Kinematics {
        let speed = derivative(&self.position.apply(&stretch.position), stretch.step_s);
        let acceleration = derivative(&speed, stretch.step_s);
        Kinematics { speed, acceleration }
    }

    /// One value for each row: filtered, thinned, without the ends.
    pub(super) fn rows(&self, signal: &[f64], step_s: f64) -> Vec<f64> {
        let filtered = self.rows.as_ref().map(|filter| filter.apply(signal));
        let values = filtered.as_deref().unwrap_or(signal);
        self.row_samples(values.len(), step_s).map(|sample| values[sample]).collect()
    }

    /// The samples that become rows: 20 cut-off periods at each end are left out, but no more than a
    /// twentieth of the stretch.
    pub(super) fn row_samples(&self, samples: usize, step_s: f64) -> impl Iterator<Item = usize> + use<> {
        let dropped = ((20.0 / (self.cutoff_hz * step_s)) as usize).min(samples / 20);
        (dropped..samples - dropped).step_by(self.thinning)
    }

    /// Time that the row filter blurs, in samples.
    pub(super) fn blur(&self) -> usize {
        (2.5 * self.thinning as f64).ceil() as usize
    }

    fn share_of_noise(&self, stretches: &[Stretch], noise_variance: f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for stretch in stretches {
            let rows = self.rows(&self.kinematics(stretch).acceleration, stretch.step_s);
            sum += rows.iter().map(|value| value * value).sum::<f64>();
            count += rows.len();
        }
        let step_s = stretches.first().map_or(1.0, |stretch| stretch.step_s);
        let noise = noise_variance * self.acceleration_noise_gain(step_s);
        let total = sum / count.max(1) as f64;
        if total > 0.0 { noise / total } else { f64::INFINITY }
    }

    /// Three standard deviations of the speed for the noise of the position.
    pub(super) fn speed_noise(&self, stretches: &[Stretch]) -> f64 {
        let step_s = stretches.first().map_or(1.0, |stretch| stretch.step_s);
        let power = |frequency: f64| self.speed_gain(frequency, step_s).powi(2);
        3.0 * (noise_variance(stretches) * mean_over_band(power)).sqrt()
    }

    /// Gain from position to speed.
    fn speed_gain(&self, frequency: f64, step_s: f64) -> f64 {
        (2.0 * PI * frequency).sin() / step_s * self.position.gain(frequency)
    }

    /// Variance of the rows' acceleration for white noise of variance 1 in the position.
    fn acceleration_noise_gain(&self, step_s: f64) -> f64 {
        mean_over_band(|frequency| {
            let rows = self.rows.as_ref().map_or(1.0, |filter| filter.gain(frequency));
            let second = (2.0 * PI * frequency).sin() / step_s;
            (second * self.speed_gain(frequency, step_s) * rows).powi(2)
        })
    }
}

/// Mean over the frequencies from 0 to 0.5 cycles per sample.
fn mean_over_band(value: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 4000;
    let at = |index: usize| value((index as f64 + 0.5) / (2 * STEPS) as f64);
    (0..STEPS).map(at).sum::<f64>() / STEPS as f64
}

/// Variance of white noise in the position, from its fourth differences (variance 70 for white noise of 1),
/// in which a motion that is slow against the sample rate has no part.
fn noise_variance(stretches: &[Stretch]) -> f64 {
    white_noise(stretches.iter().flat_map(|stretch| stretch.position.windows(5)))
}

/// Variance of white noise in windows of five samples of a signal that is slow against them.
pub fn white_noise<'a>(windows: impl Iterator<Item = &'a [f64]>) -> f64 {
    let fourth = |w: &[f64]| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4];
    let (mut sum, mut count) = (0.0, 0_usize);
    for window in windows {
        sum += fourth(window).powi(2);
        count += 1;
    }
    sum / (70.0 * count.max(1) as f64)
}

/// sign(v), 0 at standstill.
pub(crate) fn direction(speed: f64) -> f64 {
    if speed == 0.0 { 0.0 } else { speed.signum() }
}

/// Samples within `reach` of a rest: a stretch of more than `blur` samples below the rest speed. A passage through 0 is
/// none.
pub(crate) fn near_rest(speed: &[f64], rest_speed: f64, blur: usize, reach: usize) -> Vec<bool> {
    let mut near = vec![false; speed.len()];
    let mut start = 0;
    for run in speed.chunk_by(|a, b| (a.abs() < rest_speed) == (b.abs() < rest_speed)) {
        let end = start + run.len();
        if run.len() > blur && run[0].abs() < rest_speed {
            near[start.saturating_sub(reach)..(end + reach).min(speed.len())].fill(true);
        }
        start = end;
    }
    near
}
