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
/// Scale of the largest of many gains: that of the largest of many χ² is 2, and no smaller one is believed.
const LEAST_SCALE: f64 = 2.0;
/// Threads that share the robots; the answer does not depend on them.
pub(super) const THREADS: NonZeroUsize = NonZeroUsize::new(4).expect("four");

/// Gain that the largest of all effects exceeds in one of a hundred clean robots; 0 where none can be simulated.
pub(super) fn largest_gain(twin: &Twin<'_>, levels: Levels, seed: u64) -> f64 {
    let seeds: Vec<u64> =
        (1..=ROBOTS).map(|robot| seed.wrapping_mul(ROBOTS + 1).wrapping_add(robot)).collect();
    let gains: Vec<f64> =
        parallel::map(&seeds, THREADS, |&seed| largest(twin, levels, seed)).into_iter().flatten().collect();
    exceeded_by(&gains, LEVEL, LEAST_SCALE)
}

/// The largest gain that anything has in one clean robot.
fn largest(twin: &Twin<'_>, levels: Levels, seed: u64) -> Option<f64> {
    let trace = twin.trace(levels, seed)?;
    let target = trace.residual();
    let channels = Channels::new(&trace, &target);
    let (mut free, mut tried) = (nuisances(&trace, twin.known), library(&trace));
    whitened(&mut tried, &mut free, &channels);
    Some(Search::new(&trace, &channels, &free, &tried, &target, &|| 0.0).largest())
}
