//! What was tried, best first, and what became of it.

use crate::model::MachineKind;
use crate::refine::verdict::{Found, Outcome, ScoredCandidate};

use super::search::{Alone, Thresholds};

/// Everything that was tried alone, with its outcome in the end.
pub(super) fn tried(
    alone: &[Alone],
    effects: &[Found],
    passing: Thresholds,
    machine: MachineKind,
) -> Vec<ScoredCandidate> {
    let outcome = |alone: &Alone| {
        if effects.iter().any(|found| found.effect.kind() == alone.kind) {
            return Outcome::Added;
        }
        let twin = effects.iter().find(|found| found.ambiguous_with.contains(&alone.kind));
        match twin {
            Some(twin) => Outcome::Ambiguous(twin.effect.kind()),
            None if alone.gain <= passing.gain && !alone.testable => Outcome::NotTestable,
            None if alone.gain <= passing.gain => Outcome::TooSmall,
            None if alone.z >= passing.z && !effects.is_empty() => Outcome::Explained,
            None => Outcome::NotSignificant,
        }
    };
    let told = |alone: &Alone| ScoredCandidate {
        kind: alone.kind,
        detail: ScoredCandidate::detail_of(alone.kind, &alone.shape, machine),
        gain_percent: 100.0 * alone.gain,
        z: alone.z,
        outcome: outcome(alone),
    };
    alone.iter().map(told).collect()
}
