//! Waves of the ground, from the spectrum of the residual over the place.

use crate::effects::{Form, KINDS};

use super::super::candidates::WAVES_M;
use super::{Candidate, Search};

/// Wave numbers in one that the travel can tell apart, and most of them.
const FINER: f64 = 4.0;
const MOST: usize = 2000;
/// Strongest waves that are tried.
const TRIED: usize = 3;

impl Search<'_> {
    /// The strongest waves over the place in what picks leave: the longer the travel, the closer to the right one a wave
    /// must be to explain anything.
    pub(super) fn ground_waves(&self, picks: &[Candidate], coefficients: &[f64]) -> Vec<Candidate> {
        let Some(kind) = KINDS.iter().copied().find(|kind| kind.trial.forms.contains(&Form::Wave)) else {
            return Vec::new();
        };
        let left = self.channels.combined(&self.left_raw(picks, coefficients));
        let places_m = self.trace.variable(|m| m.x_m);
        let rows: Vec<[f64; 2]> =
            self.channels.rows().iter().map(|&row| [places_m[row], left[row]]).collect();
        let ends = rows.iter().fold([f64::MAX, f64::MIN], |[low, high], [x, _]| [low.min(*x), high.max(*x)]);
        let [longest, shortest, _] = WAVES_M;
        let step = 1.0 / (FINER * (ends[1] - ends[0]).max(shortest));
        let count = (((1.0 / shortest - 1.0 / longest) / step) as usize).min(MOST);
        let power = |index: usize| {
            let number = 1.0 / longest + step * index as f64;
            let sum = rows.iter().fold([0.0; 2], |[re, im], [x, left]| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * number * x);
                [re + left * cos, im + left * sin]
            });
            (sum[0].powi(2) + sum[1].powi(2), 1.0 / number)
        };
        let powers: Vec<(f64, f64)> = (0..count).map(power).collect();
        let mut peaks: Vec<(f64, f64)> =
            powers.windows(3).filter(|w| w[1].0 > w[0].0 && w[1].0 > w[2].0).map(|w| w[1]).collect();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let candidate = |(_, length): &(f64, f64)| {
            let mut found = Candidate::new(self.trace, kind, Form::Wave, vec![0.0, *length]);
            found.white = found.pairs.iter().map(|pair| self.channels.white(pair)).collect();
            found
        };
        peaks.iter().take(TRIED).map(candidate).collect()
    }
}
