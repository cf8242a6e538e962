//! The regression: nuisances and chosen effects, judged by left-out blocks.

mod forward;
mod ground;
mod pushes;
mod rivals;
mod screen;
mod selection;
mod shapes;

use std::num::NonZeroUsize;

use nalgebra::DMatrix;

use crate::parallel;
use crate::refine::select::{Blocks, Judged, Member, blocks_of};

pub(super) use screen::Screen;
pub(super) use selection::LEAST_Z;
pub(super) use shapes::FreeShape;

use super::candidates::Candidate;
use super::channels::Channels;
use super::nuisance::Nuisance;
use super::trace::{Pair, Trace};

/// Price of what is fitted without a block that could judge it, in units of the noise.
const BRIEF_PRICE: f64 = 12.0;
/// Share of an effect's power in one block above which the others do not tell of it.
const ONE_BLOCK: f64 = 0.8;
/// Seconds of a block, and fewest and most blocks.
const BLOCK_S: f64 = 5.0;
const BLOCKS: [usize; 2] = [6, 20];

/// The regression and what has been found so far.
pub(super) struct Search<'a> {
    pub(super) trace: &'a Trace<'a>,
    pub(super) channels: &'a Channels,
    pub(super) nuisances: &'a [Nuisance],
    pub(super) library: &'a [Candidate],
    target: Vec<f64>,
    raw_target: &'a Pair,
    block: Vec<usize>,
    pub(super) picks: Vec<Candidate>,
    /// What was tried first, each alone beside the nuisances.
    pub(super) tried: Vec<(Candidate, Fit)>,
    /// Largest gain that clean robots reach by chance, as a multiple of the least that it needs.
    by_chance: &'a (dyn Fn() -> f64 + Sync),
    /// Threads that share the work; the answer does not depend on them.
    pub(super) threads: NonZeroUsize,
}

/// A fit of nuisances and picks.
#[derive(Clone)]
pub(super) struct Fit {
    pub(super) judged: Judged,
    /// Left-out error with the price of the nuisances.
    pub(super) score: f64,
    pub(super) blocks: Blocks,
    pub(super) members: Vec<Member>,
    /// Standard error of each coefficient beyond that of the jackknife.
    pub(super) doubt: Vec<f64>,
}

/// Everything to try, and its columns made white.
pub(super) fn whitened(
    library: &mut [Candidate],
    nuisances: &mut [Nuisance],
    channels: &Channels,
    threads: NonZeroUsize,
) {
    let white = |candidate: &Candidate| candidate.pairs.iter().map(|pair| channels.white(pair)).collect();
    let columns = parallel::map(library, threads, white);
    for (candidate, columns) in library.iter_mut().zip(columns) {
        candidate.white = columns;
    }
    for nuisance in nuisances {
        nuisance.white = channels.white(&nuisance.pair);
    }
}

impl<'a> Search<'a> {
    /// Works on one thread.
    pub(super) fn new(
        trace: &'a Trace<'a>,
        channels: &'a Channels,
        nuisances: &'a [Nuisance],
        library: &'a [Candidate],
        raw_target: &'a Pair,
        by_chance: &'a (dyn Fn() -> f64 + Sync),
    ) -> Self {
        let rows = channels.rows();
        let seconds = rows.len() as f64 * trace.step_s();
        let blocks = ((seconds / BLOCK_S) as usize).clamp(BLOCKS[0], BLOCKS[1]);
        let runs = trace.runs();
        let log = |row: &usize| runs.iter().position(|run| run.rows.contains(row));
        let log_rows: Vec<usize> = rows.chunk_by(|a, b| log(a) == log(b)).map(<[usize]>::len).collect();
        let block = blocks_of(&log_rows, blocks).repeat(2);
        let target = channels.white(raw_target);
        Self {
            trace,
            channels,
            nuisances,
            library,
            target,
            raw_target,
            block,
            picks: Vec::new(),
            tried: Vec::new(),
            by_chance,
            threads: NonZeroUsize::MIN,
        }
    }

    /// White rows in all.
    pub(super) fn rows(&self) -> usize {
        self.target.len()
    }

    pub(super) fn columns<'b>(&'b self, picks: &'b [Candidate]) -> Vec<&'b [f64]> {
        let nuisances = self.nuisances.iter().map(|nuisance| nuisance.white.as_slice());
        nuisances.chain(picks.iter().flat_map(|pick| &pick.white).map(Vec::as_slice)).collect()
    }

    fn members(&self, picks: &[Candidate]) -> Vec<Member> {
        let kinds = || picks.iter().map(|pick| pick.kind);
        let nuisances = self.nuisances.iter().enumerate();
        let mut members: Vec<Member> =
            nuisances.map(|(column, nuisance)| nuisance.member(column, kinds())).collect();
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

    /// A column made white.
    pub(super) fn white(&self, pair: &Pair) -> Vec<f64> {
        self.channels.white(pair)
    }

    /// Picks with the places of their first coefficients.
    pub(super) fn placed<'b>(&self, picks: &'b [Candidate]) -> Vec<(&'b Candidate, usize)> {
        let mut next = self.nuisances.len();
        let place = |pick: &'b Candidate| {
            let first = next;
            next += pick.white.len();
            (pick, first)
        };
        picks.iter().map(place).collect()
    }

    /// Products of white columns and the target.
    pub(super) fn blocks(&self, columns: &[&[f64]]) -> Blocks {
        Blocks::new(columns, &self.target, &self.block)
    }

    /// Fit of the nuisances and these picks.
    pub(super) fn fit(&self, picks: &[Candidate]) -> Option<Fit> {
        let columns = self.columns(picks);
        let blocks = self.blocks(&columns);
        let members = self.members(picks);
        let is_brief = self.brief(picks);
        if !is_brief.contains(&true) {
            let judged = blocks.judge(&members, 1.0)?;
            let score = judged.error() + self.price(&judged.coefficients);
            return Some(Fit { judged, score, blocks, doubt: vec![0.0; members.len()], members });
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
        Some(Fit { judged, score, blocks, doubt: vec![0.0; members.len()], members })
    }

    /// Whether each column is of something that is there for a moment only.
    fn brief(&self, picks: &[Candidate]) -> Vec<bool> {
        let nuisances = self.nuisances.iter().map(|_| false);
        let of_pick = |pick: &Candidate| {
            let is_brief = pick.kind.trial.brief || self.is_momentary(pick);
            std::iter::repeat_n(is_brief, pick.white.len())
        };
        nuisances.chain(picks.iter().flat_map(of_pick)).collect()
    }

    /// Whether this log shows an effect whose size is in its shape, as a limit is, in one block only: no other tells
    /// of it.
    pub(super) fn is_momentary(&self, pick: &Candidate) -> bool {
        if !pick.is_fixed() {
            return false;
        }
        let mut powers = vec![0.0; self.block.last().map_or(0, |last| last + 1)];
        for (value, block) in pick.white.iter().flat_map(|column| column.iter().zip(&self.block)) {
            powers[*block] += value * value;
        }
        let most = powers.iter().copied().fold(0.0, f64::max);
        most > ONE_BLOCK * powers.iter().sum::<f64>()
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
}
