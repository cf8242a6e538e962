//! Separation of an effect from its rivals in a run, given an earlier log.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use super::Context;
use super::normal::Normal;
use super::residuals::{Seen, Shaped, View};
use super::runs::Run;
use crate::parallel;
use crate::refine::verdict::{Found, Refinement};
use crate::simulate::{self, Experiment};

/// Separation of the effect from its nearest rival in each of the runs; `None` if the log has no motion.
pub(super) fn separations(
    found: &Refinement,
    effect: &Found,
    runs: &[Run],
    context: &Context<'_>,
) -> Option<Vec<f64>> {
    let view = View::new(found, context.motor)?;
    let recorded: Vec<Seen> = context.logs.iter().filter_map(|log| view.seen(log)).collect();
    if recorded.is_empty() {
        return None;
    }
    let told = view.rows(&view.law(effect, &recorded));
    let rivals: Vec<Vec<Shaped>> = effect
        .ambiguous_with
        .iter()
        .map(|kind| view.shapes(kind, effect))
        .filter(|s| !s.is_empty())
        .collect();
    if rivals.is_empty() {
        return None;
    }
    // Of each rival the shape that mimics the effect best in the log.
    let mut chosen: Vec<(Shaped, Normal, f64)> = Vec::new();
    for shapes in rivals {
        let tried = shapes.into_iter().map(|shape| {
            let normal = view.normal(&recorded, &told, &shape);
            let left = normal.least(&view.tolerances);
            (shape, normal, left)
        });
        chosen.extend(tried.min_by(|a, b| a.2.total_cmp(&b.2)));
    }
    let threads = NonZeroUsize::new(2).expect("2 is not 0");
    Some(parallel::map(runs, threads, |run| {
        let experiment = Experiment { seed: context.seed, ..run.experiment.clone() };
        let watch = &mut |_| ControlFlow::Continue(());
        let Ok(outcome) = simulate::run(&experiment, &found.model, &found.model, watch) else { return 0.0 };
        let fell = matches!(&outcome, simulate::Outcome::Ground(run) if run.statistics.fell);
        let Some(seen) = view.seen(&outcome.log(context.motor)).filter(|_| !fell) else { return 0.0 };
        let seen = [seen];
        let told = view.rows(&view.law(effect, &seen));
        let apart = |(shape, normal, left): &(Shaped, Normal, f64)| {
            let both = normal.plus(&view.normal(&seen, &told, shape));
            (both.least(&view.tolerances) - left).max(0.0).sqrt()
        };
        chosen.iter().map(apart).fold(f64::INFINITY, f64::min)
    }))
}
