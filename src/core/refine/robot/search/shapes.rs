//! Shapes of candidates, refined.

use crate::effects::{Grid, MachineKind, Parameter, Step};

use super::screen::Screen;
use super::{Candidate, Search};

/// Times that sizes in shapes are moved.
const SETTLING: usize = 3;
/// Times that every parameter is moved.
const ROUNDS: usize = 5;

/// The least value of a shape that a search goes down to: a step below where it begins. What is finer, a log of a robot
/// does not resolve, and friction next to rest is free anyhow.
fn finest(parameter: &Parameter) -> f64 {
    match (parameter.grid, parameter.step) {
        (Grid::Values(values), Step::Factor(factor)) if !parameter.sized => {
            values.iter().copied().fold(f64::INFINITY, f64::min) / factor
        }
        _ => f64::NEG_INFINITY,
    }
}

impl Search<'_> {
    /// Moves the shapes of picks that have their size in them to where their amplitude is 1.
    pub(in crate::refine::robot) fn settle(&mut self) {
        for _ in 0..SETTLING {
            if !self.picks.iter().any(Candidate::is_sized) {
                return;
            }
            let Some(fit) = self.fit(&self.picks) else { return };
            let moved = |(pick, first): (&Candidate, usize)| {
                let mut shape = pick.shape.clone();
                if pick.is_sized() {
                    shape[0] *= fit.judged.coefficients[first];
                }
                self.moved(pick, shape).unwrap_or_else(|| pick.clone())
            };
            self.picks = self.placed(&self.picks).into_iter().map(moved).collect();
        }
    }

    /// Moves shape parameters one after another while the gain rises.
    pub(super) fn refine_shape(&self, screen: &Screen, candidate: &mut Candidate, mut gain: f64) -> f64 {
        let mut moves = candidate.moves(self.trace.machine.parameters.com_height_m);
        for round in 0..ROUNDS {
            for (place, step) in moves.iter().enumerate().filter_map(|(place, step)| Some((place, (*step)?)))
            {
                for direction in [1.0, -1.0] {
                    let mut shape = candidate.shape.clone();
                    shape[place] = step.from(shape[place], direction);
                    let Some(moved) = self.moved(candidate, shape) else { continue };
                    let new = screen.gain(&moved);
                    if new > gain {
                        (gain, *candidate) = (new, moved);
                        break;
                    }
                }
            }
            if round > 0 {
                moves.iter_mut().flatten().for_each(|step| *step = step.half());
            }
        }
        gain
    }

    /// The candidate at another shape, where that is possible.
    pub(in crate::refine::robot) fn moved(
        &self,
        candidate: &Candidate,
        shape: Vec<f64>,
    ) -> Option<Candidate> {
        let possible = candidate.kind.shapes().zip(&shape).all(|(parameter, value)| {
            let [low, high] = parameter.range(MachineKind::Robot);
            (low.max(finest(parameter))..=high).contains(value)
        });
        if !possible {
            return None;
        }
        let mut moved = Candidate::new(self.trace, candidate.kind, candidate.form, shape);
        moved.white = moved.pairs.iter().map(|pair| self.channels.white(pair)).collect();
        Some(moved)
    }
}
