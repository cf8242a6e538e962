//! A single motor or a linear axis: its equation error, and what its model lacks.

mod candidates;
mod carried;
mod dead;
mod errors;
mod floor;
mod found;
mod health;
mod leftover;
mod misnamed;
mod nuisance;
mod null;
mod regression;
mod rig;
mod search;
mod trace;
mod tried;
mod waves;

use crate::effects::EffectKind;
use crate::model::Model;
use crate::record::{self, HealthFinding, Log};

use super::error::RefineError;
use super::verdict::{Errors, Found, Refinement, Residual, Verdict};
use super::{Options, Watch, is_unfit, report};
use errors::{errors, rms};
use floor::Floor;
use leftover::Dependence;
use misnamed::{little, misnamed};
use regression::Regression;
use rig::Declared;
use search::{Fit, Search};
use trace::{Asked, Part, Rows};

/// How many times its noise floor an error is at least that something of it is not explained.
const OVER_FLOOR: f64 = 1.25;
/// The same where the floor is that of the sensors alone, which leaves out what nobody measures.
const OVER_SENSORS: f64 = 2.0;
/// Fewest rows that are fitted.
const LEAST_ROWS: usize = 200;

/// How far the declared model is from logs.
pub(super) fn residual(
    model: &Model,
    logs: &[Log],
    options: &Options,
    watch: Watch<'_>,
) -> Result<Residual, RefineError> {
    let declared = Declared::new(model, options.motor);
    let (acting, _) = acting(model, [logs, &[]], options);
    let logs = acting.as_slice();
    let mut data_health = health::check(logs, &declared);
    // No number is fitted, so that every row counts.
    let rows = Rows::new(logs, logs, declared.names(), (Asked::new(options.speeds), f64::INFINITY));
    data_health.extend(health::check_rows(&rows, &declared, rows.rows.len(), LEAST_ROWS));
    if is_unfit(&data_health) {
        return Ok(Residual { errors: Errors::default(), tests: Vec::new(), data_health });
    }
    let mut asked = Regression::new(declared, rows, &options.estimate)?;
    data_health.extend(asked.check_units());
    report(watch, 0.5)?;
    let whitener = asked.whitener();
    asked.take_out_timing(&whitener);
    let mut tests = Vec::new();
    if whitener.rows().len() >= LEAST_ROWS {
        let white = asked.white(&whitener);
        let structure = asked.search(&whitener, &white, &[]).leftover(&asked.wanted()).unwrap_or_default();
        tests.extend(structure.iter().map(|found| found.test(&asked.declared)));
    }
    let Regression { declared, rows, measured, target, .. } = &asked;
    let carried = carried::carried(declared, rows, target, |known| Some(asked.target_with(known)));
    data_health.extend(carried::findings(declared, &logs.iter().collect::<Vec<_>>(), &carried));
    let beyond = |told| health::beyond(declared, told, rows.speeds(Part::HeldOut)?);
    data_health.extend(declared.told_from.and_then(beyond));
    let floor = Floor::new(declared, rows, Part::HeldOut, target);
    Ok(Residual { errors: errors(declared, rows, measured, target, &floor), tests, data_health })
}

/// What a fit leaves.
struct Left {
    fit: Fit,
    residual: Vec<f64>,
    /// What the residual depends on, whether it shows or not.
    structure: Vec<Dependence>,
}

impl Left {
    fn new(search: &Search<'_>, fit: Fit, wanted: &[f64]) -> Self {
        let residual = search.residual(&fit.judged.coefficients);
        Self { fit, residual, structure: search.leftover(wanted).unwrap_or_default() }
    }
}

/// Finds what the model lacks.
pub(super) fn refine(
    model: &Model,
    logs: &[Log],
    held_out: &[Log],
    (options, banned): (&Options, &[&'static EffectKind]),
    watch: Watch<'_>,
) -> Result<Refinement, RefineError> {
    let (training, others) = acting(model, [logs, held_out], options);
    let (logs, held_out) = (training.as_slice(), others.as_slice());
    let all_logs: Vec<&Log> = logs.iter().chain(held_out).collect();
    let (asked, mut data_health) = asked(model, [logs, held_out], options)?;
    if is_unfit(&data_health) {
        return Ok(Refinement::unfit(model, data_health));
    }
    let (wanted, whitener) = (asked.wanted(), asked.whitener());
    let white = asked.white(&whitener);
    let bare = asked.search(&whitener, &white, &[]);
    let Some(first) = bare.fit(&[]) else {
        data_health.push(health::inseparable(&asked.declared));
        return Ok(Refinement::unfit(model, data_health));
    };
    let before = Left::new(&bare, first, &wanted);
    let is_driven = health::is_driven(&asked.rows, asked.declared.inertia, &before.residual);
    if !is_driven {
        data_health.push(health::not_driven(&asked.declared));
    }
    let mut library = asked.library(&whitener, is_driven);
    library.retain(|candidate| !banned.contains(&candidate.kind));
    let without = |known: &[f64]| asked.left_of(&whitener, &asked.target_with(known));
    let carried = carried::carried(&asked.declared, &asked.rows, &before.residual, without);
    data_health.extend(carried::findings(&asked.declared, &all_logs, &carried));
    data_health.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    report(watch, 0.2)?;
    let mut search = asked.search(&whitener, &white, &library);
    let clean = clean(&asked, &before, options.seed);
    search.thresholds = null::thresholds(&clean, &asked.rows, &whitener, &search, &library);
    report(watch, 0.4)?;
    search.ban(banned);
    look(&mut search, watch)?;
    report(watch, 0.8)?;
    let fit = search.fit(&[]).unwrap_or_else(|| before.fit.clone());
    let after = Left::new(&search, fit, &wanted);
    let end = End::new(&asked, &mut search, [before, after]);
    Ok(Refinement { data_health, transfer: carried, ..end.refinement(model, options, &asked, &search) })
}

/// Logs with efforts that act as late as the model says, where that leaves less than efforts as they are logged: a model
/// file without a word of it says what is usual, and some logs hold what acts.
fn acting(model: &Model, [logs, held_out]: [&[Log]; 2], options: &Options) -> (Vec<Log>, Vec<Log>) {
    let declared = Declared::new(model, options.motor);
    let delayed = |logs: &[Log]| -> Vec<Log> { logs.iter().map(|log| delayed(log, &declared)).collect() };
    let late = delayed(logs);
    let power = |logs: &[Log]| {
        let rows = Rows::new(logs, logs, declared.names(), (Asked::new(options.speeds), f64::INFINITY));
        let fits = rows.rows.iter().filter(|row| row.part == Part::Fit).count() >= LEAST_ROWS;
        let asked =
            fits.then(|| Regression::new(declared.clone(), rows, &options.estimate).ok()).flatten()?;
        let left = asked.left_of(&asked.whitener(), &asked.target)?;
        Some(rms(&asked.rows, Part::Fit, &left))
    };
    let is_late = declared.delay_s > 0.0
        && power(&late).zip(power(logs)).is_some_and(|(late, as_logged)| late < as_logged);
    if is_late { (late, delayed(held_out)) } else { (logs.to_vec(), held_out.to_vec()) }
}

/// A log whose efforts act as late as the model says: a row's effort is what acts from the row on.
fn delayed(log: &Log, declared: &Declared) -> Log {
    let mut log = log.clone();
    let Some(row_s) = log.column("time_s").and_then(record::row_time_s) else { return log };
    let places = (declared.delay_s / row_s).min(log.rows() as f64);
    let (whole, share) = (places.floor() as usize, places.fract());
    if let Some(column) = log.columns.iter_mut().find(|column| column.name == declared.names().effort) {
        let at = |row: usize, back: usize| column.values[row.saturating_sub(back)];
        column.values = (0..column.values.len())
            .map(|row| (1.0 - share) * at(row, whole) + share * at(row, whole + 1))
            .collect();
    }
    log
}

/// The regression of a refinement, and what is to be said of its data, the worst first.
fn asked(
    model: &Model,
    [logs, held_out]: [&[Log]; 2],
    options: &Options,
) -> Result<(Regression, Vec<HealthFinding>), RefineError> {
    let declared = Declared::new(model, options.motor);
    let mut data_health = health::check(logs.iter().chain(held_out), &declared);
    let rows = |highest_hz: f64| {
        Rows::new(logs, held_out, declared.names(), (Asked::new(options.speeds), highest_hz))
    };
    let first = rows(f64::INFINITY);
    let count = |rows: &Rows, part: Part| rows.rows.iter().filter(|row| row.part == part).count();
    data_health.extend(health::check_rows(&first, &declared, count(&first, Part::Fit), LEAST_ROWS));
    data_health.extend(health::check_held_out(&declared, &first, count(&first, Part::HeldOut)));
    let regression = |mut declared: Declared, rows: Rows| {
        declared.take_over_free(&rows, &options.estimate);
        Regression::new(declared, rows, &options.estimate)
    };
    let mut asked = regression(declared.clone(), first)?;
    if let Some(highest_hz) = asked.highest_hz() {
        let narrow = rows(highest_hz);
        if count(&narrow, Part::Fit) >= LEAST_ROWS {
            asked = regression(declared, narrow)?;
        }
    }
    data_health.extend(asked.check_units());
    data_health.extend(asked.check_speeds());
    data_health.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    Ok((asked, data_health))
}

/// The clean machine that has the declared model's numbers as a fit has them.
fn clean(asked: &Regression, before: &Left, seed: u64) -> null::Clean {
    let Regression { declared, rows, nuisances, .. } = asked;
    let corrections = found::corrections(declared, nuisances, &before.fit, &[]);
    null::Clean {
        inertia: declared.inertia,
        curve: declared.corrected_curve(&found::values(&corrections)),
        effort_noise: Floor::new(declared, rows, Part::Fit, &before.residual).effort,
        seed,
    }
}

/// Looks for effects, and drops what the rest of the log does not bear out.
fn look(search: &mut Search<'_>, watch: Watch<'_>) -> Result<(), RefineError> {
    search.run(watch)?;
    search.settle();
    search.hold_untold();
    search.check_held_out();
    search.release_needed();
    // Whatever these left that depends on each other.
    search.settle();
    if search.picks.is_empty() {
        search.held.clear();
    }
    Ok(())
}

/// What stands at the end of a search: its effects, or none where their names are wrong.
struct End {
    before: Left,
    after: Left,
    effects: Vec<Found>,
    /// Whether there were effects whose names are wrong.
    wrong: bool,
}

impl End {
    fn new(asked: &Regression, search: &mut Search<'_>, [before, mut after]: [Left; 2]) -> Self {
        let Regression { declared, rows, .. } = asked;
        after.structure.retain(Dependence::shows);
        let mut effects = found::effects(search, &after.fit, declared);
        let floor = Floor::new(declared, rows, Part::HeldOut, &after.residual);
        let held_out_error = |left: &Left| rms(rows, Part::HeldOut, &left.residual);
        let wrong = !effects.is_empty()
            && (misnamed([&before, &after], &effects)
                || little([&before, &after].map(held_out_error), &floor));
        if wrong {
            effects.clear();
            search.picks.clear();
            search.held.clear();
            if after.structure.is_empty() {
                after.structure.extend(before.structure.iter().filter(|found| found.shows()).cloned());
            }
            (after.fit, after.residual) = (before.fit.clone(), before.residual.clone());
        }
        Self { before, after, effects, wrong }
    }

    /// The answer, without what is said of the data.
    fn refinement(
        self,
        model: &Model,
        options: &Options,
        asked: &Regression,
        search: &Search<'_>,
    ) -> Refinement {
        let Self { before, after, effects, wrong } = self;
        let Regression { declared, rows, measured, nuisances, .. } = asked;
        let floor = Floor::new(declared, rows, Part::HeldOut, &after.residual);
        let over_floor = rms(rows, Part::HeldOut, &after.residual) / floor.variance.sqrt();
        let most = if floor.measured { OVER_FLOOR } else { OVER_SENSORS };
        let over_floor = (over_floor > most).then_some(over_floor);
        let is_explained = after.structure.is_empty() && over_floor.is_none() && !wrong;
        let parameters = found::corrections(declared, nuisances, &after.fit, &search.held);
        let told_from = asked.fitted_speed_range().or(declared.told_from);
        let corrected =
            declared.corrected_model(model, options.motor, (&found::values(&parameters), told_from));
        let errors = |left: &Left| errors(declared, rows, measured, &left.residual, &floor);
        Refinement {
            verdict: match (effects.is_empty(), is_explained) {
                (false, _) => Verdict::EffectsFound,
                (true, false) => Verdict::UnexplainedResidual,
                (true, true) => Verdict::ModelAdequate,
            },
            model: found::refined_model(corrected, options.motor, &effects),
            candidates: tried::tried(&search.alone, &effects, search.thresholds, declared.machine.kind),
            effects,
            before: errors(&before),
            after: errors(&after),
            unexplained: found::unexplained(declared, &after.structure, over_floor),
            closed_loop: None,
            next_experiment: None,
            data_health: Vec::new(),
            transfer: Vec::new(),
            parameters,
            explorer: found::explorer(asked, [&before.residual, &after.residual], &floor),
            document: Default::default(),
        }
    }
}

#[cfg(test)]
mod tests;
