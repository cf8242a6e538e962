//! What the search asks of an effect, and its backward checks.

use crate::effects::{EffectKind, Step};
use crate::parallel;
use crate::refine::error::RefineError;

use super::forward::{self, Problem};
use super::screen::Screen;
use super::{Candidate, Fit, Search};
use crate::refine::robot::found::held_out_error;

/// Share of the error on left-out blocks that an effect must explain, and the least in units of the noise: of one of
/// which a hundred are tried.
const LEAST_SHARE: f64 = 0.0027;
const LEAST_GAIN: f64 = 22.0;
/// The least of an effect that is tried once and has no shape to refine, and what a shape adds: the largest of n squares
/// of normal numbers grows with 2 ln n.
const LEAST_ALONE: f64 = 14.0;
const OF_A_SHAPE: f64 = 2.0;
/// Standard errors above 0 of an effect's size, by the jackknife over blocks, and those of one that explains less than
/// the least of a hundred.
pub(in crate::refine::robot) const LEAST_Z: f64 = 3.0;
const SURE_Z: f64 = 5.0;
/// Least impulse of a push as a share of the weight, s: sticking that lets go looks like a smaller one.
pub(super) const LEAST_IMPULSE_S: f64 = 0.0025;
/// Time within which pushes are one, s, and the share of their gain that the strongest must have alone.
const ONE_PUSH_S: f64 = 1.5;
const MOST_OF_A_PUSH: f64 = 0.9;
/// Candidates whose shapes are refined and whose left-out error is worked out.
const SHORT_LIST: usize = 14;
const REFINED: usize = 5;
/// Gain in units of the noise below which nothing is looked at, and share of the leader's below which no shape is refined.
const LEAST_LOOK: f64 = 8.0;
const WORTH_REFINING: f64 = 0.3;
/// What a parameter and a unit of caution cost against a rival, in units of the noise.
const HANDICAP: [f64; 2] = [3.0, 10.0];
/// Gain in units of the least one up to which clean robots are asked what chance does.
const DOUBT: f64 = 3.0;

/// Fraction of the power that effects explain of which their sizes and shapes, right to a few percent, may leave as much;
/// as many times more for what is mistaken for much or has several shapes that fit themselves to it.
const LEFT_OF_FOUND: f64 = 1e-3;

/// What a candidate costs against a rival that does as well.
fn handicap(pick: &Candidate) -> f64 {
    HANDICAP[0] * pick.parameters() as f64 + HANDICAP[1] * (pick.kind.trial.caution - 1.0)
}

impl Problem for Search<'_> {
    type Pick = Candidate;
    type Fit = Fit;

    fn fit(&self, picks: &[Candidate]) -> Option<Fit> {
        Search::fit(self, picks)
    }

    fn score(&self, fit: &Fit) -> f64 {
        fit.score
    }

    fn ranked(&self, picks: &[Candidate], now: &Fit) -> Vec<(Candidate, Fit)> {
        Search::ranked(self, picks, now)
    }

    fn are_same(&self, a: &Candidate, b: &Candidate) -> bool {
        a.kind == b.kind && a.shape == b.shape
    }

    fn handicap(&self, pick: &Candidate) -> f64 {
        handicap(pick)
    }

    fn least(&self, score: f64) -> f64 {
        Search::least(self, score)
    }

    fn least_of(&self, pick: &Candidate, score: f64) -> f64 {
        Search::least_of(self, pick.kind, score)
    }

    fn is_worth(&self, picks: &[Candidate], before: &Fit, with: &Fit) -> bool {
        let Some(last) = picks.last() else { return false };
        // What the least is to a gain: by how much it is beyond.
        let gain = before.score - with.score;
        let beyond = gain / Search::least_of(self, last.kind, before.score);
        if beyond <= 1.0 {
            return false;
        }
        if last.kind.trial.brief {
            let impulse = with.judged.coefficients[with.members.len() - 1].abs() * last.shape[1];
            return impulse >= LEAST_IMPULSE_S * self.trace.machine.weight_n();
        }
        let needed = if gain > Search::least(self, before.score) { LEAST_Z } else { SURE_Z };
        let is_sure = self.is_momentary(last) || self.z(last, with) > needed;
        // What sticking mimics on clean robots too is in doubt however large it is.
        let is_plain = last.kind.trial.caution <= 1.0;
        is_sure && (is_plain && beyond > DOUBT || beyond > (self.by_chance)())
    }
}

impl Search<'_> {
    /// Gain below which nothing of which a hundred are tried is named.
    pub(in crate::refine::robot) fn least(&self, score: f64) -> f64 {
        LEAST_GAIN.max(LEAST_SHARE * score)
    }

    /// Gain below which nothing of a kind is named: the more of it are tried, the more one of them gains by chance.
    pub(in crate::refine::robot) fn least_of(&self, kind: &EffectKind, score: f64) -> f64 {
        let tried = self.library.iter().filter(|candidate| candidate.kind == kind).count().max(1);
        let shapes = kind.shapes().filter(|parameter| parameter.step != Step::Fixed).count();
        let alone = LEAST_ALONE + 2.0 * libm::log(tried as f64) + OF_A_SHAPE * shapes as f64;
        let is_plain = kind.trial.caution <= 1.0;
        let share = if is_plain { (alone / LEAST_GAIN).min(1.0) } else { 1.0 };
        kind.trial.caution * share * self.least(score)
    }

    /// Finds effects until none is worth its name.
    ///
    /// # Errors
    /// The watcher, who is told the share of the work that is done, ended it.
    pub(in crate::refine::robot) fn run(
        &mut self,
        watch: &mut dyn FnMut(f64) -> Result<(), RefineError>,
    ) -> Result<(), RefineError> {
        let found = forward::select(self, self.picks.clone(), watch)?;
        self.picks = found.picks;
        if !found.tried.is_empty() {
            self.tried = found.tried;
        }
        Ok(())
    }

    /// Drops picks that are not far beyond what chance does and do not lower the error on rows that no fit has seen,
    /// those that raise the error on held-out rows, and those that explain no more than what a size that is a little
    /// wrong leaves of the others.
    pub(in crate::refine::robot) fn confirm(&mut self) {
        let Some(bare) = self.fit(&[]) else { return };
        let held_bare = held_out_error(self, &[], &bare).powi(2);
        let mut place = 0;
        while place < self.picks.len() {
            let mut others = self.picks.clone();
            let pick = others.remove(place);
            let (Some(with), Some(without)) = (self.fit(&self.picks), self.fit(&others)) else { return };
            let gain = without.score - with.score;
            let unseen = |picks: &[Candidate], fit: &Fit| {
                let left = self.left_raw(picks, &fit.judged.coefficients);
                self.channels.unseen(&left).iter().map(|v| v * v).sum::<f64>()
            };
            let is_weak = gain < DOUBT * self.least_of(pick.kind, without.score)
                && unseen(&self.picks, &with) >= unseen(&others, &without);
            let held_out = |picks: &[Candidate], fit: &Fit| held_out_error(self, picks, fit).powi(2);
            let [held_without, held_with] = [held_out(&others, &without), held_out(&self.picks, &with)];
            let shapes = pick.kind.shapes().filter(|parameter| parameter.step != Step::Fixed).count();
            let freedom = if shapes > 1 { 2.0 * shapes as f64 } else { 1.0 };
            let left = LEFT_OF_FOUND * pick.kind.trial.caution.max(freedom);
            let gains_little = held_without - held_with <= left * (held_bare - held_with).max(0.0);
            let is_left = gain < left * (bare.score - with.score);
            if is_left || self.is_stuck(&pick, &others) || !pick.kind.trial.brief && (is_weak || gains_little)
            {
                self.picks = others;
            } else {
                place += 1;
            }
        }
    }

    /// Whether the shape of a pick never came to where the log has it: it is at the end of its range, or its size, which
    /// is in the shape, stays at its bound without every block.
    fn is_stuck(&self, pick: &Candidate, others: &[Candidate]) -> bool {
        let picks = [others, std::slice::from_ref(pick)].concat();
        pick.is_at_an_end()
            || pick.is_sized() && self.fit(&picks).is_some_and(|fit| self.z(pick, &fit).is_infinite())
    }

    /// Of pushes next to each other keeps the strongest where the others only mend its shape, and none where one push
    /// cannot be all of it.
    pub(in crate::refine::robot) fn merge_pushes(&mut self) {
        let is_brief = |pick: &Candidate| pick.kind.trial.brief;
        let near = |a: &Candidate, b: &Candidate| (a.shape[0] - b.shape[0]).abs() < ONE_PUSH_S;
        while let Some(first) = self.picks.iter().position(|pick| {
            is_brief(pick)
                && self.picks.iter().filter(|other| is_brief(other) && near(pick, other)).count() > 1
        }) {
            let center = self.picks[first].clone();
            let (group, others): (Vec<_>, Vec<_>) =
                self.picks.drain(..).partition(|pick| is_brief(pick) && near(pick, &center));
            self.picks.clone_from(&others);
            let score = |picks: &[Candidate]| self.fit(picks).map_or(f64::INFINITY, |fit| fit.score);
            let with = |own: &[Candidate]| [others.as_slice(), own].concat();
            let (none, all) = (score(&others), score(&with(&group)));
            let best = group.iter().map(|pick| (score(&with(std::slice::from_ref(pick))), pick));
            if let Some((alone, pick)) = best.min_by(|a, b| a.0.total_cmp(&b.0))
                && none - alone > MOST_OF_A_PUSH * (none - all)
            {
                self.picks.push(pick.clone());
            }
        }
    }

    /// Standard errors of the last pick's size above 0.
    pub(in crate::refine::robot) fn z(&self, last: &Candidate, with: &Fit) -> f64 {
        let first = with.members.len() - last.white.len();
        let lengths: Vec<f64> =
            (first..with.members.len()).map(|column| with.blocks.length(column)).collect();
        with.judged.z(first..with.members.len(), &lengths)
    }

    /// The largest gain of anything that is tried beside nothing else, as a multiple of the least that it needs.
    pub(in crate::refine::robot) fn largest(&self) -> f64 {
        let Some(bare) = self.fit(&[]) else { return 0.0 };
        let gains = self.ranked(&[], &bare).into_iter().filter(|(pick, _)| !pick.kind.trial.brief);
        gains
            .map(|(pick, fit)| (bare.score - fit.score) / self.least_of(pick.kind, bare.score))
            .fold(0.0, f64::max)
    }

    /// Puts a kind with fewer parameters in the place of a pick where it does as well.
    pub(in crate::refine::robot) fn simplify(&mut self) {
        for place in 0..self.picks.len() {
            let mut others = self.picks.clone();
            let pick = others.remove(place);
            if let Some(simple) = self.simpler(&pick, &others) {
                self.picks[place] = simple;
            }
        }
    }

    fn simpler(&self, pick: &Candidate, others: &[Candidate]) -> Option<Candidate> {
        let with = |pick: &Candidate| {
            let fit = self.fit(&[others, std::slice::from_ref(pick)].concat())?;
            Some(fit.score + handicap(pick))
        };
        let (screen, price) = (Screen::new(self, others)?, with(pick)?);
        let least = screen.gain(pick) - handicap(pick);
        let fewer = self.library.iter().filter(|other| other.parameters() < pick.parameters());
        fewer
            .filter(|other| others.iter().all(|o| o.kind != other.kind) && screen.gain(other) > least)
            .filter_map(|other| Some((with(other)?, other)))
            .filter(|(own, _)| *own < price)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, other)| other.clone())
    }

    /// The most promising candidates, their shapes refined, with their fits beside the picks.
    pub(in crate::refine::robot) fn ranked(&self, picks: &[Candidate], now: &Fit) -> Vec<(Candidate, Fit)> {
        let Some(screen) = Screen::new(self, picks) else { return Vec::new() };
        let list = self.short_list(&screen, picks, now);
        let leader = list.first().map_or(0.0, |(gain, _)| *gain);
        let promises = |(gain, candidate): &&(f64, Candidate)| {
            *gain > WORTH_REFINING * leader && candidate.is_flexible()
        };
        let refined: Vec<&(f64, Candidate)> = list.iter().filter(promises).take(REFINED).collect();
        let fitted = |listed: &(f64, Candidate)| {
            let mut candidate = listed.1.clone();
            if refined.iter().any(|refined| std::ptr::eq(*refined, listed)) {
                self.refine_shape(&screen, &mut candidate, listed.0);
            }
            let mut tried = picks.to_vec();
            tried.push(candidate);
            let fit = self.fit(&tried)?;
            Some((tried.pop()?, fit))
        };
        parallel::map(&list, self.threads, fitted).into_iter().flatten().collect()
    }

    /// Candidates by what they would gain as they are; of one that is flexible only its best shape.
    fn short_list(&self, screen: &Screen, picks: &[Candidate], now: &Fit) -> Vec<(f64, Candidate)> {
        let found = [
            self.pushes(picks, &now.judged.coefficients),
            self.ground_waves(picks, &now.judged.coefficients),
        ];
        let wanted = |candidate: &&Candidate| {
            candidate.repeats()
                && !picks.iter().any(|pick| pick.kind == candidate.kind && pick.shape == candidate.shape)
                || picks.iter().all(|pick| pick.kind != candidate.kind)
        };
        let mut gains: Vec<(f64, &Candidate)> = self
            .library
            .iter()
            .chain(found.iter().flatten())
            .filter(wanted)
            .map(|candidate| (screen.gain(candidate), candidate))
            .filter(|(gain, _)| *gain > LEAST_LOOK)
            .collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut list: Vec<(f64, Candidate)> = Vec::new();
        for (gain, candidate) in gains {
            let alike =
                list.iter().filter(|(_, o)| o.kind == candidate.kind && o.form == candidate.form).count();
            if alike < if candidate.is_flexible() { 1 } else { 3 } {
                list.push((gain, candidate.clone()));
            }
            if list.len() >= SHORT_LIST {
                break;
            }
        }
        list
    }
}
