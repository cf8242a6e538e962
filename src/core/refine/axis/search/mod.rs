//! The regression of an axis, with what has been found so far.

mod answer;
mod shapes;
mod steps;

use crate::effects::{EffectKind, Machine};
use crate::refine::select::{Blocks, Judged, Member, blocks_of};
use crate::refine::whiten::Whitener;

use super::candidates::{Candidate, Scales};
use super::nuisance::Nuisance;
use super::trace::{Part, Rows};
pub(super) use steps::{Alone, Thresholds};

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
    /// Free numbers that stay as declared, because the log does not tell them from that.
    pub(super) held: Vec<Held>,
    /// Kinds whose best shape is none that the log could show.
    banned: Vec<&'static EffectKind>,
    /// The best of each kind alone, as the first step saw them.
    pub(super) alone: Vec<Alone>,
    pub(super) thresholds: Thresholds,
    whitener: &'a Whitener,
    white: &'a White,
    library: &'a [Candidate],
}

/// A free number that stays as declared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Place among the nuisances.
    pub(super) nuisance: usize,
    /// 95 % interval of its change, as the log alone has it.
    pub(super) ci95: [f64; 2],
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
#[derive(Clone)]
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
    let mut found =
        Whitener::new(power, kernel.thinning, &follows, |row| rows.rows[row].part != Part::HeldOut);
    found.keep(|row| rows.rows[row].part == Part::Fit);
    found
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
        let log = |row: &usize| rows.traces[rows.rows[*row].trace].log;
        let log_rows: Vec<usize> =
            whitener.rows().chunk_by(|a, b| log(a) == log(b)).map(<[usize]>::len).collect();
        let kernel = &rows.kernel;
        let noise = rows.position_noise
            * whitener.variance(|frequency| kernel.acceleration_noise(frequency), kernel.thinning);
        // Where rows are few, motion itself looks like noise.
        let acceleration = nuisances.iter().position(Nuisance::is_inertia);
        let power = acceleration.map_or(f64::INFINITY, |place| {
            let column = whitener.apply(&nuisances[place].column);
            column.iter().map(|a| a * a).sum::<f64>() / count as f64
        });
        Self {
            nuisances: nuisances.iter().map(|nuisance| whitener.apply(&nuisance.column)).collect(),
            target: whitener.apply(target),
            blocks: blocks_of(&log_rows, blocks),
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
            held: Vec::new(),
            banned: Vec::new(),
            alone: Vec::new(),
            thresholds: Thresholds::default(),
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
        let columns = self.white_columns(more, beside);
        let mut blocks = Blocks::new(&columns, &self.white.target, &self.white.blocks);
        self.discount_noise(&mut blocks, more);
        blocks
    }

    fn white_columns<'b>(&'b self, more: &'b [Candidate], beside: &'b [Vec<f64>]) -> Vec<&'b [f64]> {
        let candidates = self.picks.iter().chain(more).flat_map(|candidate| &candidate.white);
        let white = candidates.chain(beside).chain([&self.white.measured]);
        self.white.nuisances.iter().chain(white).map(Vec::as_slice).collect()
    }

    /// Noise of the position is in the acceleration and in the target, with the declared inertia.
    fn discount_noise(&self, blocks: &mut Blocks, more: &[Candidate]) {
        let mut noisy = vec![(blocks.target(), -self.white.inertia)];
        noisy.extend(self.white.acceleration.map(|place| (place, 1.0)));
        let mut next = self.nuisances.len();
        for candidate in self.picks.iter().chain(more) {
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
    }

    /// As [`Search::gram`] of some candidates, before noise is taken out of it.
    pub(super) fn raw_gram(&self, more: &[Candidate]) -> Blocks {
        Blocks::new(&self.white_columns(more, &[]), &self.white.target, &self.white.blocks)
    }

    /// Members of nuisances and of candidates, whose first columns are given. A nuisance that an effect says without a
    /// tolerance is left out.
    fn members(&self, chosen: &[(&Candidate, usize)], searched: bool) -> Vec<Member> {
        let said = |nuisance: &Nuisance| chosen.iter().any(|(pick, _)| nuisance.says(pick.kind));
        let nuisances = self.nuisances.iter().enumerate().map(|(column, nuisance)| {
            let member = nuisance.member(column);
            let held = self.held.iter().any(|held| held.nuisance == column);
            if held || said(nuisance) {
                Member { bounds: [0.0, 0.0], spread: 1e-12, ..member }
            } else {
                member
            }
        });
        let picks = chosen.iter().flat_map(|(pick, first)| {
            let mut members = pick.members(*first, self.machine.kind, searched);
            let declared = self.nuisances.iter().find(|nuisance| nuisance.says(pick.kind));
            if let Some(nuisance) =
                declared.filter(|nuisance| nuisance.declared > 0.0 && !nuisance.key.is_empty())
            {
                let [low, high] = OFF_BY.map(|share| share * nuisance.declared);
                if !nuisance.is_offset() {
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

    fn with_picks(&self, picks: Vec<Candidate>) -> Self {
        Self {
            picks,
            held: self.held.clone(),
            banned: Vec::new(),
            alone: Vec::new(),
            scales: self.scales.clone(),
            ..*self
        }
    }
}
