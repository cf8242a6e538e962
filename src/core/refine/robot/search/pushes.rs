//! Moments at which a robot may have been pushed.

use crate::effects::{Form, KINDS};

use super::super::candidates::quantile;
use super::selection::LEAST_IMPULSE_S;
use super::{Candidate, Fit, Search};

/// Shortest push that is looked for, s; how many octaves there are above it, and lengths in one.
const SHORTEST_S: f64 = 0.06;
const OCTAVES: i32 = 4;
const LENGTHS: i32 = 4;
/// Sum over a push in units of what noise does in as many rows.
const LEAST_SUM: f64 = 6.0;

/// A run of rows that add up.
struct Window {
    start: usize,
    rows: usize,
    sum: f64,
}

impl Window {
    /// Sum of squares that a constant takes away.
    fn gain(&self) -> f64 {
        self.sum * self.sum / self.rows as f64
    }
}

impl Search<'_> {
    /// Whether r1 about a time adds up to what a push does: sticking that lets go looks like less.
    pub(in crate::refine::robot) fn is_push(&self, at_s: f64, seconds: f64, fit: &Fit) -> bool {
        let left = self.left_raw(&self.picks, &fit.judged.coefficients);
        let times_s = self.trace.variable(|m| m.time_s);
        let near = |row: &&usize| (at_s - seconds..at_s + 2.0 * seconds).contains(&times_s[**row]);
        let impulse: f64 = self.channels.rows().iter().filter(near).map(|&row| left[0][row]).sum();
        impulse.abs() * self.trace.step_s() >= LEAST_IMPULSE_S * self.trace.machine.weight_n()
    }

    /// Moments at which the robot may have been pushed: of each octave of lengths the window in which a constant says
    /// most of r1.
    pub(super) fn pushes(&self, picks: &[Candidate], coefficients: &[f64]) -> Vec<Candidate> {
        if !self.trace.moves() {
            return Vec::new();
        }
        let left = self.left_raw(picks, coefficients);
        let rows = self.channels.rows();
        let own: Vec<f64> = rows.iter().map(|&row| left[0][row]).collect();
        let noise = quantile(&own.iter().map(|value| value.abs()).collect::<Vec<_>>(), 0.5) / 0.6745;
        let Some(kind) = KINDS.iter().copied().find(|kind| kind.trial.brief) else { return Vec::new() };
        let times_s = self.trace.variable(|m| m.time_s);
        let mut found = Vec::new();
        for octave in 0..OCTAVES {
            let lengths = (LENGTHS * octave..LENGTHS * (octave + 1))
                .map(|i| SHORTEST_S * libm::exp2(f64::from(i) / f64::from(LENGTHS)));
            let windows = lengths.filter_map(|seconds| best_window(&own, seconds / self.trace.step_s()));
            let Some(best) = windows.max_by(|a, b| a.gain().total_cmp(&b.gain())) else { continue };
            if best.gain() < (LEAST_SUM * noise).powi(2) {
                continue;
            }
            let seconds = best.rows as f64 * self.trace.step_s();
            for height_m in [0.0, self.trace.machine.parameters.com_height_m] {
                let shape = vec![times_s[rows[best.start]], seconds, height_m];
                let mut candidate = Candidate::new(self.trace, kind, Form::Law, shape);
                candidate.white = candidate.pairs.iter().map(|pair| self.channels.white(pair)).collect();
                found.push(candidate);
            }
        }
        found
    }
}

/// The window of so many rows that adds up most; none where there are fewer.
fn best_window(values: &[f64], rows: f64) -> Option<Window> {
    let rows = (rows.round() as usize).max(2);
    let mut sum: f64 = values.get(..rows)?.iter().sum();
    let mut best = Window { start: 0, rows, sum };
    for start in 1..=values.len() - rows {
        sum += values[start + rows - 1] - values[start - 1];
        if sum.abs() > best.sum.abs() {
            best = Window { start, rows, sum };
        }
    }
    Some(best)
}
