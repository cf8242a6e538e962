//! What was tried, best first, and what became of it.

use crate::effects::MachineKind;
use crate::refine::verdict::{Fate, Found, Tried};

use super::search::{Alone, Thresholds};

/// Everything that was tried alone, with its fate in the end.
pub(super) fn tried(
    alone: &[Alone],
    effects: &[Found],
    passing: Thresholds,
    machine: MachineKind,
) -> Vec<Tried> {
    let fate = |alone: &Alone| {
        if effects.iter().any(|found| found.effect.kind() == alone.kind) {
            return Fate::Added;
        }
        let twin = effects.iter().find(|found| found.ambiguous_with.contains(&alone.kind));
        match twin {
            Some(twin) => Fate::NotToldFrom(twin.effect.kind()),
            None if alone.gain <= passing.gain && !alone.testable => Fate::NotTestable,
            None if alone.gain <= passing.gain => Fate::TooSmall,
            None if alone.z >= passing.z && !effects.is_empty() => Fate::Explained,
            None => Fate::NotSure,
        }
    };
    let told = |alone: &Alone| Tried {
        kind: alone.kind,
        detail: Tried::detail_of(alone.kind, &alone.shape, machine),
        gain_percent: 100.0 * alone.gain,
        z: alone.z,
        fate: fate(alone),
    };
    alone.iter().map(told).collect()
}
