//! Forward selection of effects: singles, pairs, and checks backward and on held-out rows.

use crate::effects::{EffectKind, KINDS, PREFERRED};
use crate::refine::{
    Watch,
    error::RefineError,
    gain::Gain,
    report,
    select::{Blocks, Judged, Member},
};
use crate::signal::quantile::student_t_975;

use super::super::candidates::Candidate;
use super::super::nuisance::Nuisance;
use super::super::waves;
use super::{Fit, Held, Search};

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
/// Share of the best gain from which on a candidate is as good.
const AS_GOOD: f64 = 0.97;
/// Half of the interval of a free number, as a share of it, above which the log hardly tells it.
const VAGUE: f64 = 0.25;
/// Share of a candidate's power that the declared numbers must leave for it to be testable.
const OWN_POWER: f64 = 0.05;

/// What an effect must pass to be named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Thresholds {
    /// Share by which it lowers the error on left-out blocks.
    pub(in super::super) gain: f64,
    /// Standard errors of its size above 0.
    pub(in super::super) z: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { gain: LEAST_GAIN, z: LEAST_Z }
    }
}

impl Thresholds {
    /// With a gain of at least `gain`.
    pub(in super::super) fn raised(self, gain: f64) -> Self {
        Self { gain: self.gain.max(gain), ..self }
    }
}

/// A kind's best candidate, alone beside the declared model.
#[derive(Clone, Debug)]
pub(in super::super) struct Alone {
    pub(in super::super) kind: &'static EffectKind,
    pub(in super::super) shape: Vec<f64>,
    pub(in super::super) gain: f64,
    pub(in super::super) z: f64,
    /// Whether the declared numbers cannot say nearly all of it.
    pub(in super::super) testable: bool,
}

/// Candidates added to the picks, and how they do.
#[derive(Clone)]
struct ScoredCandidate {
    chosen: Vec<usize>,
    judged: Judged,
    /// Of the added one that is least sure.
    z: f64,
    at_bound: bool,
}

/// Everything that one step looks at.
struct Round<'b> {
    blocks: &'b Blocks,
    picks: &'b [(&'b Candidate, usize)],
    more: &'b [(&'b Candidate, usize)],
    noise: f64,
}

impl Search<'_> {
    /// Looks for effects until none passes.
    pub(in super::super) fn run(&mut self, watch: Watch<'_>) -> Result<(), RefineError> {
        while self.picks.len() < MOST && self.step() == Some(true) {
            report(watch, 0.2 + 0.6 * self.picks.len() as f64 / MOST as f64)?;
        }
        self.name_series_alike();
        self.check_backwards();
        Ok(())
    }

    /// Gives all harmonics the name of one kind where that explains as much as several, or more than the one that they
    /// have: effects of one place are rarely several, and each harmonic alone hardly tells the kinds apart.
    fn name_series_alike(&mut self) -> Option<()> {
        let is_series = |pick: &&Candidate| pick.kind.series();
        if self.picks.iter().filter(is_series).count() < 2 {
            return Some(());
        }
        let error = |search: &Self| Some(search.fit(&[])?.judged.error());
        let now = error(self)?;
        let is_open = |kind: &&'static EffectKind| {
            let on = kind.series() && kind.is_on(self.machine.kind) && !self.banned.contains(kind);
            on && (self.rows.both_ways() || !kind.harmonics_oppose())
        };
        let named = |kind: &'static EffectKind| {
            let is_own = |pick: &Candidate| pick.kind == kind;
            let mut picks: Vec<Candidate> = Vec::new();
            for pick in &self.picks {
                if !pick.kind.series() || is_own(pick) {
                    picks.push(pick.clone());
                } else if !self.picks.iter().any(|own| is_own(own) && own.shape == pick.shape) {
                    picks.push(self.candidate(kind, pick.shape.clone()));
                }
            }
            let is_new = !self.picks.iter().any(is_own);
            let most = if is_new { now * (1.0 - LEAST_GAIN) } else { now * (1.0 + LEAST_GAIN) };
            Some((error(&self.with_picks(picks.clone()))?, picks)).filter(|(error, _)| *error < most)
        };
        let best = KINDS.into_iter().filter(is_open).filter_map(named).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, picks)) = best {
            self.picks = picks;
        }
        Some(())
    }

    /// Leaves out kinds.
    pub(in super::super) fn ban(&mut self, kinds: &[&'static EffectKind]) {
        self.banned.extend(kinds);
    }

    /// The harmonics that the residual has most of, as candidates.
    pub(in super::super) fn harmonics(&self) -> Option<Vec<Candidate>> {
        let now = self.fit(&[])?;
        let residual = self.whitener.apply(&self.residual(&now.judged.coefficients));
        let waves =
            waves::strongest(self.machine, self.rows, &self.scales, self.whitener, &residual, &self.picks);
        // One way, friction that depends on the angle and a torque that does so are the same.
        let waves = waves.into_iter().filter(|(kind, _)| self.rows.both_ways() || !kind.harmonics_oppose());
        Some(waves.map(|(kind, shape)| self.candidate(kind, shape)).collect())
    }

    /// One more effect, or pair; false where none passes.
    fn step(&mut self) -> Option<bool> {
        let now = self.fit(&[])?;
        let mut candidates: Vec<Candidate> = self.library.to_vec();
        candidates.extend(self.harmonics()?);
        candidates.retain(|candidate| !self.has(candidate) && !self.banned.contains(&candidate.kind));
        let blocks = self.gram(&candidates, &[]);
        let places = self.places(&candidates);
        let (picks, more) = places.split_at(self.picks.len());
        let round = Round { blocks: &blocks, picks, more, noise: now.noise };
        let base = self.judge(&blocks, picks, &self.members(picks, true), now.noise)?;
        let short = self.short_list(&round);
        let alone = self.alone.is_empty().then(|| self.kinds_alone(&round, &base, &short));
        let best = self.best_single(&round, &base, &short).or_else(|| self.best_pair(&round, &base, &short));
        let chosen: Option<Vec<Candidate>> =
            best.map(|best| best.chosen.into_iter().map(|index| more[index].0.clone()).collect());
        drop(places);
        self.alone.extend(alone.into_iter().flatten());
        let Some(chosen) = chosen else { return Some(false) };
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

    /// Candidates in the order of what they leave on all rows.
    fn short_list(&self, round: &Round<'_>) -> Vec<usize> {
        let left = |index: usize| {
            let chosen = [round.picks, &[round.more[index]]].concat();
            let members = self.members(&chosen, true);
            let coefficients = round.blocks.fit(&members, round.noise)?;
            let share = self.acting_share(round.blocks, &chosen, &members, &coefficients);
            Some((round.blocks.left(&members, &coefficients) / share, index))
        };
        let mut short: Vec<(f64, usize)> = (0..round.more.len()).filter_map(left).collect();
        short.sort_by(|a, b| a.0.total_cmp(&b.0));
        short.into_iter().map(|(_, index)| index).collect()
    }

    /// The picks with some candidates more.
    fn try_with(&self, round: &Round<'_>, chosen: &[usize]) -> Option<ScoredCandidate> {
        let added: Vec<_> = chosen.iter().map(|&index| round.more[index]).collect();
        let all = [round.picks, &added].concat();
        let members = self.members(&all, true);
        let judged = self.judge(round.blocks, &all, &members, round.noise)?;
        let mut first =
            self.nuisances.len() + round.picks.iter().map(|(pick, _)| pick.columns.len()).sum::<usize>();
        let (mut z, mut at_bound) = (f64::INFINITY, false);
        for (candidate, place) in added {
            let range = first..first + candidate.columns.len();
            first = range.end;
            let lengths: Vec<f64> =
                (0..candidate.columns.len()).map(|i| round.blocks.length(place + i)).collect();
            at_bound |= range.clone().any(|i| {
                let [low, high] = members[i].bounds;
                judged.coefficients[i] <= low || judged.coefficients[i] >= high
            });
            z = z.min(judged.z(range, &lengths));
        }
        Some(ScoredCandidate { chosen: chosen.to_vec(), judged, z, at_bound })
    }

    fn passes(&self, tried: &ScoredCandidate, base: &Judged, gains: f64) -> bool {
        !tried.at_bound
            && tried.z >= self.thresholds.z
            && tried.judged.gain_over(base) > gains * self.thresholds.gain
    }

    /// Of those that are as good as the best, the one that the library prefers.
    fn best_single(&self, round: &Round<'_>, base: &Judged, short: &[usize]) -> Option<ScoredCandidate> {
        let singles: Vec<ScoredCandidate> = short
            .iter()
            .take(SHORT_LIST)
            .filter_map(|&index| self.try_with(round, &[index]))
            .filter(|tried| self.passes(tried, base, 1.0))
            .collect();
        let gain = |tried: &ScoredCandidate| tried.judged.gain_over(base);
        let most = singles.iter().map(gain).fold(0.0, f64::max);
        let rank = |tried: &ScoredCandidate| {
            let kind = round.more[tried.chosen[0]].0.kind;
            PREFERRED.iter().position(|own| *own == kind).unwrap_or(PREFERRED.len())
        };
        singles
            .into_iter()
            .filter(|tried| gain(tried) > AS_GOOD * most)
            .min_by(|a, b| rank(a).cmp(&rank(b)).then(a.judged.error().total_cmp(&b.judged.error())))
    }

    /// Two that pass together where none does alone.
    fn best_pair(&self, round: &Round<'_>, base: &Judged, short: &[usize]) -> Option<ScoredCandidate> {
        let list = &short[..short.len().min(PAIRED)];
        let kind = |index: usize| round.more[index].0.kind;
        let pairs = list.iter().enumerate().flat_map(|(n, &a)| {
            list[n + 1..].iter().filter(move |&&b| kind(a) != kind(b)).map(move |&b| [a, b])
        });
        pairs
            .filter_map(|pair| self.try_with(round, &pair))
            .filter(|tried| self.passes(tried, base, 2.0))
            .min_by(|a, b| a.judged.error().total_cmp(&b.judged.error()))
    }

    /// The best candidate of each kind alone.
    fn kinds_alone(&self, round: &Round<'_>, base: &Judged, short: &[usize]) -> Vec<Alone> {
        let mut found: Vec<Alone> = Vec::new();
        for &index in short {
            let (candidate, place) = round.more[index];
            if found.iter().any(|alone| alone.kind == candidate.kind) {
                continue;
            }
            let Some(tried) = self.try_with(round, &[index]) else { continue };
            let others: Vec<Member> = (0..self.nuisances.len())
                .filter(|&i| !self.nuisances[i].says(candidate.kind))
                .map(Member::free)
                .collect();
            let first = self.nuisances.len();
            let signal: Vec<(usize, f64)> = (0..candidate.columns.len())
                .map(|i| (place + i, tried.judged.coefficients[first + i]))
                .collect();
            let of = |members: &[Member]| round.blocks.power_beyond(members, round.noise, &signal);
            let testable = match (of(&others), of(&[])) {
                (Some(own), Some(all)) => own > OWN_POWER * all,
                _ => false,
            };
            found.push(Alone {
                kind: candidate.kind,
                shape: candidate.shape.clone(),
                gain: tried.judged.gain_over(base),
                z: tried.z,
                testable,
            });
        }
        found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        found
    }

    /// Gain of the best of some candidates that are sure of their size alone, with a white target in the place of the
    /// measured one.
    pub(in super::super) fn best_of_noise(
        &self,
        gram: &Blocks,
        candidates: &[Candidate],
        target: &[f64],
    ) -> Option<f64> {
        let mut blocks = gram.retargeted(&self.white_columns(candidates, &[]), target, &self.white.blocks);
        self.discount_noise(&mut blocks, candidates);
        let places = self.places(candidates);
        let members = self.members(&[], true);
        let noise = self.noise(&blocks, &members)?;
        let base = self.judge(&blocks, &[], &members, noise)?;
        let round = Round { blocks: &blocks, picks: &[], more: &places, noise };
        let sure = |index: usize| {
            // What gains too little on all rows gains less on left-out ones.
            let chosen = [places[index]];
            let members = self.members(&chosen, true);
            let left = blocks.left(&members, &blocks.fit(&members, noise)?);
            if left > (1.0 - LEAST_GAIN) * base.left {
                return None;
            }
            self.try_with(&round, &[index]).filter(|tried| !tried.at_bound && tried.z >= LEAST_Z)
        };
        let gains = (0..places.len()).filter_map(sure).map(|tried| tried.judged.gain_over(&base));
        Some(gains.fold(0.0, f64::max))
    }

    fn has(&self, candidate: &Candidate) -> bool {
        self.picks
            .iter()
            .any(|pick| pick.kind == candidate.kind && (!pick.kind.series() || pick.shape == candidate.shape))
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
            match weakest.filter(|(gain, _)| *gain < self.thresholds.gain).or(uncertain) {
                None => return Some(()),
                Some((_, out)) => {
                    self.picks.remove(out);
                }
            }
        }
    }

    /// Takes out picks without which the held-out rows are told as well, the most doubtful first: the interval of what
    /// each gains there must not hold 0; where there are too few rows for an interval, the gain itself counts.
    pub(in super::super) fn check_held_out(&mut self) -> Option<()> {
        let held_out = self.rows.held_out();
        while !self.picks.is_empty() {
            let with = self.residual(&self.fit(&[])?.judged.coefficients);
            // Without rows that were held out nothing is sure.
            let least = |out: usize| {
                let without = self.residual_without(&[out])?;
                let sure = |gain: Gain| gain.ci95.map_or(gain.share, |[low, _]| low);
                Some((Gain::new(&without, &with, &held_out).map_or(0.0, sure), out))
            };
            let weakest = (0..self.picks.len()).filter_map(least).min_by(|a, b| a.0.total_cmp(&b.0))?;
            if weakest.0 > 0.0 {
                break;
            }
            self.picks.remove(weakest.1);
        }
        Some(())
    }

    /// Drops the last picks until the rest can be fitted, so that the answer is that of a fit.
    pub(in super::super) fn settle(&mut self) {
        while !self.picks.is_empty() && self.fit(&[]).is_none() {
            self.picks.pop();
        }
    }

    /// Keeps free numbers as declared that the log does not tell from that, the least sure first: a number that is off
    /// by chance would carry the model away on other logs.
    pub(in super::super) fn hold_untold(&mut self) -> Option<()> {
        let mut needed: Vec<usize> = Vec::new();
        loop {
            let fit = self.fit(&[])?;
            let t = student_t_975(fit.blocks.count().max(2) - 1);
            let untold = |(index, nuisance): (usize, &Nuisance)| {
                let known = nuisance.is_inertia() || nuisance.key.is_empty() || !nuisance.free;
                let seen = needed.contains(&index) || self.held.iter().any(|held| held.nuisance == index);
                if known || seen {
                    return None;
                }
                let (change, width) = (fit.judged.coefficients[index], t * fit.judged.standard_error(index));
                let value = (nuisance.declared + change).abs();
                let vague = width > VAGUE * value && change.abs() <= width;
                vague.then_some((
                    width / value,
                    Held { nuisance: index, ci95: [change - width, change + width] },
                ))
            };
            let found = self.nuisances.iter().enumerate().filter_map(untold);
            let Some((_, held)) = found.max_by(|a, b| a.0.total_cmp(&b.0)) else { return Some(()) };
            self.held.push(held);
            // What the others cannot take over is told after all.
            let without = self.fit(&[]);
            if without.is_none_or(|without| fit.judged.gain_over(&without.judged) > LEAST_GAIN) {
                self.held.pop();
                needed.push(held.nuisance);
            }
        }
    }

    /// Lets go of numbers that were kept as declared and are needed now that picks are gone.
    pub(in super::super) fn release_needed(&mut self) -> Option<()> {
        for place in (0..self.held.len()).rev() {
            let kept = self.fit(&[])?;
            let held = self.held.remove(place);
            if self.fit(&[]).is_none_or(|free| free.judged.gain_over(&kept.judged) <= LEAST_GAIN) {
                self.held.insert(place, held);
            }
        }
        Some(())
    }
}
