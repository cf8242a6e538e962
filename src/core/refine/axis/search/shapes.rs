//! Shape parameters of what was picked: orders, delays, time constants.

use crate::model::MachineKind;

use super::super::candidates::Candidate;
use super::{Fit, Search};

impl Search<'_> {
    /// Sum of squares that the picks leave with one of them at another shape.
    pub(super) fn left_with(&self, pick: usize, candidate: &Candidate) -> Option<f64> {
        let mut picks: Vec<Candidate> = self.picks.clone();
        picks[pick] = candidate.clone();
        let trial = self.with_picks(picks);
        let blocks = trial.gram(&[], &[]);
        let members = trial.members(&trial.places(&[]), false);
        let noise = trial.noise(&blocks, &members)?;
        let coefficients = blocks.fit(&members, noise)?;
        let share = trial.acting_share(&blocks, &trial.places(&[]), &members, &coefficients);
        Some(blocks.left(&members, &coefficients) / share)
    }

    /// Finds the best continuous shape of a pick by a search with shrinking steps; false where it leaves what the log can
    /// show.
    pub(super) fn sharpen(&mut self, pick: usize) -> bool {
        const SHRINK: [f64; 7] = [1.5, 1.25, 1.12, 1.06, 1.03, 1.01, 1.004];
        let kind = self.picks[pick].kind;
        let Some(mut best) = self.left_with(pick, &self.picks[pick]) else { return false };
        for (index, parameter) in kind.shapes().enumerate() {
            let linear_wave = kind.series() && self.machine.kind == MachineKind::Linear;
            if parameter.whole && !linear_wave {
                continue;
            }
            let [low, high] = parameter.range(self.machine.kind);
            let seen = self.scales.seen(kind, parameter, self.machine.kind);
            let [low, high] = [low.max(seen[0]), high.min(seen[1])];
            for step in SHRINK {
                // A wave's period is known to a fraction of one wave over the travel.
                let step = if linear_wave {
                    1.0 + (step - 1.0) * self.picks[pick].shape[index] / self.scales.travel
                } else {
                    step
                };
                let mut moved = true;
                let mut tries = 0;
                while moved && tries < 6 {
                    (moved, tries) = (false, tries + 1);
                    for factor in [step, 1.0 / step] {
                        let mut shape = self.picks[pick].shape.clone();
                        shape[index] = (shape[index] * factor).clamp(low, high);
                        let trial = self.candidate(kind, shape);
                        if let Some(left) = self.left_with(pick, &trial)
                            && left < best
                        {
                            (best, moved) = (left, true);
                            self.picks[pick] = trial;
                            break;
                        }
                    }
                }
            }
            let found = self.picks[pick].shape[index];
            if !linear_wave && (found <= low || found >= high) {
                return false;
            }
        }
        true
    }

    /// Standard errors of the shape parameters of some picks, by linearisation; none for those that are not looked for.
    pub(in super::super) fn shape_errors(&self, fit: &Fit, picks: &[usize]) -> Vec<Option<f64>> {
        const STEP: f64 = 1e-3;
        let places = self.places(&[]);
        let mut errors = Vec::new();
        for &index in picks {
            let (pick, first) = places[index];
            for (n, parameter) in pick.kind.shapes().enumerate() {
                let linear_wave = pick.kind.series() && self.machine.kind == MachineKind::Linear;
                if parameter.whole && !linear_wave {
                    errors.push(None);
                    continue;
                }
                let effect = |factor: f64| -> Vec<f64> {
                    let mut shape = pick.shape.clone();
                    shape[n] *= factor;
                    let moved = self.candidate(pick.kind, shape);
                    let mut sum = vec![0.0; self.white.target.len()];
                    for (i, column) in moved.white.iter().enumerate() {
                        let amplitude = fit.judged.coefficients[first + i];
                        sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += amplitude * value);
                    }
                    sum
                };
                let step = if linear_wave { STEP * pick.shape[n] / self.scales.travel } else { STEP };
                let (up, down) = (effect(1.0 + step), effect(1.0 - step));
                let slope = 2.0 * step * pick.shape[n];
                let column: Vec<f64> = up.iter().zip(&down).map(|(up, down)| (up - down) / slope).collect();
                let with = self.fit(&[column]);
                errors.push(with.map(|with| with.judged.standard_error(with.members.len() - 1)));
            }
        }
        errors
    }
}
