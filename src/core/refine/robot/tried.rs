//! What was tried, and what became of it.

use crate::effects::{EffectKind, KINDS};
use crate::model::MachineKind;
use crate::refine::verdict::{Found, Outcome, ScoredCandidate};

use super::candidates::Candidate;
use super::search::{Fit, LEAST_Z, Screen, Search};

/// Share of an effect's columns that declared numbers within their tolerances must leave, so that it can be tested.
const TESTABLE: f64 = 0.05;

/// The candidates of the first look, best first, then what this log cannot test.
pub(super) fn tried(search: &Search<'_>, effects: &[Found]) -> Vec<ScoredCandidate> {
    let Some(bare) = search.fit(&[]) else { return Vec::new() };
    let mut list: Vec<&(Candidate, Fit)> = search.tried.iter().collect();
    list.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
    let entry = |(candidate, fit): &&(Candidate, Fit)| {
        let gain = bare.score - fit.score;
        let z = search.z(candidate, fit);
        ScoredCandidate {
            kind: candidate.kind,
            detail: ScoredCandidate::detail_of(
                candidate.kind,
                &candidate.shape[..candidate.shape.len().min(1)],
                MachineKind::Robot,
            ),
            gain_percent: 100.0 * gain / bare.score,
            z,
            outcome: outcome(search, effects, candidate.kind, gain, &bare, z),
        }
    };
    let mut found: Vec<ScoredCandidate> = list.iter().map(entry).collect();
    found.extend(untestable(search));
    found
}

fn outcome(
    search: &Search<'_>,
    effects: &[Found],
    kind: &'static EffectKind,
    gain: f64,
    bare: &Fit,
    z: f64,
) -> Outcome {
    if effects.iter().any(|found| found.effect.kind() == kind) {
        return Outcome::Added;
    }
    if let Some(found) = effects.iter().find(|found| found.ambiguous_with.contains(&kind)) {
        return Outcome::Ambiguous(found.effect.kind());
    }
    if gain < search.least_of(kind, bare.score) {
        Outcome::TooSmall
    } else if z < LEAST_Z || effects.is_empty() {
        Outcome::NotSignificant
    } else {
        Outcome::Explained
    }
}

fn untestable(search: &Search<'_>) -> Vec<ScoredCandidate> {
    let Some(screen) = Screen::new(search, &[]) else { return Vec::new() };
    let own = |kind: &EffectKind| {
        let shapes = search.library.iter().filter(|candidate| candidate.kind == kind);
        shapes.map(|candidate| screen.own_share(candidate)).fold(f64::NEG_INFINITY, f64::max)
    };
    let of_robots = KINDS.iter().copied().filter(|kind| kind.is_on(MachineKind::Robot));
    of_robots
        .filter(|kind| search.tried.iter().all(|(candidate, _)| candidate.kind != *kind))
        .filter(|kind| (f64::NEG_INFINITY..TESTABLE).contains(&own(kind)) && own(kind).is_finite())
        .map(|kind| ScoredCandidate {
            kind,
            detail: String::new(),
            gain_percent: 0.0,
            z: 0.0,
            outcome: Outcome::NotTestable,
        })
        .collect()
}
