//! From picks to effects with sizes, intervals and what they cannot be told from.

use crate::effects::{EffectKind, Form, KINDS, Role, Term};
use crate::model::{Effect, MachineKind, Model, ModelParameter, Rig};
use crate::refine::verdict::{Corrected, Found};
use crate::signal::quantile::student_t_975;

use super::candidates::Candidate;
use super::motion::Readings;
use super::search::{Fit, Search};
use super::trace::Part;
use super::uncertainty::Uncertainty;

/// Bias of a gyro below which nobody calls it an effect, rad/s, and standard errors above 0.
const BIAS_RAD_S: f64 = 1e-3;
const BIAS_Z: f64 = 5.0;
/// Time over which a gyro is held against the pitch, s.
const BIAS_BLOCK_S: f64 = 4.0;

/// Share of a value by which the method itself may be off: columns come from a motion that is filled in between the
/// IMU's readings.
const OF_THE_METHOD: f64 = 0.02;

/// Laws of the picks with their coefficients, for the motion between the IMU's readings.
pub(super) fn laws(search: &Search<'_>, fit: &Fit) -> Vec<(&'static EffectKind, Term, f64)> {
    let mut found = Vec::new();
    for (pick, first) in search.placed(&search.picks) {
        if pick.form == Form::Law {
            let terms = pick.kind.terms(&search.trace.machine, &pick.shape);
            let sizes = &fit.judged.coefficients[first..];
            found.extend(terms.into_iter().zip(sizes).map(|(term, &size)| (pick.kind, term, size)));
        }
    }
    found
}

/// A pick as the library has it: shape and amplitudes, with the half widths of their intervals.
struct Declared {
    shape: Vec<(f64, Option<f64>)>,
    sizes: Vec<(f64, f64)>,
}

fn as_declared(
    search: &Search<'_>,
    pick: &Candidate,
    sizes: &[(f64, f64)],
    shapes: &[Option<f64>],
) -> Declared {
    let shape: Vec<(f64, Option<f64>)> = pick.shape.iter().copied().zip(shapes.iter().copied()).collect();
    let sizes = sizes.to_vec();
    match pick.form {
        _ if pick.is_sized() => {
            let (factor, width) = sizes[0];
            let mut shape = shape;
            shape[0] = (pick.shape[0] * factor, Some(pick.shape[0] * width));
            Declared { shape, sizes: Vec::new() }
        }
        _ if pick.is_fixed() => Declared { shape, sizes: Vec::new() },
        // Forward only is half of it in both directions, and the half that differs.
        Form::Law | Form::Forward(_) | Form::Late => Declared { shape, sizes },
        Form::Driven => {
            let inertia = search.trace.machine.parameters.coefficients().c3;
            Declared { shape, sizes: vec![(sizes[0].0 / inertia, sizes[0].1 / inertia)] }
        }
        Form::Wave => {
            // The crest that is nearest to the start, as a bell of the same steepness.
            let length = pick.shape[1];
            let (cos, sin) = (sizes[0], sizes[1]);
            let crest = libm::atan2(cos.0, -sin.0) / std::f64::consts::TAU;
            Declared {
                shape: vec![(crest * length, None), (length / std::f64::consts::TAU, None)],
                sizes: vec![(cos.0.hypot(sin.0) * libm::exp(0.5), cos.1.hypot(sin.1) * libm::exp(0.5))],
            }
        }
    }
}

/// The place of the pick whose size is least sure, where its 95 % interval has 0 in it.
pub(super) fn unsure(search: &Search<'_>, fit: &Fit) -> Option<usize> {
    let t = student_t_975(fit.blocks.count().max(2) - 1);
    let uncertainty = Uncertainty::new(search, &search.picks, fit);
    let z = |(pick, first): (&Candidate, usize)| {
        let own = first..first + pick.white.len();
        own.map(|i| (fit.judged.coefficients[i] / uncertainty.sizes[i]).powi(2)).sum::<f64>().sqrt()
    };
    let of_picks = search.placed(&search.picks).into_iter().map(z).enumerate();
    of_picks.filter(|(_, z)| *z <= t).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(place, _)| place)
}

/// The picks as effects, harmonics of one kind together: their sizes from `fit`, the errors with them from `fitted`, which
/// is as the log alone has it.
pub(super) fn effects(search: &Search<'_>, picks: &[Candidate], fit: &Fit, fitted: &Fit) -> Vec<Found> {
    let t = student_t_975(fit.blocks.count().max(2) - 1);
    let placed = search.placed(picks);
    let uncertainty = Uncertainty::new(search, picks, fit);
    let with = held_out_error(search, picks, fitted);
    let mut found: Vec<Found> = Vec::new();
    for (index, (pick, first)) in placed.iter().enumerate() {
        if pick.kind.series() && found.iter().any(|other| other.effect.kind() == pick.kind) {
            continue;
        }
        let size = |&(pick, first): &(&Candidate, usize)| -> f64 {
            fit.judged.coefficients[first..first + pick.white.len()].iter().map(|v| v * v).sum()
        };
        let mut members = vec![(*pick, *first)];
        if pick.kind.series() {
            members.extend(placed[index + 1..].iter().filter(|(other, _)| other.kind == pick.kind));
            members.sort_by(|a, b| size(b).total_cmp(&size(a)));
        }
        let (mut shape, mut sizes) = (Vec::new(), Vec::new());
        for &(member, first) in &members {
            let place = picks.iter().position(|pick| std::ptr::eq(pick, member)).unwrap_or(0);
            let own = first..first + member.white.len();
            let width = |value: f64, error: f64| (t * error).hypot(OF_THE_METHOD * value);
            let own: Vec<(f64, f64)> = own
                .map(|i| {
                    (fit.judged.coefficients[i], width(fit.judged.coefficients[i], uncertainty.sizes[i]))
                })
                .collect();
            let shapes: Vec<Option<f64>> = uncertainty.shapes[place]
                .iter()
                .zip(&member.shape)
                .map(|(error, value)| error.map(|error| width(*value, error)))
                .collect();
            let declared = as_declared(search, member, &own, &shapes);
            shape.extend(declared.shape);
            sizes.extend(declared.sizes);
        }
        let first = |list: &[(f64, f64)]| -> Vec<f64> { list.iter().map(|(value, _)| *value).collect() };
        let shape_values: Vec<f64> = shape.iter().map(|(value, _)| *value).collect();
        let Ok(effect) =
            Effect::estimated(pick.kind, MachineKind::Robot, None, &shape_values, &first(&sizes))
        else {
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
        let (mut shape_widths, mut widths) =
            (shape.iter().map(|(_, width)| *width), sizes.iter().map(|(_, width)| Some(*width)));
        let mut interval = |(n, (_, value)): (usize, &(String, f64))| {
            let is_size = parameters[n % parameters.len()].role == Role::Amplitude;
            let width = if is_size { widths.next() } else { shape_widths.next() };
            width.flatten().map(|width| [value - width, value + width])
        };
        let ci95 = effect.parameters().iter().enumerate().map(&mut interval).collect();
        let units = (0..effect.parameters().len())
            .map(|n| parameters[n % parameters.len()].unit(MachineKind::Robot))
            .collect();
        found.push(Found {
            effect,
            ci95,
            units,
            error_drop_percent: 100.0 * (1.0 - with / without),
            error_drop_ci95: None,
            ambiguous_with,
        });
    }
    found
}

/// Error on held-out rows, both equations measured by their noise.
pub(super) fn held_out_error(search: &Search<'_>, picks: &[Candidate], fit: &Fit) -> f64 {
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
    for (row, place) in ModelParameter::of_robot() {
        let number = place(&mut numbers);
        *number = value(row.key).unwrap_or(*number);
    }
    if numbers.validate().is_ok() {
        robot.set_parameters(numbers);
    }
    for (pick, first) in search.placed(picks) {
        let Form::Forward(both_ways) = pick.form else { continue };
        let size = fit.judged.coefficients[first];
        robot.effects.extend(Effect::estimated(both_ways, MachineKind::Robot, None, &[], &[size]));
    }
    robot.effects.extend(effects.iter().map(|found| found.effect.clone()));
    **robot = robot.with_effects_declared();
    model
}

/// What the gyro gains on the pitch in each block of some seconds, rad/s; the last third of a log apart where `split`.
fn drifts(logs: &[Readings], split: bool) -> [Vec<f64>; 2] {
    let mut found = [Vec::new(), Vec::new()];
    for log in logs {
        let rows = (BIAS_BLOCK_S / log.dt_s) as usize;
        let end = if split { 2 * log.rows() / 3 } else { log.rows() };
        for block in log.fresh.chunk_by(|a, b| a / rows == b / rows).filter(|block| block.len() > 20) {
            let (first, last) = (block[0], block[block.len() - 1]);
            let mut turned = 0.0;
            for pair in block.windows(2) {
                let time = (pair[1] - pair[0]) as f64 * log.dt_s;
                turned += 0.5 * time * (log.rate_rad_s[pair[0]] + log.rate_rad_s[pair[1]]);
            }
            let time = (last - first) as f64 * log.dt_s;
            let slope = (turned - (log.pitch_rad[last] - log.pitch_rad[first])) / time;
            if last < end {
                found[0].push(slope);
            } else if first >= end {
                found[1].push(slope);
            }
        }
    }
    found
}

/// The gyro's bias, from the pitch that it should add up to; only where it also adds up better on what is held out.
pub(super) fn gyro_bias(logs: &[Readings], held_out: &[Readings]) -> Option<Found> {
    let [slopes, apart] = drifts(logs, held_out.is_empty());
    let apart =
        if held_out.is_empty() { apart } else { drifts(held_out, false).into_iter().flatten().collect() };
    if slopes.len() < 3 || apart.is_empty() {
        return None;
    }
    let count = slopes.len() as f64;
    let mean = slopes.iter().sum::<f64>() / count;
    let variance = slopes.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = (variance / count).sqrt();
    let power = |bias: f64| apart.iter().map(|drift| (drift - bias).powi(2)).sum::<f64>();
    let drop = 1.0 - (power(mean) / power(0.0)).sqrt();
    if mean.abs() < BIAS_RAD_S.max(BIAS_Z * error) || drop.is_nan() || drop <= 0.0 {
        return None;
    }
    let kind = KINDS.iter().copied().find(|kind| kind.id == "gyro_bias")?;
    let effect = Effect::estimated(kind, MachineKind::Robot, None, &[], &[mean]).ok()?;
    let width = student_t_975(slopes.len() - 1) * error;
    Some(Found {
        effect,
        ci95: vec![Some([mean - width, mean + width])],
        units: kind.parameters.iter().map(|parameter| parameter.unit(MachineKind::Robot)).collect(),
        error_drop_percent: 100.0 * drop,
        error_drop_ci95: None,
        ambiguous_with: Vec::new(),
    })
}
