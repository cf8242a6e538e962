//! The answer of a search: effects with their sizes and intervals, the numbers estimated along, the refined model.

use crate::effects::{self, EffectError, EffectKind, Parameter, Role};
use crate::model::{Effect, MachineKind, Model, Motor, Rig};
use crate::refine::{
    Explorer,
    corrected::Coefficient,
    gain::Gain,
    verdict::{Corrected, Found, Unexplained},
};
use crate::signal::quantile::student_t_975;

use super::candidates::Candidate;
use super::floor::Floor;
use super::leftover::Dependence;
use super::nuisance::Nuisance;
use super::regression::Regression;
use super::rig::Declared;
use super::search::{Fit, Held, Search};
use super::trace::Trace;

/// What the method itself is off by as a share of a value, as made logs show it; with noise of the effort in the columns
/// more. It counts in intervals.
const OFF: f64 = 0.01;
const OFF_WITH_EFFORT: f64 = 0.03;

/// Picks of one kind are one effect, the strongest harmonics first.
pub(super) fn effects(search: &Search<'_>, fit: &Fit, declared: &Declared) -> Vec<Found> {
    let left = search.residual(&fit.judged.coefficients);
    let held_out = search.rows.held_out();
    let mut found: Vec<Found> = Vec::new();
    for (place, pick) in search.picks.iter().enumerate() {
        if found.iter().any(|found| found.effect.kind() == pick.kind) {
            continue;
        }
        let series = Series::new(search, fit, declared.machine.kind, place);
        let Ok(effect) = series.effect() else { continue };
        let without = search.residual_without(&series.members);
        let gain = without.and_then(|without| Gain::new(&without, &left, &held_out));
        found.push(Found {
            ci95: series.intervals(&effect),
            units: series.units(&effect),
            error_drop_percent: gain.map_or(f64::NAN, |gain| 100.0 * gain.share),
            error_drop_ci95: gain.and_then(|gain| gain.ci95).map(|ends| ends.map(|share| 100.0 * share)),
            ambiguous_with: series.ambiguous_with(),
            effect,
        });
    }
    found.sort_by(|a, b| b.error_drop_percent.total_cmp(&a.error_drop_percent));
    found
}

/// The picks of one kind, from one of them on.
struct Series<'a> {
    search: &'a Search<'a>,
    fit: &'a Fit,
    machine: MachineKind,
    kind: &'static EffectKind,
    /// Places among the picks, the strongest first.
    members: Vec<usize>,
    /// Their columns in the fit.
    columns: Vec<usize>,
}

impl<'a> Series<'a> {
    fn new(search: &'a Search<'a>, fit: &'a Fit, machine: MachineKind, from: usize) -> Self {
        let kind = search.picks[from].kind;
        let mut first = search.nuisances.len();
        let mut own: Vec<(usize, std::ops::Range<usize>)> = Vec::new();
        for (place, pick) in search.picks.iter().enumerate() {
            let columns = first..first + pick.columns.len();
            first = columns.end;
            if place >= from && pick.kind == kind {
                own.push((place, columns));
            }
        }
        let size = |columns: &std::ops::Range<usize>| -> f64 {
            columns.clone().map(|column| fit.judged.coefficients[column].powi(2)).sum()
        };
        own.sort_by(|(_, a), (_, b)| size(b).total_cmp(&size(a)));
        let members = own.iter().map(|(place, _)| *place).collect();
        let columns = own.into_iter().flat_map(|(_, columns)| columns).collect();
        Self { search, fit, machine, kind, members, columns }
    }

    /// All members are candidates of one kind: what the first one says of the kind holds for each.
    fn first(&self) -> &Candidate {
        &self.search.picks[self.members[0]]
    }

    fn coefficient(&self, column: usize) -> f64 {
        self.fit.judged.coefficients[column]
    }

    fn effect(&self) -> Result<Effect, EffectError> {
        let shape: Vec<f64> =
            self.members.iter().flat_map(|&member| self.search.picks[member].shape.clone()).collect();
        let first = self.first();
        let amplitudes: Vec<f64> = if first.fixed {
            Vec::new()
        } else {
            self.columns.iter().map(|&column| first.amplitude(self.coefficient(column))).collect()
        };
        Effect::estimated(self.kind, self.machine, None, &shape, &amplitudes)
    }

    fn parameter(&self, place: usize) -> &'static Parameter {
        &self.kind.parameters[place % self.kind.parameters.len()]
    }

    fn units(&self, effect: &Effect) -> Vec<&'static str> {
        (0..effect.parameters().len()).map(|place| self.parameter(place).unit(self.machine)).collect()
    }

    /// 95 % intervals of an effect's parameters; none of whole numbers and of shapes that the log does not bound.
    fn intervals(&self, effect: &Effect) -> Vec<Option<[f64; 2]>> {
        let t = student_t_975(self.fit.blocks.count().max(2) - 1);
        let first = self.first();
        let width = |&column: &usize| {
            self.fit.judged.standard_error(column) * first.amplitude_slope(self.coefficient(column))
        };
        let mut shape_widths = self.search.shape_errors(self.fit, &self.members).into_iter();
        let mut widths = self.columns.iter().map(width);
        let interval = |(place, (_, value)): (usize, &(String, f64))| {
            let parameter = self.parameter(place);
            let is_whole = parameter.whole && self.machine != MachineKind::Linear;
            let width = match parameter.role {
                Role::Shape => shape_widths.next().flatten(),
                Role::Amplitude => widths.next(),
            };
            let off = if first.uses_effort() { OFF_WITH_EFFORT } else { OFF } * value;
            let width = width.filter(|_| !is_whole).map(|width| (t * width).hypot(off));
            width.map(|width| [value - width, value + width])
        };
        effect.parameters().iter().enumerate().map(interval).collect()
    }

    /// Kinds that say the same as one of the members on this log.
    fn ambiguous_with(&self) -> Vec<&'static EffectKind> {
        let mut found = Vec::new();
        for kind in self.members.iter().flat_map(|&member| self.search.ambiguous_with(member, self.fit)) {
            if !found.contains(&kind) {
                found.push(kind);
            }
        }
        found
    }
}

/// The declared numbers as a fit has them.
pub(super) fn corrections(
    declared: &Declared,
    nuisances: &[Nuisance],
    fit: &Fit,
    held: &[Held],
) -> Vec<Corrected> {
    let quantile = student_t_975(fit.blocks.count().max(2) - 1);
    let spread = fit.blocks.spread(&fit.members, fit.noise);
    let corrected = |(index, nuisance): (usize, &Nuisance)| {
        let value = fit.judged.coefficients[index];
        let spread = spread.as_ref();
        let own = held.iter().find(|held| held.nuisance == index);
        let mut found = Coefficient {
            value,
            estimate: spread.map_or(value, |spread| spread.estimates[index]),
            error: spread.map_or(f64::INFINITY, |spread| spread.standard_error(index)),
            alone: spread.map_or(f64::INFINITY, |spread| spread.alone[index]),
            tolerance: if nuisance.free { f64::INFINITY } else { nuisance.tolerance },
            quantile,
        }
        .corrected(nuisance.key, declared.in_file(nuisance), |change| nuisance.corrected(change));
        if let Some(held) = own {
            found.ci95 = Some(held.ci95.map(|end| nuisance.corrected(end)));
        }
        found
    };
    nuisances.iter().enumerate().filter(|(_, nuisance)| !nuisance.key.is_empty()).map(corrected).collect()
}

/// The corrections by their keys.
pub(super) fn values(corrections: &[Corrected]) -> Vec<(&'static str, f64)> {
    corrections.iter().map(|own| (own.key, own.value)).collect()
}

/// The model with effects: those that are errors of its numbers put right there, the others added.
pub(super) fn refined_model(mut model: Model, motor: Motor, effects: &[Found]) -> Model {
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

/// What is left and depends on something that was recorded, or is so many times the noise floor.
pub(super) fn unexplained(
    declared: &Declared,
    structure: &[Dependence],
    over_floor: Option<f64>,
) -> Unexplained {
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
    Unexplained { depends_on, fractions: shares, description }
}

/// The residual at every row.
pub(super) fn explorer(
    Regression { declared, rows, measured, .. }: &Regression,
    [before, after]: [&[f64]; 2],
    floor: &Floor,
) -> Explorer {
    let at = |of: fn(&Trace) -> &Vec<f64>| -> Vec<f64> {
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
        held_out: rows.held_out(),
        measured: measured.clone(),
        before: before.to_vec(),
        after: after.to_vec(),
        unit: declared.effort_unit(),
        noise_floor: floor.variance.sqrt(),
        orders: Vec::new(),
    }
    .finished(angle.as_deref())
}
