//! A single motor or a linear axis: its equation error, and what its model lacks.

mod candidates;
mod carried;
mod dead;
mod errors;
mod floor;
mod health;
mod leftover;
mod null;
mod rig;
mod search;
mod trace;
mod tried;
mod waves;

use crate::effects::{self, Effect, MachineKind, Place, Role};
use crate::identify::quantile::student_t_975;
use crate::model_file::{Model, Rig};
use crate::record::{Log, Severity};
use crate::robot::Motor;

use super::error::RefineError;
use super::gain::Gain;
use super::select::Blocks;
use super::verdict::{Corrected, Errors, Found, Refinement, Residual, Unexplained, Verdict};
use super::whiten::Whitener;
use super::{Explorer, Options, Watch, report};
use candidates::{Scales, library};
use errors::errors;
use floor::Floor;
use leftover::{Dependence, Variable};
use rig::{Declared, Nuisance};
use search::{Fit, Held, Search, White};
use trace::{Asked, Part, Rows};

/// Share of the gain of effects above which what is left shows that they are not the right ones.
const MISNAMED: f64 = 0.35;
/// Share of what is left that one variable explains, above which the names are wrong whatever they explain.
const NEARLY_ALL: f64 = 0.8;
/// How many times its noise floor an error is at least that something of it is not explained.
const OVER_FLOOR: f64 = 1.25;
/// The same where the floor is that of the sensors alone, which leaves out what nobody measures.
const OVER_SENSORS: f64 = 2.0;
/// How many times its floor an error may stay, and the share of what was above the floor that effects then have to explain.
const FAR_OVER_FLOOR: f64 = 1.4;
const LITTLE: f64 = 0.5;
/// The same for the speed, where all effects are functions of the speed.
const STILL_OVER_SPEED: f64 = 0.2;
const OF_SPEED: [&str; 5] =
    ["quadratic_drag", "viscous_asymmetry", "viscous_error", "coulomb_error", "low_speed_friction"];
/// How many times less a function of one variable leaves than effects that are not the right ones.
const BETTER: f64 = 2.5;
/// What the method itself is off by as a share of a value, as made logs show it; with noise of the effort in the columns
/// more. It counts in intervals.
const OFF: f64 = 0.01;
const OFF_WITH_EFFORT: f64 = 0.03;
/// Fewest rows that are fitted.
const LEAST_ROWS: usize = 200;

/// In the place of effects: numbers of the friction.
const FRICTION: [&str; 3] = ["viscous_error", "coulomb_error", "friction_asymmetry"];

/// How far the declared model is from logs.
pub(super) fn residual(
    model: &Model,
    logs: &[Log],
    options: &Options,
    watch: Watch<'_>,
) -> Result<Residual, RefineError> {
    let mut declared = Declared::new(model, options.motor);
    let mut data_health = health::check(logs, &declared);
    // No number is fitted, so that every row counts.
    let rows = Rows::new(logs, logs, declared.names(), Asked::new(options.speeds));
    data_health.extend(health::check_rows(&rows, &declared, rows.rows.len(), LEAST_ROWS));
    if data_health.iter().any(|finding| finding.severity == Severity::Error) {
        return Ok(Residual { errors: Errors::default(), tests: Vec::new(), data_health });
    }
    declared.zeros_rad = carried::zeros_rad(&declared, &rows);
    let [measured, mut target] = declared.targets(&rows);
    let nuisances = declared.nuisances(&rows, &options.estimate)?;
    let of_effort = health::check_effort(&rows, &declared, &nuisances, &measured, &target);
    if of_effort.is_empty() {
        data_health.extend(health::check_unit(&rows, &declared, &nuisances, &measured));
    }
    data_health.extend(of_effort);
    report(watch, 0.5)?;
    let whitener = search::whitener(&rows, declared.inertia);
    take_out_timing(&nuisances, &whitener, &mut target);
    let mut tests = Vec::new();
    if whitener.rows().len() >= LEAST_ROWS {
        let white = White::new(&rows, &whitener, &nuisances, [&measured, &target], declared.inertia);
        let search = Search::new(&rows, &declared.machine, &nuisances, &target, (&whitener, &white, &[]));
        let wanted: Vec<f64> = measured.iter().zip(&target).map(|(measured, left)| measured - left).collect();
        tests.extend(search.leftover(&wanted).unwrap_or_default().iter().map(|found| found.test(&declared)));
    }
    let without = |known: &[f64]| Some(target.iter().zip(known).map(|(left, known)| left + known).collect());
    let carried = carried::carried(&declared, &rows, &target, without);
    data_health.extend(carried::findings(&declared, &logs.iter().collect::<Vec<_>>(), &carried));
    let beyond = |told| health::beyond(&declared, told, rows.speeds(Part::HeldOut)?);
    data_health.extend(declared.told_from.and_then(beyond));
    let floor = Floor::new(&declared, &rows, Part::HeldOut, &target);
    Ok(Residual { errors: errors(&declared, &rows, &measured, &target, &floor), tests, data_health })
}

/// Takes the timing of the torque out of a residual, which is the log's and of no model.
fn take_out_timing(nuisances: &[Nuisance], whitener: &Whitener, target: &mut [f64]) {
    let Some(timing) = nuisances.iter().find(|nuisance| nuisance.is_timing()) else { return };
    let (column, white) = (whitener.apply(&timing.column), whitener.apply(target));
    let blocks = Blocks::new(&[&column], &white, &vec![0; white.len()]);
    let noise = blocks.target_power() / blocks.rows().max(1) as f64;
    if let Some(late) = blocks.fit(&[timing.member(0)], noise) {
        target.iter_mut().zip(&timing.column).for_each(|(target, value)| *target -= late[0] * value);
    }
}

/// Finds what the model lacks.
pub(super) fn refine(
    model: &Model,
    logs: &[Log],
    held_out: &[Log],
    options: &Options,
    watch: Watch<'_>,
) -> Result<Refinement, RefineError> {
    let mut declared = Declared::new(model, options.motor);
    let mut data_health = health::check(logs.iter().chain(held_out), &declared);
    let rows = Rows::new(logs, held_out, declared.names(), Asked::new(options.speeds));
    declared.take_over_free(&rows, &options.estimate);
    declared.zeros_rad = carried::zeros_rad(&declared, &rows);
    let fitted = rows.rows.iter().filter(|row| row.part == Part::Fit).count();
    data_health.extend(health::check_rows(&rows, &declared, fitted, LEAST_ROWS));
    let [measured, target] = declared.targets(&rows);
    let nuisances = declared.nuisances(&rows, &options.estimate)?;
    let of_effort = health::check_effort(&rows, &declared, &nuisances, &measured, &target);
    if of_effort.is_empty() {
        data_health.extend(health::check_unit(&rows, &declared, &nuisances, &measured));
    }
    data_health.extend(of_effort);
    let friction = |nuisance: &Nuisance| nuisance.free && FRICTION.contains(&nuisance.effect);
    let own = if nuisances.iter().any(friction) { rows.speeds(Part::Fit) } else { None };
    let told_from = own.or(declared.told_from);
    let parts = if own.is_some() { &[Part::HeldOut][..] } else { &[Part::Fit, Part::HeldOut] };
    let beyond = |part: &Part| health::beyond(&declared, told_from?, rows.speeds(*part)?);
    data_health.extend(parts.iter().find_map(beyond));
    data_health.extend(own.map(|speeds| health::told_from(&declared, speeds)));
    data_health.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    let unfit = data_health.iter().any(|finding| finding.severity == crate::record::Severity::Error);
    if unfit {
        return Ok(Refinement::unfit(model, data_health));
    }
    let whitener = search::whitener(&rows, declared.inertia);
    let white = White::new(&rows, &whitener, &nuisances, [&measured, &target], declared.inertia);
    let wanted: Vec<f64> = measured.iter().zip(&target).map(|(measured, left)| measured - left).collect();
    let scales = Scales::new(&rows, declared.inertia);
    let both = [measured.as_slice(), &target];
    let bare = carried::fitted(&rows, &declared.machine, &nuisances, both, &whitener, declared.inertia);
    let Some(bare) = bare else {
        data_health.push(health::inseparable(&declared));
        return Ok(Refinement::unfit(model, data_health));
    };
    let mut library = library(&declared.machine, &rows, &whitener, &scales, (&wanted, declared.inertia));
    // Where the effort is not what drives the motion, noise that nobody logged does: it would be taken for an error of
    // the inertia or of the effort.
    if !health::is_driven(&rows, declared.inertia, &bare) {
        library.retain(|candidate| !matches!(candidate.kind.place, Place::Actuator | Place::Parameter));
        data_health.push(health::not_driven(&declared));
    }
    // What is free already is no effect that the model lacks.
    library
        .retain(|candidate| !nuisances.iter().any(|known| known.free && known.effect == candidate.kind.id));
    let mut search =
        Search::new(&rows, &declared.machine, &nuisances, &target, (&whitener, &white, &library));
    let Some(first) = search.fit(&[]) else {
        data_health.push(health::inseparable(&declared));
        return Ok(Refinement::unfit(model, data_health));
    };
    let before_left = search.residual(&first.judged.coefficients);
    let without = |known: &[f64]| {
        let target: Vec<f64> = target.iter().zip(known).map(|(left, known)| left + known).collect();
        let both = [measured.as_slice(), &target];
        carried::fitted(&rows, &declared.machine, &nuisances, both, &whitener, declared.inertia)
    };
    let carried = carried::carried(&declared, &rows, &before_left, without);
    let all_logs: Vec<&Log> = logs.iter().chain(held_out).collect();
    data_health.extend(carried::findings(&declared, &all_logs, &carried));
    data_health.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    let first_error = first.judged.error() / first.blocks.rows() as f64;
    let before_structure = search.leftover(&wanted).unwrap_or_default();
    report(watch, 0.2)?;
    let corrected: Vec<(&'static str, f64)> =
        corrections(&declared, &nuisances, &first, &[]).iter().map(|c| (c.key, c.value)).collect();
    let clean = null::Clean {
        inertia: declared.inertia,
        curve: declared.corrected_curve(&corrected),
        effort_noise: Floor::new(&declared, &rows, Part::Fit, &before_left).effort,
        seed: options.seed,
    };
    search.thresholds = null::thresholds(&clean, &rows, &whitener, &search, &library);
    report(watch, 0.4)?;
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
    let held_out_error = |left: &[f64]| errors::rms(&rows, Part::HeldOut, left);
    report(watch, 0.8)?;
    let mut structure = search.leftover(&wanted).unwrap_or_default();
    structure.retain(Dependence::shows);
    let mut fit = search.fit(&[]).unwrap_or_else(|| first.clone());
    let mut effects = found_effects(&search, &fit, &declared);
    let left = search.residual(&fit.judged.coefficients);
    let floor = Floor::new(&declared, &rows, Part::HeldOut, &left);
    let wrong = !effects.is_empty()
        && (misnamed(first_error, &before_structure, &fit, &structure, &effects)
            || little([&before_left, &left].map(|left| held_out_error(left)), &floor));
    if wrong {
        (effects, fit) = (Vec::new(), first);
        search.picks.clear();
        search.held.clear();
    }
    let left = search.residual(&fit.judged.coefficients);
    let floor = Floor::new(&declared, &rows, Part::HeldOut, &left);
    let before = errors(&declared, &rows, &measured, &before_left, &floor);
    let after = errors(&declared, &rows, &measured, &left, &floor);
    let over_floor = held_out_error(&left) / floor.variance.sqrt();
    let most = if floor.measured { OVER_FLOOR } else { OVER_SENSORS };
    let over_floor = (over_floor > most).then_some(over_floor);
    let corrections = corrections(&declared, &nuisances, &fit, &search.held);
    let structure = if wrong && structure.is_empty() {
        before_structure.into_iter().filter(Dependence::shows).collect()
    } else {
        structure
    };
    let verdict = match (effects.is_empty(), structure.is_empty() && over_floor.is_none() && !wrong) {
        (false, _) => Verdict::EffectsFound,
        (true, false) => Verdict::UnexplainedResidual,
        (true, true) => Verdict::ModelAdequate,
    };
    let values: Vec<(&'static str, f64)> = corrections.iter().map(|c| (c.key, c.value)).collect();
    let candidates = tried::tried(&search.alone, &effects, search.thresholds, declared.machine.kind);
    let explorer = explorer(&declared, &rows, &measured, [&before_left, &left], &floor);
    Ok(Refinement {
        verdict,
        model: refined_model(
            declared.corrected_model(model, options.motor, (&values, told_from)),
            options.motor,
            &effects,
        ),
        effects,
        before,
        after,
        unexplained: unexplained(&declared, &structure, over_floor),
        candidates,
        closed_loop: None,
        next_experiment: None,
        data_health,
        carried,
        parameters: corrections,
        explorer,
        document: Default::default(),
    })
}

/// The model with effects: those that are errors of its numbers put right there, the others added.
fn refined_model(mut model: Model, motor: Motor, effects: &[Found]) -> Model {
    for found in effects {
        match &mut model.rig {
            Rig::Axis(axis) => {
                if !found.effect.declare_in(effects::Declared::Axis(axis)) {
                    axis.effects.push(found.effect.clone());
                }
            }
            Rig::Robot(robot) => {
                let parameters = found.effect.parameters().iter().map(|(key, value)| (key.as_str(), *value));
                let own = found.effect.kind().per_motor().then_some(motor);
                // What a bench shows of a wheel in the air is in the same units on the robot.
                if let Ok(effect) = Effect::new(found.effect.id(), MachineKind::Robot, own, parameters)
                    && !effect.declare_in(effects::Declared::Robot(robot))
                {
                    robot.effects.push(effect);
                }
            }
        }
    }
    model
}

/// The residual at every row.
fn explorer(
    declared: &Declared,
    rows: &Rows,
    measured: &[f64],
    [before, after]: [&Vec<f64>; 2],
    floor: &Floor,
) -> Explorer {
    let at = |of: fn(&trace::Trace) -> &Vec<f64>| -> Vec<f64> {
        rows.rows.iter().map(|row| of(&rows.traces[row.trace])[row.sample]).collect()
    };
    let position = at(|trace| &trace.position);
    let angle = (!declared.is_linear()).then(|| position.clone());
    Explorer {
        channel: declared.channel(),
        variables: declared.variables(
            rows.rows.iter().map(|row| row.time_s).collect(),
            position,
            at(|trace| &trace.speed),
            at(|trace| &trace.acceleration),
            at(|trace| &trace.effort),
        ),
        held_out: rows.rows.iter().map(|row| row.part == Part::HeldOut).collect(),
        measured: measured.to_vec(),
        before: before.clone(),
        after: after.clone(),
        unit: declared.effort_unit(),
        noise_floor: floor.variance.sqrt(),
        orders: Vec::new(),
    }
    .finished(angle.as_deref())
}

/// Whether a smooth function of one variable explains the residual so much better than the effects do that their names
/// are wrong.
fn misnamed(
    first_error: f64,
    before: &[Dependence],
    fit: &Fit,
    after: &[Dependence],
    effects: &[Found],
) -> bool {
    let error = fit.judged.error() / fit.blocks.rows() as f64;
    let explained = first_error - error;
    let best = before.iter().filter(|found| found.shows()).map(|found| found.gain).fold(0.0, f64::max);
    let shown = || after.iter().filter(|found| found.shows());
    let more = shown().map(|found| found.gain).fold(0.0, f64::max);
    let over_speed = shown().any(|found| found.variable == Variable::Speed && found.gain > STILL_OVER_SPEED);
    if more > NEARLY_ALL || (over_speed && effects.iter().all(|found| OF_SPEED.contains(&found.effect.id())))
    {
        return true;
    }
    let rest = error / first_error;
    (best > 0.3 && rest > BETTER * (1.0 - best)) || more * error > MISNAMED * explained
}

/// Whether effects leave most of what is above the noise floor; errors without and with them.
fn little([before, after]: [f64; 2], floor: &Floor) -> bool {
    let explained = before * before - after * after;
    floor.measured
        && after > FAR_OVER_FLOOR * floor.variance.sqrt()
        && explained < LITTLE * (before * before - floor.variance)
}

fn unexplained(declared: &Declared, structure: &[Dependence], over_floor: Option<f64>) -> Unexplained {
    let mut depends_on: Vec<String> = Vec::new();
    let mut shares = Vec::new();
    for found in structure {
        let name = found.variable.name(declared);
        if !depends_on.iter().any(|other| other == name) {
            depends_on.push(name.to_owned());
            shares.push(found.gain);
        }
    }
    let description = match (depends_on.first(), over_floor) {
        (Some(first), _) => format!("{first} still explains {:.1} % of the residual", 100.0 * shares[0]),
        (None, Some(ratio)) => {
            format!(
                "the error is {ratio:.2} times its noise floor, and nothing that was recorded explains it"
            )
        }
        (None, None) => String::new(),
    };
    Unexplained { depends_on, shares, description }
}

fn corrections(declared: &Declared, nuisances: &[Nuisance], fit: &Fit, held: &[Held]) -> Vec<Corrected> {
    let t = student_t_975(fit.blocks.count().max(2) - 1);
    let corrected = |(index, nuisance): (usize, &Nuisance)| {
        let change = fit.judged.coefficients[index];
        let width = t * fit.judged.standard_error(index);
        let own = held.iter().find(|held| held.nuisance == index);
        let ends = own.map_or([change - width, change + width], |held| held.ci95);
        Corrected {
            key: nuisance.key,
            declared: declared.in_file(nuisance),
            value: nuisance.corrected(change),
            ci95: Some(ends.map(|end| nuisance.corrected(end))),
        }
    };
    nuisances.iter().enumerate().filter(|(_, nuisance)| !nuisance.key.is_empty()).map(corrected).collect()
}

/// Picks of one kind are one effect, the strongest harmonics first.
fn found_effects(search: &Search<'_>, fit: &Fit, declared: &Declared) -> Vec<Found> {
    let t = student_t_975(fit.blocks.count().max(2) - 1);
    let mut first = search.nuisances.len();
    let mut firsts = Vec::new();
    for pick in &search.picks {
        firsts.push(first);
        first += pick.columns.len();
    }
    let all = search.residual(&fit.judged.coefficients);
    let held_out: Vec<bool> = search.rows.rows.iter().map(|row| row.part == Part::HeldOut).collect();
    let mut found: Vec<Found> = Vec::new();
    for (index, pick) in search.picks.iter().enumerate() {
        if found.iter().any(|found| found.effect.kind() == pick.kind) {
            continue;
        }
        let mut members: Vec<usize> =
            (index..search.picks.len()).filter(|&i| search.picks[i].kind == pick.kind).collect();
        let size = |i: usize| -> f64 {
            (0..search.picks[i].columns.len()).map(|n| fit.judged.coefficients[firsts[i] + n].powi(2)).sum()
        };
        members.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
        let shape: Vec<f64> = members.iter().flat_map(|&i| search.picks[i].shape.clone()).collect();
        let columns: Vec<usize> =
            members.iter().flat_map(|&i| firsts[i]..firsts[i] + search.picks[i].columns.len()).collect();
        let coefficient = |column: usize| fit.judged.coefficients[column];
        let amplitudes: Vec<f64> = if pick.fixed {
            Vec::new()
        } else {
            columns.iter().map(|&column| pick.amplitude(coefficient(column))).collect()
        };
        let Ok(effect) = Effect::estimated(pick.kind, declared.machine.kind, None, &shape, &amplitudes)
        else {
            continue;
        };
        let shape_widths = search.shape_errors(fit, &members);
        let width =
            |&column: &usize| fit.judged.standard_error(column) * pick.amplitude_slope(coefficient(column));
        let (mut shape_widths, mut widths) = (shape_widths.into_iter(), columns.iter().map(width));
        let parameters = pick.kind.parameters;
        let ci95 = effect
            .parameters()
            .iter()
            .enumerate()
            .map(|(n, (_, value))| {
                let parameter = &parameters[n % parameters.len()];
                let whole = parameter.whole && !declared.is_linear();
                let width = match parameter.role {
                    Role::Shape => shape_widths.next().flatten(),
                    Role::Amplitude => widths.next(),
                };
                let off = if pick.uses_effort() { OFF_WITH_EFFORT } else { OFF } * value;
                let width = width.filter(|_| !whole).map(|width| (t * width).hypot(off));
                width.map(|width| [value - width, value + width])
            })
            .collect();
        let units = (0..effect.parameters().len())
            .map(|n| parameters[n % parameters.len()].unit(declared.machine.kind))
            .collect();
        let gain = search.residual_without(&members).and_then(|without| Gain::new(&without, &all, &held_out));
        let mut ambiguous_with = Vec::new();
        for &member in &members {
            for kind in search.ambiguous_with(member, fit) {
                if !ambiguous_with.contains(&kind) {
                    ambiguous_with.push(kind);
                }
            }
        }
        found.push(Found {
            effect,
            ci95,
            units,
            error_drop_percent: gain.map_or(f64::NAN, |gain| 100.0 * gain.share),
            error_drop_ci95: gain.and_then(|gain| gain.ci95).map(|ends| ends.map(|share| 100.0 * share)),
            ambiguous_with,
        });
    }
    found.sort_by(|a, b| b.error_drop_percent.total_cmp(&a.error_drop_percent));
    found
}

#[cfg(test)]
mod tests;
