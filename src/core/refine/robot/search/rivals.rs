//! What a log cannot tell from an effect.

use crate::effects::EffectKind;
use crate::parallel;

use super::screen::Screen;
use super::{Candidate, Search};

/// By how much a rival may do worse and still not be told apart: in units of the noise, and of the gain.
const NEARLY: f64 = 15.0;
const NEARLY_SHARE: f64 = 0.03;

impl Search<'_> {
    /// Kinds that do nearly as well as a pick beside the others.
    pub(in crate::refine::robot) fn rivals(
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
        let mut best: Vec<(f64, &Candidate)> = Vec::new();
        for (rival, candidate) in gains {
            if best.iter().all(|(_, other)| other.kind != candidate.kind) {
                best.push((rival, candidate));
            }
        }
        let nearly = |&(rival, candidate): &(f64, &Candidate)| {
            let mut candidate = candidate.clone();
            if candidate.is_flexible() {
                self.refine_shape(&screen, &mut candidate, rival);
            }
            let kind = candidate.kind;
            let fit = self.fit(&[others, &[candidate]].concat())?;
            (fit.score < score + NEARLY + NEARLY_SHARE * gain).then_some(kind)
        };
        parallel::map(&best, self.threads, nearly).into_iter().flatten().collect()
    }
}
