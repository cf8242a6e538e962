//! By how much the chain itself shifts the sizes of effects.
//!
//! Noise of the sensors is in the columns too, held readings are filled in, friction sticks: what the regression says of a
//! simulated robot with the effects that were found is compared with what that robot has.

use std::num::NonZeroUsize;

use crate::effects::{EffectKind, Term};
use crate::parallel;

use super::candidates::Candidate;
use super::channels::Channels;
use super::found;
use super::nuisance::nuisances;
use super::search::{Fit, Search, whitened};
use super::twin::{Levels, Twin};

/// Simulated robots.
const ROBOTS: u64 = 6;
/// Share of a shift that stays in doubt.
const DOUBT: f64 = 0.3;

/// What was found: picks, their laws with sizes, and their coefficients without those of the nuisances.
struct Found<'a> {
    picks: &'a [Candidate],
    laws: Vec<(&'static EffectKind, Term, f64)>,
    sizes: &'a [f64],
}

/// Shift of each pick's coefficients and its standard error, in the order of the fit, without the nuisances.
pub(super) fn shifts(
    search: &Search<'_>,
    fit: &Fit,
    twin: &Twin<'_>,
    levels: Levels,
    seed: u64,
) -> Option<Vec<(f64, f64)>> {
    let first = search.nuisances.len();
    let picks = search.picks.as_slice();
    let known = Found {
        picks,
        laws: found::laws(search, fit),
        sizes: &fit.judged.coefficients[first..fit.members.len()],
    };
    let seeds: Vec<u64> =
        (1..=ROBOTS).map(|robot| seed.wrapping_mul(ROBOTS + 7).wrapping_sub(robot)).collect();
    let found: Vec<Vec<f64>> =
        parallel::map(&seeds, parallel::available(), |&seed| refitted(&known, twin, levels, seed))
            .into_iter()
            .flatten()
            .collect();
    let count = found.len() as f64;
    if count < 3.0 {
        return None;
    }
    let shift = |place: usize| {
        let own = found.iter().map(|sizes| sizes[place] - known.sizes[place]);
        let mean = own.clone().sum::<f64>() / count;
        let variance = own.map(|off| (off - mean).powi(2)).sum::<f64>() / (count - 1.0);
        (mean, (variance / count + (DOUBT * mean).powi(2)).sqrt())
    };
    Some((0..known.sizes.len()).map(shift).collect())
}

/// Coefficients that the chain finds in one simulated robot.
fn refitted(known: &Found<'_>, twin: &Twin<'_>, levels: Levels, seed: u64) -> Option<Vec<f64>> {
    let mut trace = twin.trace(levels, seed)?;
    let loads = trace.loads(&known.laws);
    trace.refill(&loads);
    let target = trace.residual();
    let again = |pick: &Candidate| Candidate::new(&trace, pick.kind, pick.form, pick.shape.clone());
    let mut picks: Vec<Candidate> = known.picks.iter().map(again).collect();
    let mut free = nuisances(&trace, twin.known);
    let plain = Channels::new(&trace, &target);
    whitened(&mut picks, &mut free, &plain, NonZeroUsize::MIN);
    let rough = Search::new(&trace, &plain, &free, &[], &target, &|| 0.0);
    let left = rough.left_raw(&picks, &rough.fit(&picks)?.judged.coefficients);
    let channels = Channels::new(&trace, &left);
    whitened(&mut picks, &mut free, &channels, NonZeroUsize::MIN);
    let search = Search::new(&trace, &channels, &free, &[], &target, &|| 0.0);
    Some(search.fit(&picks)?.judged.coefficients.split_off(free.len()))
}
