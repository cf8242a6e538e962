//! Forward selection of effects with refined shapes, swaps and a backward check.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::effects::{EffectKind, KINDS};
use crate::refine::error::RefineError;
use crate::refine::select::{Blocks, Judged, Member};

use super::candidates::{Candidate, Step, quantile};
use super::channels::Channels;
use super::nuisance::Nuisance;
use super::trace::{Form, Pair, Trace};

/// Share of the error on left-out blocks that an effect must explain, and the least in units of the noise.
const LEAST_SHARE: f64 = 0.0025;
const LEAST_GAIN: f64 = 22.0;
/// Standard errors above 0 of an effect's size, by the jackknife over blocks.
const LEAST_Z: f64 = 4.0;
/// Least impulse of a push as a share of the weight, s: sticking that lets go looks like a smaller one.
const LEAST_IMPULSE_S: f64 = 0.003;
/// Most effects that are named.
const MOST: usize = 6;
/// Candidates whose shapes are refined and whose left-out error is worked out.
const SHORT_LIST: usize = 14;
const REFINED: usize = 5;
/// By how much a rival may do worse and still not be told apart: in units of the noise, and of the gain.
const NEARLY: f64 = 15.0;
const NEARLY_SHARE: f64 = 0.03;
/// Price of what is fitted without a block that could judge it, in units of the noise.
const BRIEF_PRICE: f64 = 12.0;
/// Seconds of a block, and fewest and most blocks.
const BLOCK_S: f64 = 5.0;
const BLOCKS: [usize; 2] = [6, 20];

/// The regression and what has been found so far.
pub(super) struct Search<'a> {
    pub(super) trace: &'a Trace<'a>,
    pub(super) channels: &'a Channels,
    pub(super) nuisances: &'a [Nuisance],
    library: &'a [Candidate],
    target: Vec<f64>,
    raw_target: &'a Pair,
    block: Vec<usize>,
    pub(super) picks: Vec<Candidate>,
}

/// A fit of nuisances and picks.
pub(super) struct Fit {
    pub(super) judged: Judged,
    /// Left-out error with the price of the nuisances.
    pub(super) score: f64,
    pub(super) blocks: Blocks,
    pub(super) members: Vec<Member>,
}

/// Everything to try, and its columns made white.
pub(super) fn whitened(library: &mut [Candidate], nuisances: &mut [Nuisance], channels: &Channels) {
    for candidate in library {
        candidate.white = candidate.pairs.iter().map(|pair| channels.white(pair)).collect();
    }
    for nuisance in nuisances {
        nuisance.white = channels.white(&nuisance.pair);
    }
}

impl<'a> Search<'a> {
    pub(super) fn new(
        trace: &'a Trace<'a>,
        channels: &'a Channels,
        nuisances: &'a [Nuisance],
        library: &'a [Candidate],
        raw_target: &'a Pair,
    ) -> Self {
        let rows = channels.rows();
        let seconds = rows.len() as f64 * trace.step_s();
        let blocks = ((seconds / BLOCK_S) as usize).clamp(BLOCKS[0], BLOCKS[1]);
        let numbers = (0..rows.len()).map(|index| index * blocks / rows.len().max(1));
        let block: Vec<usize> = numbers.clone().chain(numbers).collect();
        let target = channels.white(raw_target);
        Self { trace, channels, nuisances, library, target, raw_target, block, picks: Vec::new() }
    }

    /// White rows in all.
    pub(super) fn rows(&self) -> usize {
        self.target.len()
    }

    fn columns<'b>(&'b self, picks: &'b [Candidate]) -> Vec<&'b [f64]> {
        let nuisances = self.nuisances.iter().map(|nuisance| nuisance.white.as_slice());
        nuisances.chain(picks.iter().flat_map(|pick| &pick.white).map(Vec::as_slice)).collect()
    }

    fn members(&self, picks: &[Candidate]) -> Vec<Member> {
        let mut members: Vec<Member> =
            self.nuisances.iter().enumerate().map(|(column, nuisance)| nuisance.member(column)).collect();
        for pick in picks {
            for bounds in pick.bounds() {
                members.push(Member { bounds, ..Member::free(members.len()) });
            }
        }
        members
    }

    fn price(&self, coefficients: &[f64]) -> f64 {
        let price = |(nuisance, value): (&Nuisance, &f64)| 3.0 * (value / nuisance.tolerance).powi(2);
        self.nuisances.iter().zip(coefficients).map(price).sum()
    }

    /// Fit of the nuisances and these picks.
    pub(super) fn fit(&self, picks: &[Candidate]) -> Option<Fit> {
        let columns = self.columns(picks);
        let blocks = Blocks::new(&columns, &self.target, &self.block);
        let members = self.members(picks);
        let is_brief = self.brief(picks);
        if !is_brief.contains(&true) {
            let judged = blocks.judge(&members, 1.0)?;
            let score = judged.error() + self.price(&judged.coefficients);
            return Some(Fit { judged, score, blocks, members });
        }
        // No other block tells of what was there for a moment only: it is taken off at its size in all rows.
        let all = blocks.fit(&members, 1.0)?;
        let mut target = self.target.clone();
        for (place, column) in columns.iter().enumerate().filter(|(place, _)| is_brief[*place]) {
            target.iter_mut().zip(*column).for_each(|(left, value)| *left -= all[place] * value);
        }
        let lasting: Vec<usize> = (0..columns.len()).filter(|&place| !is_brief[place]).collect();
        let own: Vec<&[f64]> = lasting.iter().map(|&place| columns[place]).collect();
        let own_members: Vec<Member> =
            lasting.iter().enumerate().map(|(column, &place)| Member { column, ..members[place] }).collect();
        let mut judged = Blocks::new(&own, &target, &self.block).judge(&own_members, 1.0)?;
        let score = judged.error()
            + self.price(&judged.coefficients)
            + BRIEF_PRICE * (columns.len() - own.len()) as f64;
        let mut covariance = DMatrix::zeros(columns.len(), columns.len());
        for (i, &a) in lasting.iter().enumerate() {
            for (j, &b) in lasting.iter().enumerate() {
                covariance[(a, b)] = judged.covariance[(i, j)];
            }
        }
        for place in (0..columns.len()).filter(|&place| is_brief[place]) {
            covariance[(place, place)] = 1.0 / blocks.length(place).powi(2);
        }
        judged.coefficients = all;
        judged.covariance = covariance;
        Some(Fit { judged, score, blocks, members })
    }

    /// Whether each column is of something that is there for a moment only.
    fn brief(&self, picks: &[Candidate]) -> Vec<bool> {
        let nuisances = self.nuisances.iter().map(|_| false);
        nuisances
            .chain(picks.iter().flat_map(|pick| pick.white.iter().map(|_| pick.kind.id == "external_push")))
            .collect()
    }

    /// What coefficients of nuisances and picks leave of the white target.
    pub(super) fn left(&self, picks: &[Candidate], coefficients: &[f64]) -> Vec<f64> {
        let mut left = self.target.clone();
        for (column, coefficient) in self.columns(picks).iter().zip(coefficients) {
            left.iter_mut().zip(*column).for_each(|(left, value)| *left -= coefficient * value);
        }
        left
    }

    /// The same of r1 and r2.
    pub(super) fn left_raw(&self, picks: &[Candidate], coefficients: &[f64]) -> Pair {
        let mut left = self.raw_target.clone();
        let nuisances = self.nuisances.iter().map(|nuisance| &nuisance.pair);
        let pairs = nuisances.chain(picks.iter().flat_map(|pick| &pick.pairs));
        for (pair, coefficient) in pairs.zip(coefficients) {
            for (left, column) in left.iter_mut().zip(pair) {
                left.iter_mut().zip(column).for_each(|(left, value)| *left -= coefficient * value);
            }
        }
        left
    }

    /// Gain below which nothing is named.
    fn least(&self, score: f64) -> f64 {
        LEAST_GAIN.max(LEAST_SHARE * score)
    }

    /// Finds effects until none is worth its name.
    ///
    /// # Errors
    /// The watcher, who is told the share of the work that is done, ended it.
    pub(super) fn run(
        &mut self,
        watch: &mut dyn FnMut(f64) -> Result<(), RefineError>,
    ) -> Result<(), RefineError> {
        let Some(mut now) = self.fit(&[]) else { return Ok(()) };
        while self.picks.len() < MOST {
            watch(self.picks.len() as f64 / MOST as f64)?;
            let Some((pick, fit)) = self.best(&self.picks, &now) else { break };
            let mut picks = self.picks.clone();
            picks.push(pick);
            if !self.is_worth(&picks, &now, &fit) {
                break;
            }
            self.picks = picks;
            now = fit;
            self.swap(&mut now);
        }
        Ok(())
    }

    /// Whether the last pick is.
    fn is_worth(&self, picks: &[Candidate], before: &Fit, with: &Fit) -> bool {
        let Some(last) = picks.last() else { return false };
        let first = with.members.len() - last.white.len();
        let lengths: Vec<f64> =
            (first..with.members.len()).map(|column| with.blocks.length(column)).collect();
        if last.kind.id == "external_push" {
            let impulse = with.judged.coefficients[first].abs() * last.shape[1];
            if impulse < LEAST_IMPULSE_S * self.trace.machine.weight_n() {
                return false;
            }
        }
        let z = with.judged.z(first..with.members.len(), &lengths);
        before.score - with.score > last.caution() * self.least(before.score)
            && (z > LEAST_Z || last.kind.id == "external_push")
    }

    /// Replaces picks where another does better, and drops those that others have made needless.
    fn swap(&mut self, now: &mut Fit) {
        for _ in 0..2 {
            let mut changed = false;
            let mut place = 0;
            while place < self.picks.len() && self.picks.len() > 1 {
                let mut others = self.picks.clone();
                let removed = others.remove(place);
                let Some(without) = self.fit(&others) else { return };
                if without.score - now.score < self.least(now.score) {
                    self.picks = others;
                    *now = without;
                    changed = true;
                    continue;
                }
                if let Some((pick, fit)) = self.best(&others, &without)
                    && fit.score < now.score - 0.5 * self.least(now.score)
                    && (pick.kind != removed.kind || pick.shape != removed.shape)
                {
                    others.insert(place, pick);
                    if let Some(fit) = self.fit(&others) {
                        self.picks = others;
                        *now = fit;
                        changed = true;
                    }
                }
                place += 1;
            }
            if !changed {
                return;
            }
        }
    }

    /// The candidate that lowers the score most, its shape refined.
    fn best(&self, picks: &[Candidate], now: &Fit) -> Option<(Candidate, Fit)> {
        let screen = Screen::new(self, picks)?;
        let mut ranked: Vec<(f64, Candidate)> = Vec::new();
        let pushes = self.pushes(picks, &now.judged.coefficients);
        let wanted = |candidate: &&Candidate| {
            candidate.repeats()
                && !picks.iter().any(|pick| pick.kind == candidate.kind && pick.shape == candidate.shape)
                || picks.iter().all(|pick| pick.kind != candidate.kind)
        };
        let mut gains: Vec<(f64, &Candidate)> = self
            .library
            .iter()
            .chain(&pushes)
            .filter(wanted)
            .map(|candidate| (screen.gain(candidate), candidate))
            .filter(|(gain, _)| *gain > 10.0)
            .collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut seen: Vec<(&str, Form)> = Vec::new();
        for (gain, candidate) in gains {
            let of_kind = seen.iter().filter(|other| **other == (candidate.kind.id, candidate.form)).count();
            if of_kind >= if candidate.steps.iter().all(|step| *step == Step::Fixed) { 3 } else { 1 } {
                continue;
            }
            seen.push((candidate.kind.id, candidate.form));
            ranked.push((gain, candidate.clone()));
            if ranked.len() >= SHORT_LIST {
                break;
            }
        }
        let leader = ranked.first()?.0;
        let mut refined = 0;
        for (gain, candidate) in &mut ranked {
            if refined < REFINED
                && *gain > 0.3 * leader
                && candidate.steps.iter().any(|step| *step != Step::Fixed)
            {
                refined += 1;
                *gain = self.refine_shape(&screen, candidate, *gain);
            }
        }
        let mut best: Option<(f64, Candidate, Fit)> = None;
        for (_, candidate) in ranked {
            let mut tried = picks.to_vec();
            tried.push(candidate);
            let Some(fit) = self.fit(&tried) else { continue };
            let candidate = tried.pop()?;
            // Where others do as well, what needs less is preferred.
            let handicap = 3.0 * candidate.shape.len() as f64 + 10.0 * (candidate.caution() - 1.0);
            if best.as_ref().is_none_or(|(score, ..)| fit.score + handicap < *score) {
                best = Some((fit.score + handicap, candidate, fit));
            }
        }
        best.map(|(_, candidate, fit)| (candidate, fit))
    }

    /// Moves shape parameters one after another while the gain rises.
    fn refine_shape(&self, screen: &Screen, candidate: &mut Candidate, mut gain: f64) -> f64 {
        let mut steps = candidate.steps.clone();
        for round in 0..5 {
            for place in 0..steps.len() {
                for direction in [1.0, -1.0] {
                    let mut shape = candidate.shape.clone();
                    match steps[place] {
                        Step::Fixed => continue,
                        Step::Factor(factor) => shape[place] *= libm::pow(factor, direction),
                        Step::Sum(sum) => shape[place] += direction * sum,
                    }
                    let Some(moved) = self.moved(candidate, shape) else { continue };
                    let new = screen.gain(&moved);
                    if new > gain {
                        (gain, *candidate) = (new, moved);
                        break;
                    }
                }
            }
            if round > 0 {
                for step in &mut steps {
                    *step = match *step {
                        Step::Factor(factor) => Step::Factor(factor.sqrt()),
                        Step::Sum(sum) => Step::Sum(0.5 * sum),
                        Step::Fixed => Step::Fixed,
                    };
                }
            }
        }
        gain
    }

    /// The candidate at another shape, where that is possible.
    pub(super) fn moved(&self, candidate: &Candidate, shape: Vec<f64>) -> Option<Candidate> {
        let possible = candidate.kind.shapes().zip(&shape).all(|(parameter, value)| {
            let [low, high] = parameter.range(crate::effects::MachineKind::Robot);
            (low..=high).contains(value)
        });
        if !possible {
            return None;
        }
        let mut moved =
            Candidate::new(self.trace, candidate.kind, candidate.form, shape, candidate.steps.clone());
        moved.white = moved.pairs.iter().map(|pair| self.channels.white(pair)).collect();
        Some(moved)
    }

    /// Kinds that do nearly as well as a pick beside the others.
    pub(super) fn rivals(
        &self,
        pick: &Candidate,
        others: &[Candidate],
        score: f64,
        gain: f64,
    ) -> Vec<&'static EffectKind> {
        let Some(screen) = Screen::new(self, others) else { return Vec::new() };
        let mut gains: Vec<(f64, &Candidate)> = self
            .library
            .iter()
            .filter(|candidate| {
                candidate.kind != pick.kind && others.iter().all(|other| other.kind != candidate.kind)
            })
            .map(|candidate| (screen.gain(candidate), candidate))
            .filter(|(rival, _)| *rival > 0.6 * gain)
            .collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut found: Vec<&'static EffectKind> = Vec::new();
        let mut seen: Vec<&'static EffectKind> = Vec::new();
        for (rival, candidate) in gains {
            if seen.contains(&candidate.kind) {
                continue;
            }
            seen.push(candidate.kind);
            let mut candidate = candidate.clone();
            if candidate.steps.iter().any(|step| *step != Step::Fixed) {
                self.refine_shape(&screen, &mut candidate, rival);
            }
            let mut tried = others.to_vec();
            tried.push(candidate);
            let kind = tried[tried.len() - 1].kind;
            if self.fit(&tried).is_some_and(|fit| fit.score < score + NEARLY + NEARLY_SHARE * gain) {
                found.push(kind);
            }
        }
        found
    }

    /// Moments at which the robot may have been pushed: windows over which r1 adds up most.
    fn pushes(&self, picks: &[Candidate], coefficients: &[f64]) -> Vec<Candidate> {
        let left = self.left_raw(picks, coefficients);
        let step_s = self.trace.step_s();
        let rows = self.channels.rows();
        let noise = quantile(&rows.iter().map(|&row| left[0][row].abs()).collect::<Vec<_>>(), 0.5) / 0.6745;
        let kind =
            KINDS.iter().copied().find(|kind| kind.id == "external_push").expect("the library has pushes");
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
                let steps = vec![Step::Sum(0.04), Step::Factor(1.25), Step::Fixed];
                let shape = vec![time_s, seconds, height_m];
                let mut candidate = Candidate::new(self.trace, kind, Form::Law, shape, steps);
                candidate.white = candidate.pairs.iter().map(|pair| self.channels.white(pair)).collect();
                found.push(candidate);
            }
        }
        found
    }
}

/// What single candidates would gain beside nuisances and picks.
struct Screen<'a> {
    active: Vec<&'a [f64]>,
    factors: Cholesky<f64, nalgebra::Dyn>,
    left: Vec<f64>,
}

impl<'a> Screen<'a> {
    fn new(search: &'a Search<'_>, picks: &'a [Candidate]) -> Option<Self> {
        let active = search.columns(picks);
        let members = search.members(picks);
        let mut gram = DMatrix::from_fn(active.len(), active.len(), |i, j| {
            if j <= i { dot(active[i], active[j]) } else { 0.0 }
        });
        for j in 0..active.len() {
            for i in 0..j {
                gram[(i, j)] = gram[(j, i)];
            }
            gram[(j, j)] = gram[(j, j)] * (1.0 + 1e-9) + 1.0 / members[j].spread.powi(2);
        }
        let factors = gram.cholesky()?;
        let right =
            DVector::from_iterator(active.len(), active.iter().map(|column| dot(column, &search.target)));
        let coefficients = factors.solve(&right);
        let mut left = search.target.clone();
        for (column, coefficient) in active.iter().zip(&coefficients) {
            left.iter_mut().zip(*column).for_each(|(left, value)| *left -= coefficient * value);
        }
        Some(Self { active, factors, left })
    }

    /// Sum of squares that a candidate would take away; 0 where its size would be impossible.
    fn gain(&self, candidate: &Candidate) -> f64 {
        let size = candidate.white.len();
        let with: Vec<DVector<f64>> = candidate
            .white
            .iter()
            .map(|column| {
                DVector::from_iterator(self.active.len(), self.active.iter().map(|other| dot(other, column)))
            })
            .collect();
        let solved: Vec<DVector<f64>> = with.iter().map(|with| self.factors.solve(with)).collect();
        let own = DMatrix::from_fn(size, size, |i, j| {
            let direct = dot(&candidate.white[i], &candidate.white[j]);
            let ridge = if i == j { 1e-9 * direct } else { 0.0 };
            direct - with[i].dot(&solved[j]) + ridge
        });
        // With priors in the factors the left residual is not orthogonal to the nuisances; its gradient is what counts.
        let right =
            DVector::from_iterator(size, candidate.white.iter().map(|column| dot(column, &self.left)));
        let Some(factors) = own.cholesky() else { return 0.0 };
        let values = factors.solve(&right);
        let bounds = candidate.bounds();
        let fixed = candidate.is_fixed();
        // A fixed one is screened loosely, its shape is refined later.
        let possible = values.iter().zip(&bounds).all(|(value, [low, high])| {
            let (low, high) = if fixed { (0.3 * low, 3.0 * high) } else { (*low, *high) };
            (low..=high).contains(value)
        });
        if !possible {
            return 0.0;
        }
        if !fixed {
            return right.dot(&values);
        }
        let value = values[0].clamp(bounds[0][0], bounds[0][1]);
        2.0 * value * right[0] - value * value / values[0] * right[0]
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let cut = a.len() / 8 * 8;
    for (a, b) in a[..cut].chunks_exact(8).zip(b[..cut].chunks_exact(8)) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + a[cut..].iter().zip(&b[cut..]).map(|(a, b)| a * b).sum::<f64>()
}
