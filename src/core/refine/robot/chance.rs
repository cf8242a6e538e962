//! What chance does: clean robots, simulated and passed through the same chain.

use std::num::NonZeroUsize;

use crate::parallel;
use crate::refine::largest::exceeded_by;

use super::candidates::library;
use super::channels::Channels;
use super::nuisance::nuisances;
use super::search::{Search, whitened};
use super::twin::{Levels, Twin};

/// Clean robots, and the share of such sets of effects that the largest of them may exceed.
const ROBOTS: u64 = 10;
const LEVEL: f64 = 0.01;
/// Scale of the largest of many gains as multiples of the least that is needed: that of the largest of many χ² is 2 of
/// about 20, and no smaller one is believed.
const LEAST_SCALE: f64 = 0.1;

/// Multiple of what it needs that the largest of all effects exceeds in one of a hundred clean robots; 0 where none can
/// be simulated.
pub(super) fn largest_gain(twin: &Twin<'_>, levels: Levels, seed: u64) -> f64 {
    let seeds: Vec<u64> =
        (1..=ROBOTS).map(|robot| seed.wrapping_mul(ROBOTS + 1).wrapping_add(robot)).collect();
    let gains = parallel::map(&seeds, parallel::available(), |&seed| largest(twin, levels, seed));
    exceeded_by(&gains.into_iter().flatten().collect::<Vec<_>>(), LEVEL, LEAST_SCALE)
}

/// The largest gain that anything has in one clean robot.
fn largest(twin: &Twin<'_>, levels: Levels, seed: u64) -> Option<f64> {
    let trace = twin.trace(levels, seed)?;
    let target = trace.residual();
    let channels = Channels::new(&trace, &target);
    // The robots share the threads.
    let alone = NonZeroUsize::MIN;
    let (mut free, mut tried) = (nuisances(&trace, twin.known), library(&trace, alone));
    whitened(&mut tried, &mut free, &channels, alone);
    Some(Search::new(&trace, &channels, &free, &tried, &target, &|| 0.0).largest())
}
