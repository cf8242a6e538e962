//! Forward selection of effects: singles, pairs, swaps, shapes, and one backward check.

use std::ops::ControlFlow;

use crate::effects::{EffectKind, Machine, MachineKind};
use crate::refine::error::RefineError;
use crate::refine::select::{Blocks, Judged, Member};
use crate::refine::whiten::Whitener;

use super::candidates::{Candidate, Scales};
use super::leftover;
use super::rig::Nuisance;
use super::trace::{Part, Rows};
use super::waves;

/// Share by which an effect must lower the error on left-out blocks.
const LEAST_GAIN: f64 = 0.006;
/// Standard errors of an effect's size above 0, by the jackknife.
const LEAST_Z: f64 = 5.0;
/// The same at the end, beside all others.
const CERTAIN_Z: f64 = 3.0;
/// Most effects and harmonics that are named.
const MOST: usize = 12;
/// Candidates whose left-out error is worked out, and those that are tried in pairs.
const SHORT_LIST: usize = 24;
const PAIRED: usize = 12;
/// Squared cosine above which two effects are not told apart.
const INSEPARABLE: f64 = 0.81;
/// Share of the best gain from which on a candidate is as good, and which kinds are then named before others.
const AS_GOOD: f64 = 0.97;
const PREFERRED: [&str; 8] = [
    "inertia_error",
    "viscous_error",
    "coulomb_error",
    "cogging",
    "quadratic_drag",
    "viscous_asymmetry",
    "friction_asymmetry",
    "command_delay",
];
/// By which share of itself a declared number may be off.
const OFF_BY: [f64; 2] = [-0.8, 30.0];
/// Largest share of the acceleration's power that is taken for noise.
const MOST_NOISE: f64 = 0.2;
/// Seconds of a block, and fewest and most blocks.
const BLOCK_S: f64 = 5.0;
const BLOCKS: [usize; 2] = [8, 20];

/// The regression and what has been found so far.
pub(super) struct Search<'a> {
    pub(super) rows: &'a Rows,
    pub(super) machine: &'a Machine,
    pub(super) nuisances: &'a [Nuisance],
    pub(super) target: &'a [f64],
    pub(super) scales: Scales,
    /// What was found, in order of evidence.
    pub(super) picks: Vec<Candidate>,
    /// Kinds whose best shape is none that the log could show.
    banned: Vec<&'static EffectKind>,
    whitener: &'a Whitener,
    white: &'a White,
    library: &'a [Candidate],
}

/// What stays the same throughout a search.
pub(super) struct White {
    nuisances: Vec<Vec<f64>>,
    target: Vec<f64>,
    blocks: Vec<usize>,
    measured: Vec<f64>,
    /// Place of the acceleration among the nuisances.
    acceleration: Option<usize>,
    /// Its noise in a row, and the declared inertia.
    noise: f64,
    inertia: f64,
}

/// A fit of the white rows.
pub(super) struct Fit {
    /// Columns of nuisances, then of picks.
    pub(super) members: Vec<Member>,
    pub(super) judged: Judged,
    /// Variance of a white row.
    pub(super) noise: f64,
    pub(super) blocks: Blocks,
}

/// The filter that gives noise of position and effort the same power at every frequency.
pub(super) fn whitener(rows: &Rows, inertia: f64) -> Whitener {
    let (position, effort) = (rows.position_noise * inertia * inertia, rows.effort_noise);
    let kernel = &rows.kernel;
    let power = |frequency: f64| {
        position * kernel.acceleration_noise(frequency) + effort * kernel.effort_noise(frequency)
    };
    let follows: Vec<bool> = rows.rows.iter().map(|row| row.follows).collect();
    Whitener::new(power, kernel.thinning, &follows, |row| rows.rows[row].part == Part::Fit)
}

impl White {
    pub(super) fn new(
        rows: &Rows,
        whitener: &Whitener,
        nuisances: &[Nuisance],
        [measured, target]: [&[f64]; 2],
        inertia: f64,
    ) -> Self {
        let count = whitener.rows().len();
        let row_s = rows.kernel.step_s * rows.kernel.thinning as f64;
        let blocks = ((count as f64 * row_s / BLOCK_S) as usize).clamp(BLOCKS[0], BLOCKS[1]);
        let kernel = &rows.kernel;
        let noise = rows.position_noise
            * whitener.variance(|frequency| kernel.acceleration_noise(frequency), kernel.thinning);
        // Where rows are few, motion itself looks like noise.
        let acceleration = nuisances.iter().position(|nuisance| nuisance.effect == "inertia_error");
        let power = acceleration.map_or(f64::INFINITY, |place| {
            let column = whitener.apply(&nuisances[place].column);
            column.iter().map(|a| a * a).sum::<f64>() / count as f64
        });
        Self {
            nuisances: nuisances.iter().map(|nuisance| whitener.apply(&nuisance.column)).collect(),
            target: whitener.apply(target),
            blocks: (0..count).map(|index| index * blocks / count).collect(),
            measured: whitener.apply(measured),
            acceleration,
            noise: noise.min(MOST_NOISE * power),
            inertia,
        }
    }
}

impl<'a> Search<'a> {
    pub(super) fn new(
        rows: &'a Rows,
        machine: &'a Machine,
        nuisances: &'a [Nuisance],
        target: &'a [f64],
        (whitener, white, library): (&'a Whitener, &'a White, &'a [Candidate]),
    ) -> Self {
        let scales = Scales::new(rows, white.inertia);
        Self {
            rows,
            machine,
            nuisances,
            target,
            scales,
            picks: Vec::new(),
            banned: Vec::new(),
            whitener,
            white,
            library,
        }
    }

    fn candidate(&self, kind: &'static EffectKind, shape: Vec<f64>) -> Candidate {
        Candidate::new(kind, self.machine, self.rows, self.whitener, shape)
    }

    /// What coefficients of nuisances and picks leave, at all rows.
    pub(super) fn residual(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut left = self.target.to_vec();
        for (column, coefficient) in self.columns(&[]).iter().zip(coefficients) {
            left.iter_mut().zip(*column).for_each(|(left, value)| *left -= coefficient * value);
        }
        left
    }

    fn columns<'b>(&'b self, more: &'b [Candidate]) -> Vec<&'b [f64]> {
        let nuisances = self.nuisances.iter().map(|nuisance| nuisance.column.as_slice());
        let picks = self.picks.iter().chain(more).flat_map(|pick| &pick.columns).map(Vec::as_slice);
        nuisances.chain(picks).collect()
    }

    /// Gram matrices of the white columns of nuisances, picks, `more` candidates, columns `beside` them and the measured
    /// effort, which is the last one before the target.
    fn gram(&self, more: &[Candidate], beside: &[Vec<f64>]) -> Blocks {
        let candidates = || self.picks.iter().chain(more);
        let white = candidates().flat_map(|candidate| &candidate.white).chain(beside);
        let white = white.chain([&self.white.measured]);
        let columns: Vec<&[f64]> = self.white.nuisances.iter().chain(white).map(Vec::as_slice).collect();
        let mut blocks = Blocks::new(&columns, &self.white.target, &self.white.blocks);
        // Noise of the position is in the acceleration and in the target, with the declared inertia.
        let mut noisy = vec![(blocks.target(), -self.white.inertia)];
        noisy.extend(self.white.acceleration.map(|place| (place, 1.0)));
        let mut next = self.nuisances.len();
        for candidate in candidates() {
            if candidate.noise != 0.0 {
                noisy.push((next, candidate.noise));
            }
            next += candidate.columns.len();
        }
        for (index, &(a, of_a)) in noisy.iter().enumerate() {
            for &(b, of_b) in &noisy[index.max(1)..] {
                blocks.discount(a, b, of_a * of_b * self.white.noise);
            }
        }
        blocks
    }

    /// Members of nuisances and of candidates, whose first columns are given. A nuisance that an effect says without a
    /// tolerance is left out.
    fn members(&self, chosen: &[(&Candidate, usize)], searched: bool) -> Vec<Member> {
        let said = |nuisance: &Nuisance| chosen.iter().any(|(pick, _)| pick.kind.id == nuisance.effect);
        let nuisances = self.nuisances.iter().enumerate().map(|(column, nuisance)| {
            let member = nuisance.member(column);
            if said(nuisance) { Member { bounds: [0.0, 0.0], spread: 1e-12, ..member } } else { member }
        });
        let picks = chosen.iter().flat_map(|(pick, first)| {
            let mut members = pick.members(*first, self.machine.kind, searched);
            let declared = self.nuisances.iter().find(|nuisance| nuisance.effect == pick.kind.id);
            if let Some(nuisance) =
                declared.filter(|nuisance| nuisance.declared > 0.0 && !nuisance.key.is_empty())
            {
                let [low, high] = OFF_BY.map(|share| share * nuisance.declared);
                if nuisance.effect != "friction_asymmetry" {
                    members.iter_mut().for_each(|member| member.bounds = [low, high]);
                }
            }
            members
        });
        nuisances.chain(picks).collect()
    }

    /// First columns of the picks and of `more`.
    fn places<'b>(&'b self, more: &'b [Candidate]) -> Vec<(&'b Candidate, usize)> {
        let mut next = self.nuisances.len();
        let mut place = |candidate: &'b Candidate| {
            let first = next;
            next += candidate.columns.len();
            (candidate, first)
        };
        self.picks.iter().chain(more).map(&mut place).collect()
    }

    /// Fit of nuisances, picks and free white columns beside them.
    pub(super) fn fit(&self, beside: &[Vec<f64>]) -> Option<Fit> {
        let blocks = self.gram(&[], beside);
        let mut members = self.members(&self.places(&[]), false);
        let last = blocks.target() - 1;
        members.extend((last - beside.len()..last).map(Member::free));
        let noise = self.noise(&blocks, &members)?;
        let judged = self.judge(&blocks, &self.places(&[]), &members, noise)?;
        Some(Fit { members, judged, noise, blocks })
    }

    /// The fit, with its errors by the share of the effort that reaches the axis: an effect that takes the effort away
    /// leaves little to explain, which is no explanation.
    fn judge(
        &self,
        blocks: &Blocks,
        chosen: &[(&Candidate, usize)],
        members: &[Member],
        noise: f64,
    ) -> Option<Judged> {
        let mut judged = blocks.judge(members, noise)?;
        let share = self.acting_share(blocks, chosen, members, &judged.coefficients);
        judged.left /= share;
        judged.held_out.iter_mut().for_each(|error| *error /= share);
        Some(judged)
    }

    /// Power of the effort that acts after all effects between asking and acting, as a share of the measured one.
    fn acting_share(
        &self,
        blocks: &Blocks,
        chosen: &[(&Candidate, usize)],
        members: &[Member],
        coefficients: &[f64],
    ) -> f64 {
        let measured = blocks.target() - 1;
        let mut acting = vec![(measured, 1.0)];
        for (candidate, first) in chosen.iter().filter(|(candidate, _)| candidate.uses_effort()) {
            let own = *first..first + candidate.columns.len();
            let of_own = members.iter().zip(coefficients).filter(|(member, _)| own.contains(&member.column));
            acting.extend(of_own.map(|(member, value)| (member.column, -value)));
        }
        let power = blocks.power_beyond(&[], 0.0, &acting).unwrap_or(0.0);
        (power / blocks.length(measured).powi(2)).clamp(1e-6, 1.0)
    }

    /// Variance of a white row, as the members leave it.
    fn noise(&self, blocks: &Blocks, members: &[Member]) -> Option<f64> {
        let first = blocks.target_power() / blocks.rows() as f64;
        let once = blocks.left(members, &blocks.fit(members, first)?) / blocks.rows() as f64;
        Some(blocks.left(members, &blocks.fit(members, once)?) / blocks.rows() as f64)
    }

    /// Looks for effects until none passes.
    pub(super) fn run(&mut self, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<(), RefineError> {
        while self.picks.len() < MOST && self.step() == Some(true) {
            if watch(0.2 + 0.6 * self.picks.len() as f64 / MOST as f64).is_break() {
                return Err(RefineError::Cancelled);
            }
        }
        self.check_backwards();
        Ok(())
    }

    /// One more effect, or pair; false where none passes.
    fn step(&mut self) -> Option<bool> {
        let now = self.fit(&[])?;
        let residual = self.whitener.apply(&self.residual(&now.judged.coefficients));
        let waves =
            waves::strongest(self.machine, self.rows, &self.scales, self.whitener, &residual, &self.picks);
        let mut candidates: Vec<Candidate> = self.library.to_vec();
        candidates.extend(waves.into_iter().map(|(kind, shape)| self.candidate(kind, shape)));
        candidates.retain(|candidate| !self.has(candidate) && !self.banned.contains(&candidate.kind));
        let blocks = self.gram(&candidates, &[]);
        let places = self.places(&candidates);
        let (picks, more) = places.split_at(self.picks.len());
        let base = self.judge(&blocks, picks, &self.members(picks, true), now.noise)?;
        let mut short: Vec<(f64, usize)> = (0..more.len())
            .filter_map(|index| {
                let chosen = [picks, &[more[index]]].concat();
                let members = self.members(&chosen, true);
                let coefficients = blocks.fit(&members, now.noise)?;
                let share = self.acting_share(&blocks, &chosen, &members, &coefficients);
                Some((blocks.left(&members, &coefficients) / share, index))
            })
            .collect();
        short.sort_by(|a, b| a.0.total_cmp(&b.0));
        let judge = |chosen: &[usize]| -> Option<Judged> {
            let added: Vec<_> = chosen.iter().map(|&index| more[index]).collect();
            let chosen = [picks, &added].concat();
            let members = self.members(&chosen, true);
            let judged = self.judge(&blocks, &chosen, &members, now.noise)?;
            let mut first =
                self.nuisances.len() + picks.iter().map(|(pick, _)| pick.columns.len()).sum::<usize>();
            for (candidate, place) in added {
                let range = first..first + candidate.columns.len();
                first = range.end;
                let lengths: Vec<f64> =
                    (0..candidate.columns.len()).map(|i| blocks.length(place + i)).collect();
                let at_bound = range.clone().any(|i| {
                    let [low, high] = members[i].bounds;
                    judged.coefficients[i] <= low || judged.coefficients[i] >= high
                });
                if at_bound || judged.z(range, &lengths) < LEAST_Z {
                    return None;
                }
            }
            Some(judged)
        };
        let singles: Vec<(Judged, Vec<usize>)> = short
            .iter()
            .take(SHORT_LIST)
            .filter_map(|&(_, index)| Some((judge(&[index])?, vec![index])))
            .filter(|(judged, _)| judged.gain_over(&base) > LEAST_GAIN)
            .collect();
        let most = singles.iter().map(|(judged, _)| judged.gain_over(&base)).fold(0.0, f64::max);
        // Of those that are as good as the best, the one that the library has first.
        let as_good = |found: &&(Judged, Vec<usize>)| found.0.gain_over(&base) > AS_GOOD * most;
        let rank = |found: &(Judged, Vec<usize>)| {
            let kind = more[found.1[0]].0.kind;
            PREFERRED.iter().position(|id| *id == kind.id).unwrap_or(PREFERRED.len())
        };
        let best = singles
            .iter()
            .filter(as_good)
            .min_by(|a, b| rank(a).cmp(&rank(b)).then(a.0.error().total_cmp(&b.0.error())));
        let best = best.cloned();
        let best = best.or_else(|| {
            let list: Vec<usize> = short.iter().take(PAIRED).map(|&(_, index)| index).collect();
            let pairs = list.iter().enumerate().flat_map(|(n, &a)| {
                list[n + 1..].iter().filter(move |&&b| more[a].0.kind != more[b].0.kind).map(move |&b| [a, b])
            });
            pairs
                .filter_map(|pair| Some((judge(&pair)?, pair.to_vec())))
                .min_by(|a, b| a.0.error().total_cmp(&b.0.error()))
                .filter(|(judged, _)| judged.gain_over(&base) > 2.0 * LEAST_GAIN)
        });
        let Some((_, chosen)) = best else { return Some(false) };
        let chosen: Vec<Candidate> = chosen.into_iter().map(|index| more[index].0.clone()).collect();
        drop(places);
        for candidate in chosen {
            let kind = candidate.kind;
            self.picks.push(candidate);
            if !self.sharpen(self.picks.len() - 1) {
                self.picks.pop();
                self.banned.push(kind);
            }
        }
        Some(true)
    }

    fn has(&self, candidate: &Candidate) -> bool {
        self.picks
            .iter()
            .any(|pick| pick.kind == candidate.kind && (!pick.kind.series || pick.shape == candidate.shape))
    }

    /// Sum of squares that the picks leave with one of them at another shape.
    fn left_with(&self, pick: usize, candidate: &Candidate) -> Option<f64> {
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

    fn with_picks(&self, picks: Vec<Candidate>) -> Self {
        Self { picks, banned: Vec::new(), scales: self.scales.clone(), ..*self }
    }

    /// Finds the best continuous shape of a pick by a search with shrinking steps; false where it leaves what the log can
    /// show.
    fn sharpen(&mut self, pick: usize) -> bool {
        const SHRINK: [f64; 7] = [1.5, 1.25, 1.12, 1.06, 1.03, 1.01, 1.004];
        let kind = self.picks[pick].kind;
        let Some(mut best) = self.left_with(pick, &self.picks[pick]) else { return false };
        for (index, parameter) in kind.shapes().enumerate() {
            let linear_wave = kind.series && self.machine.kind == MachineKind::Linear;
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

    /// A pick whose size is no longer certain beside the others.
    fn uncertain(&self, fit: &Fit) -> Option<usize> {
        let mut first = self.nuisances.len();
        self.picks.iter().position(|pick| {
            let own = first..first + pick.columns.len();
            first = own.end;
            let lengths: Vec<f64> = own.clone().map(|column| fit.blocks.length(column)).collect();
            !pick.fixed && fit.judged.z(own, &lengths) < CERTAIN_Z
        })
    }

    /// Takes out what no longer lowers the error on left-out blocks.
    fn check_backwards(&mut self) -> Option<()> {
        loop {
            let all = self.fit(&[])?;
            let blocks = &all.blocks;
            let places = self.places(&[]);
            let weakest = (0..places.len())
                .filter_map(|out| {
                    let others: Vec<_> = (0..places.len()).filter(|&i| i != out).map(|i| places[i]).collect();
                    let judged = self.judge(blocks, &others, &self.members(&others, false), all.noise)?;
                    Some((all.judged.gain_over(&judged), out))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            drop(places);
            let uncertain = self.uncertain(&all).map(|out| (0.0, out));
            match weakest.filter(|(gain, _)| *gain < LEAST_GAIN).or(uncertain) {
                None => return Some(()),
                Some((_, out)) => {
                    self.picks.remove(out);
                }
            }
        }
    }

    /// Kinds that say the same as a pick on this log.
    pub(super) fn ambiguous_with(&self, pick: usize, fit: &Fit) -> Vec<&'static EffectKind> {
        let others: Vec<Candidate> =
            self.library.iter().filter(|other| other.kind != self.picks[pick].kind).cloned().collect();
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
            if overlap > INSEPARABLE && !found.contains(&other.kind) {
                found.push(other.kind);
            }
        }
        found
    }

    /// Standard errors of the shape parameters of some picks, by linearisation; none for those that are not looked for.
    pub(super) fn shape_errors(&self, fit: &Fit, picks: &[usize]) -> Vec<Option<f64>> {
        const STEP: f64 = 1e-3;
        let places = self.places(&[]);
        let mut errors = Vec::new();
        for &index in picks {
            let (pick, first) = places[index];
            for (n, parameter) in pick.kind.shapes().enumerate() {
                let linear_wave = pick.kind.series && self.machine.kind == MachineKind::Linear;
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

    /// Error on the held-out rows of a fit without some picks.
    pub(super) fn error_without(&self, out: &[usize], error: &dyn Fn(&[f64]) -> f64) -> Option<f64> {
        let kept =
            (0..self.picks.len()).filter(|i| !out.contains(i)).map(|i| self.picks[i].clone()).collect();
        let trial = self.with_picks(kept);
        let fit = trial.fit(&[])?;
        Some(error(&trial.residual(&fit.judged.coefficients)))
    }

    /// What the residual still depends on.
    pub(super) fn leftover(&self, wanted: &[f64]) -> Option<Vec<leftover::Dependence>> {
        let fit = self.fit(&[])?;
        let mut found = Vec::new();
        let residual = self.whitener.apply(&self.residual(&fit.judged.coefficients));
        for (variable, columns) in leftover::groups(self.rows, wanted, self.whitener, &residual) {
            let white: Vec<Vec<f64>> = columns.iter().map(|column| self.whitener.apply(column)).collect();
            let blocks = self.gram(&[], &white);
            let last = blocks.target() - 1;
            let kept: Vec<usize> = independent(&blocks, &fit.members, last - white.len()..last, fit.noise);
            let mut members = fit.members.clone();
            let spread =
                |column: usize| 3.0 * (fit.noise * blocks.rows() as f64).sqrt() / blocks.length(column);
            members
                .extend(kept.iter().map(|&column| Member { spread: spread(column), ..Member::free(column) }));
            if let Some(judged) = self.judge(&blocks, &self.places(&[]), &members, fit.noise) {
                let gain = judged.gain_over(&fit.judged);
                found.push(leftover::Dependence { variable, gain, z: judged.gain_z(&fit.judged) });
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
