//! Shapes of candidates, refined.

use crate::effects::{Grid, Parameter, Step};
use crate::model::MachineKind;
use crate::refine::select::Member;

use super::screen::Screen;
use super::{Candidate, Fit, Search};

/// Times that sizes in shapes are moved.
const SETTLING: usize = 3;
/// Times that every parameter is moved.
const ROUNDS: usize = 5;

/// The least value of a shape that a search goes down to: a step below where it begins, two where it begins at one value
/// alone, in the middle. What is finer, a log of a robot does not resolve, and friction next to rest is free anyhow.
fn finest(parameter: &Parameter) -> f64 {
    match (parameter.grid, parameter.step) {
        (Grid::Values([value]), Step::Factor(factor)) if !parameter.sized => value / (factor * factor),
        (Grid::Values(values), Step::Factor(factor)) if !parameter.sized => {
            values.iter().copied().fold(f64::INFINITY, f64::min) / factor
        }
        _ => f64::NEG_INFINITY,
    }
}

/// Times that shapes are moved together, and shares of the way that are tried.
const TOGETHER: usize = 4;
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// A shape parameter as one more coefficient: which of which pick, and what changes with it.
pub(in crate::refine::robot) struct FreeShape {
    pub(in crate::refine::robot) pick: usize,
    pub(in crate::refine::robot) place: usize,
    pub(in crate::refine::robot) column: Vec<f64>,
}

impl Search<'_> {
    /// Every shape parameter that can be refined, but for moments and those that are sizes.
    pub(in crate::refine::robot) fn free_shapes(&self, picks: &[Candidate], fit: &Fit) -> Vec<FreeShape> {
        let height_m = self.trace.machine.parameters.com_height_m;
        let mut found = Vec::new();
        for (pick, (candidate, first)) in self.placed(picks).into_iter().enumerate() {
            if candidate.kind.trial.brief {
                continue;
            }
            let sizes = &fit.judged.coefficients[first..first + candidate.white.len()];
            for (place, step) in candidate.moves(height_m).into_iter().enumerate() {
                let Some(step) = step.filter(|_| !(place == 0 && candidate.is_sized())) else { continue };
                let at = |direction: f64| {
                    let mut shape = candidate.shape.clone();
                    shape[place] = step.half().half().from(shape[place], direction);
                    self.moved(candidate, shape)
                };
                let (Some(up), Some(down)) = (at(1.0), at(-1.0)) else { continue };
                let way = up.shape[place] - down.shape[place];
                let mut column = vec![0.0; self.rows()];
                for ((up, down), size) in up.white.iter().zip(&down.white).zip(sizes) {
                    let rows = column.iter_mut().zip(up.iter().zip(down));
                    rows.for_each(|(sum, (up, down))| *sum += size * (up - down) / way);
                }
                found.push(FreeShape { pick, place, column });
            }
        }
        found
    }

    /// Moves all shapes and sizes together, to where least squares on what changes with them says (Gauss and Newton), as
    /// long as that lowers the error on left-out blocks: one after another they stay on the side of a narrow valley.
    pub(in crate::refine::robot) fn polish(&mut self) {
        for _ in 0..TOGETHER {
            let Some(fit) = self.fit(&self.picks) else { return };
            let free = self.free_shapes(&self.picks, &fit);
            let Some(better) = self.together(&fit, &free) else { return };
            self.picks = better;
        }
    }

    /// Picks whose shapes are moved together and that do better; none where none do.
    fn together(&self, fit: &Fit, free: &[FreeShape]) -> Option<Vec<Candidate>> {
        let first = (!free.is_empty()).then_some(fit.members.len())?;
        let mut columns = self.columns(&self.picks);
        columns.extend(free.iter().map(|shape| shape.column.as_slice()));
        let mut members = fit.members.clone();
        members.extend((0..free.len()).map(|extra| Member::free(first + extra)));
        let found = self.blocks(&columns).fit(&members, 1.0)?;
        SHARES.into_iter().find_map(|share| {
            let mut picks = self.picks.clone();
            for (shape, way) in free.iter().zip(&found[first..]) {
                let mut moved = picks[shape.pick].shape.clone();
                moved[shape.place] += share * way;
                picks[shape.pick] = self.moved(&picks[shape.pick], moved)?;
            }
            (self.fit(&picks)?.score < fit.score).then_some(picks)
        })
    }

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
        if !moved.is_resolved(self.trace.row_s()) {
            return None;
        }
        moved.white = moved.pairs.iter().map(|pair| self.channels.white(pair)).collect();
        Some(moved)
    }
}
