//! Moments at which a robot may have been pushed.

use crate::effects::{Form, KINDS};

use super::super::candidates::quantile;
use super::{Candidate, Search};

impl Search<'_> {
    /// Moments at which the robot may have been pushed: windows over which r1 adds up most.
    pub(super) fn pushes(&self, picks: &[Candidate], coefficients: &[f64]) -> Vec<Candidate> {
        let left = self.left_raw(picks, coefficients);
        let step_s = self.trace.step_s();
        let rows = self.channels.rows();
        let noise = quantile(&rows.iter().map(|&row| left[0][row].abs()).collect::<Vec<_>>(), 0.5) / 0.6745;
        let Some(kind) = KINDS.iter().copied().find(|kind| kind.trial.brief) else { return Vec::new() };
        let mut found = Vec::new();
        for seconds in [0.1, 0.2, 0.4] {
            let width = ((seconds / step_s) as usize).max(2);
            let sums: Vec<f64> =
                rows.windows(width).map(|w| w.iter().map(|&row| left[0][row]).sum()).collect();
            let Some((start, sum)) = sums.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            else {
                continue;
            };
            if sum.abs() < 6.0 * noise * (width as f64).sqrt() {
                continue;
            }
            let time_s = self.trace.variable(|m| m.time_s)[rows[start]];
            for height_m in [0.0, self.trace.machine.parameters.com_height_m] {
                let shape = vec![time_s, seconds, height_m];
                let mut candidate = Candidate::new(self.trace, kind, Form::Law, shape);
                candidate.white = candidate.pairs.iter().map(|pair| self.channels.white(pair)).collect();
                found.push(candidate);
            }
        }
        found
    }
}
