//! From picks to effects with sizes, intervals and what they cannot be told from.

use crate::effects::{Effect, EffectKind, KINDS, MachineKind, Role, Term};
use crate::friction::{Stribeck, StribeckParameters};
use crate::identify::quantile::student_t_975;
use crate::model_file::{Model, Rig};
use crate::refine::verdict::{Corrected, Found};

use super::candidates::Candidate;
use super::motion::Readings;
use super::search::{Fit, Search};
use super::trace::{Form, Part};

/// Bias of a gyro below which nobody calls it an effect, rad/s, and standard errors above 0.
const BIAS_RAD_S: f64 = 1e-3;
const BIAS_Z: f64 = 5.0;

/// Laws of the picks with their coefficients, for the motion between the IMU's readings.
pub(super) fn laws(search: &Search<'_>, fit: &Fit) -> Vec<(&'static EffectKind, Term, f64)> {
    let mut found = Vec::new();
    for (pick, first) in placed(search, &search.picks) {
        if pick.form == Form::Law {
            let terms = pick.kind.terms(&search.trace.machine, &pick.shape);
            let sizes = &fit.judged.coefficients[first..];
            found.extend(terms.into_iter().zip(sizes).map(|(term, &size)| (pick.kind, term, size)));
        }
    }
    found
}

/// Picks with the places of their first coefficients.
fn placed<'a>(search: &Search<'_>, picks: &'a [Candidate]) -> Vec<(&'a Candidate, usize)> {
    let mut next = search.nuisances.len();
    let place = |pick: &'a Candidate| {
        let first = next;
        next += pick.white.len();
        (pick, first)
    };
    picks.iter().map(place).collect()
}

/// Shape and amplitudes as the library has them, and half widths of the amplitudes' intervals.
fn as_declared(
    search: &Search<'_>,
    pick: &Candidate,
    values: &[f64],
    widths: &[f64],
) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (mut shape, mut values, mut widths) = (pick.shape.clone(), values.to_vec(), widths.to_vec());
    match pick.form {
        Form::Law if pick.is_fixed() => {
            if matches!(pick.kind.id, "command_delay" | "actuator_lag") {
                shape[0] *= values[0];
                widths[0] *= pick.shape[0];
            }
            values.clear();
        }
        Form::Law => {}
        Form::Late => {
            shape[0] *= values[0];
            widths[0] *= pick.shape[0];
            values.clear();
        }
        // Forward only is half of it in both directions, and the half that differs.
        Form::Forward => {}
        Form::Driven => {
            let inertia = search.trace.machine.parameters.coefficients().c3;
            values[0] /= inertia;
            widths[0] /= inertia;
        }
        Form::Wave => {
            // The crest that is nearest to the start, as a bell of the same steepness.
            let length = pick.shape[1];
            let size = values[0].hypot(values[1]);
            let crest = libm::atan2(values[0], -values[1]) / std::f64::consts::TAU;
            shape = vec![crest * length, length / std::f64::consts::TAU];
            values = vec![size * libm::exp(0.5)];
            widths = vec![widths[0].hypot(widths[1])];
        }
    }
    (shape, values, widths)
}

/// The picks as effects, harmonics of one kind together.
pub(super) fn effects(search: &Search<'_>, picks: &[Candidate], fit: &Fit) -> Vec<Found> {
    let t = student_t_975(fit.blocks.count().max(2) - 1);
    let placed = placed(search, picks);
    let with = held_out_error(search, picks, fit);
    let mut found: Vec<Found> = Vec::new();
    for (index, (pick, first)) in placed.iter().enumerate() {
        if pick.kind.series && found.iter().any(|other| other.effect.kind() == pick.kind) {
            continue;
        }
        let size = |&(pick, first): &(&Candidate, usize)| -> f64 {
            fit.judged.coefficients[first..first + pick.white.len()].iter().map(|v| v * v).sum()
        };
        let mut members = vec![(*pick, *first)];
        if pick.kind.series {
            members.extend(placed[index + 1..].iter().filter(|(other, _)| other.kind == pick.kind));
            members.sort_by(|a, b| size(b).total_cmp(&size(a)));
        }
        let (mut shape, mut values, mut widths) = (Vec::new(), Vec::new(), Vec::new());
        for &(member, first) in &members {
            let coefficients = &fit.judged.coefficients[first..first + member.white.len()];
            let errors: Vec<f64> =
                (first..first + member.white.len()).map(|i| t * fit.judged.standard_error(i)).collect();
            let (own_shape, own_values, own_widths) = as_declared(search, member, coefficients, &errors);
            shape.extend(own_shape);
            values.extend(own_values);
            widths.extend(own_widths);
        }
        let Ok(effect) = Effect::estimated(pick.kind, MachineKind::Robot, None, &shape, &values) else {
            continue;
        };
        let others: Vec<Candidate> = picks
            .iter()
            .filter(|other| !members.iter().any(|(member, _)| std::ptr::eq(*member, *other)))
            .cloned()
            .collect();
        let bare = search.fit(&others);
        let without = bare.as_ref().map_or(f64::NAN, |fit| held_out_error(search, &others, fit));
        let gain = bare.map_or(0.0, |bare| bare.score - fit.score);
        let ambiguous_with =
            if members.len() == 1 { search.rivals(pick, &others, fit.score, gain) } else { Vec::new() };
        let parameters = pick.kind.parameters;
        let sized_shape = matches!(pick.kind.id, "command_delay" | "actuator_lag" | "imu_delay");
        let mut widths = widths.into_iter();
        let ci95 = effect
            .parameters()
            .iter()
            .enumerate()
            .map(|(n, (_, value))| {
                let has = parameters[n % parameters.len()].role == Role::Amplitude || sized_shape;
                let width = if has { widths.next() } else { None };
                width.map(|width| [value - width, value + width])
            })
            .collect();
        let units = (0..effect.parameters().len())
            .map(|n| parameters[n % parameters.len()].unit(MachineKind::Robot))
            .collect();
        found.push(Found {
            effect,
            ci95,
            units,
            error_drop_percent: 100.0 * (1.0 - with / without),
            ambiguous_with,
        });
    }
    found
}

/// Error on held-out rows, both equations measured by their noise.
fn held_out_error(search: &Search<'_>, picks: &[Candidate], fit: &Fit) -> f64 {
    let left = search.left_raw(picks, &fit.judged.coefficients);
    let parts = search.trace.parts();
    let floors = search.channels.floors;
    let sum = |column: &[f64], floor: f64| -> f64 {
        let rows = column.iter().zip(&parts).filter(|(_, part)| **part == Part::HeldOut);
        rows.map(|(value, _)| (value / floor).powi(2)).sum()
    };
    (sum(&left[0], floors[1]) + sum(&left[1], floors[2])).sqrt()
}

/// The model with effects and corrections.
pub(super) fn refined(
    model: &Model,
    search: &Search<'_>,
    picks: &[Candidate],
    fit: &Fit,
    effects: &[Found],
    parameters: &[Corrected],
) -> Model {
    let mut model = model.clone();
    let Rig::Robot(robot) = &mut model.rig else { return model };
    if effects.is_empty() {
        return model;
    }
    let value = |key: &str| parameters.iter().find(|p| p.key == key).map(|p| p.value);
    let mut numbers = robot.parameters;
    numbers.body_mass_kg = value("body_mass_kg").unwrap_or(numbers.body_mass_kg);
    numbers.com_height_m = value("com_height_m").unwrap_or(numbers.com_height_m);
    numbers.body_inertia_kg_m2 = value("body_inertia_kg_m2").unwrap_or(numbers.body_inertia_kg_m2);
    numbers.wheel_inertia_kg_m2 = value("wheel_inertia_kg_m2").unwrap_or(numbers.wheel_inertia_kg_m2);
    numbers.wheel_mass_kg = value("wheel_mass_kg").unwrap_or(numbers.wheel_mass_kg);
    if numbers.validate().is_ok() {
        robot.set_parameters(numbers);
    }
    for (pick, first) in placed(search, picks).iter().filter(|(pick, _)| pick.form == Form::Forward) {
        let size = fit.judged.coefficients[*first];
        let viscous = pick.kind.id == "viscous_asymmetry";
        for curve in robot.friction.iter_mut().flatten() {
            let p = *curve.parameters();
            let raised = if viscous {
                StribeckParameters { viscous_nm_s_rad: p.viscous_nm_s_rad + size, ..p }
            } else {
                StribeckParameters { coulomb_nm: p.coulomb_nm + size, static_nm: p.static_nm + size, ..p }
            };
            *curve = Stribeck::new(raised).unwrap_or(*curve);
        }
    }
    robot.effects.extend(effects.iter().map(|found| found.effect.clone()));
    **robot = robot.with_effects_declared();
    model
}

/// The gyro's bias, from the pitch that it should add up to.
pub(super) fn gyro_bias(logs: &[Readings]) -> Vec<Found> {
    let mut slopes = Vec::new();
    for log in logs {
        let seconds = 4.0;
        let rows = (seconds / log.dt_s) as usize;
        let fresh = &log.fresh;
        for block in fresh.chunk_by(|a, b| a / rows == b / rows).filter(|block| block.len() > 20) {
            let (first, last) = (block[0], block[block.len() - 1]);
            let mut turned = 0.0;
            for pair in block.windows(2) {
                let time = (pair[1] - pair[0]) as f64 * log.dt_s;
                turned += 0.5 * time * (log.rate_rad_s[pair[0]] + log.rate_rad_s[pair[1]]);
            }
            let time = (last - first) as f64 * log.dt_s;
            slopes.push((turned - (log.pitch_rad[last] - log.pitch_rad[first])) / time);
        }
    }
    if slopes.len() < 3 {
        return Vec::new();
    }
    let count = slopes.len() as f64;
    let mean = slopes.iter().sum::<f64>() / count;
    let variance = slopes.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = (variance / count).sqrt();
    if mean.abs() < BIAS_RAD_S.max(BIAS_Z * error) {
        return Vec::new();
    }
    let Some(kind) = KINDS.iter().copied().find(|kind| kind.id == "gyro_bias") else { return Vec::new() };
    let Ok(effect) = Effect::estimated(kind, MachineKind::Robot, None, &[], &[mean]) else {
        return Vec::new();
    };
    let width = student_t_975(slopes.len() - 1) * error;
    vec![Found {
        effect,
        ci95: vec![Some([mean - width, mean + width])],
        units: kind.parameters.iter().map(|parameter| parameter.unit(MachineKind::Robot)).collect(),
        error_drop_percent: 100.0 * (1.0 - (variance / (variance + mean * mean)).sqrt()),
        ambiguous_with: Vec::new(),
    }]
}
