//! What a finished search says beside its picks: look-alikes, errors without a pick, and what is left.

use crate::effects::{EffectKind, KINDS};
use crate::refine::select::{Blocks, Member};

use super::super::candidates::Candidate;
use super::super::leftover;
use super::{Fit, Search};

/// Squared cosine above which two effects are not told apart.
const INSEPARABLE: f64 = 0.81;
/// Share of its gain that the other has in its place.
const DOES_AS_WELL: f64 = 0.7;

impl Search<'_> {
    /// Kinds that say the same as a pick on this log.
    pub(in super::super) fn ambiguous_with(&self, pick: usize, fit: &Fit) -> Vec<&'static EffectKind> {
        let own = &self.picks[pick];
        let mut others: Vec<Candidate> =
            self.library.iter().filter(|other| other.kind != own.kind).cloned().collect();
        if own.kind.series() {
            let alike = KINDS.into_iter().filter(|kind| kind.series() && *kind != own.kind);
            let on = alike.filter(|kind| kind.is_on(self.machine.kind));
            others.extend(on.map(|kind| self.candidate(kind, own.shape.clone())));
        }
        let blocks = self.gram(&others, &[]);
        let places = self.places(&others);
        let (picks, others) = places.split_at(self.picks.len());
        let (chosen, first) = picks[pick];
        let signal: Vec<(usize, f64)> =
            (0..chosen.columns.len()).map(|i| (first + i, fit.judged.coefficients[first + i])).collect();
        let rest: Vec<_> = (0..picks.len()).filter(|&i| i != pick).map(|i| picks[i]).collect();
        let mut found: Vec<&'static EffectKind> = Vec::new();
        for &(other, place) in others {
            let with = [rest.as_slice(), &[(chosen, first), (other, place)]].concat();
            let nuisances: Vec<Member> = self
                .members(&with, false)
                .into_iter()
                .filter(|member| {
                    let of_pick = (first..first + chosen.columns.len()).contains(&member.column);
                    let of_other = (place..place + other.columns.len()).contains(&member.column);
                    !of_pick && !of_other
                })
                .collect();
            let columns: Vec<usize> = (place..place + other.columns.len()).collect();
            let overlap = blocks.overlap(&nuisances, fit.noise, &signal, &columns);
            let in_its_place = || {
                let with: Vec<_> = rest.iter().copied().chain([(other, place)]).collect();
                let error = |chosen: &[(&Candidate, usize)]| {
                    let members = self.members(chosen, true);
                    Some(self.judge(&blocks, chosen, &members, fit.noise)?.error())
                };
                let [without, with, own] = [error(&rest)?, error(&with)?, error(picks)?];
                Some((without - with) / (without - own))
            };
            if overlap > INSEPARABLE
                && !found.contains(&other.kind)
                && in_its_place().is_some_and(|share| share > DOES_AS_WELL)
            {
                found.push(other.kind);
            }
        }
        found
    }

    /// What a fit without some picks leaves, at all rows.
    pub(in super::super) fn residual_without(&self, out: &[usize]) -> Option<Vec<f64>> {
        let kept =
            (0..self.picks.len()).filter(|i| !out.contains(i)).map(|i| self.picks[i].clone()).collect();
        let trial = self.with_picks(kept);
        let fit = trial.fit(&[])?;
        Some(trial.residual(&fit.judged.coefficients))
    }

    /// What the residual still depends on.
    pub(in super::super) fn leftover(&self, wanted: &[f64]) -> Option<Vec<leftover::Dependence>> {
        let fit = self.fit(&[])?;
        let mut found = Vec::new();
        let residual = self.whitener.apply(&self.residual(&fit.judged.coefficients));
        // Next to a reversal, friction that sticks depends on everything.
        let count = |&row: &usize| if self.rows.rows[row].reverses { 0.0 } else { 1.0 };
        let mut counts: Vec<f64> = self.whitener.rows().iter().map(count).collect();
        if counts.iter().sum::<f64>() < 0.3 * counts.len() as f64 {
            counts.fill(1.0);
        }
        for (variable, columns) in leftover::groups(self.rows, wanted, self.whitener, &residual) {
            let white: Vec<Vec<f64>> = columns.iter().map(|column| self.whitener.apply(column)).collect();
            let weighted = |column: &[f64]| -> Vec<f64> {
                column.iter().zip(&counts).map(|(value, counts)| value * counts).collect()
            };
            let own: Vec<Vec<f64>> = self.white_columns(&[], &white).into_iter().map(weighted).collect();
            let views: Vec<&[f64]> = own.iter().map(Vec::as_slice).collect();
            let blocks = Blocks::new(&views, &weighted(&self.white.target), &self.white.blocks);
            let last = blocks.target() - 1;
            let kept: Vec<usize> = independent(&blocks, &fit.members, last - white.len()..last, fit.noise);
            let mut members = fit.members.clone();
            let spread =
                |column: usize| 3.0 * (fit.noise * blocks.rows() as f64).sqrt() / blocks.length(column);
            members
                .extend(kept.iter().map(|&column| Member { spread: spread(column), ..Member::free(column) }));
            let base = self.judge(&blocks, &self.places(&[]), &fit.members, fit.noise);
            let with = self.judge(&blocks, &self.places(&[]), &members, fit.noise);
            if let (Some(base), Some(with)) = (base, with) {
                let gain = with.gain_over(&base);
                found.push(leftover::Dependence { variable, gain, z: with.gain_z(&base) });
            }
        }
        found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        Some(found)
    }
}

/// Columns that are not said by the members and the columns before them.
fn independent(
    blocks: &Blocks,
    members: &[Member],
    columns: std::ops::Range<usize>,
    noise: f64,
) -> Vec<usize> {
    let mut kept = Vec::new();
    for column in columns {
        let before: Vec<Member> =
            members.iter().copied().chain(kept.iter().map(|&column| Member::free(column))).collect();
        let power = blocks.power_beyond(&before, noise, &[(column, 1.0)]).unwrap_or(0.0);
        if power > 1e-3 * blocks.length(column).powi(2) {
            kept.push(column);
        }
    }
    kept
}
