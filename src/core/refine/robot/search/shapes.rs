//! Shapes of candidates, refined.

use crate::effects::MachineKind;

use super::screen::Screen;
use super::{Candidate, Search};

/// Times that every parameter is moved.
const ROUNDS: usize = 5;

impl Search<'_> {
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
            (low..=high).contains(value)
        });
        if !possible {
            return None;
        }
        let mut moved = Candidate::new(self.trace, candidate.kind, candidate.form, shape);
        moved.white = moved.pairs.iter().map(|pair| self.channels.white(pair)).collect();
        Some(moved)
    }
}
