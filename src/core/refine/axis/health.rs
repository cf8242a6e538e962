//! What makes a log unfit to refine an axis with, said before any effect is named.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::identify::motion::kinematics::direction;
use crate::record::runs::usual_run;
use crate::record::{self, HealthFinding, Log, Severity};
use crate::refine::rates;
use crate::refine::select::{Blocks, Member};

use super::dead;
use super::nuisance::Nuisance;
use super::rig::Declared;
use super::trace::{Part, Rows, Trace};

/// Fewest rows in a second at which friction and harmonics of a motor's loop are seen.
const SLOWEST_HZ: f64 = 45.0;
/// A measured effort between these shares of the wanted one has the right unit.
const RIGHT_UNIT: [f64; 2] = [0.5, 2.0];
/// Share of the effort that the declared model must explain, whatever its factor, before that factor is believed.
const COHERENT: f64 = 0.6;
/// The same where the column of the speed is off by that factor too.
const COHERENT_WITH_GEAR: f64 = 0.3;
/// The same of the whole effort, where nothing but it says that the factor is wrong.
const COHERENT_ALONE: f64 = 0.8;
/// Degrees in a radian, 1/s of a rev/min, and powers of ten: factors of a unit and of no gear.
const UNITS: [f64; 5] = [57.296, 9.549, 10.0, 100.0, 1000.0];
/// A position in another unit makes the inertia look as many times larger or smaller: units that are taken by mistake, in
/// rad and m, how near such a factor has to come, how sure it has to be, and the share of the effort that it explains.
const TURNS: [(&str, f64); 2] = [("degrees", 180.0 / PI), ("turns", 1.0 / TAU)];
const WAYS: [(&str, f64); 2] = [("millimetres", 1000.0), ("centimetres", 100.0)];
const NEAR_UNIT: f64 = 0.15;
const SURE_UNIT: f64 = 0.05;
const DRIVES: f64 = 0.3;
/// Blocks that tell how sure it is.
const UNIT_BLOCKS: usize = 12;
/// Share of the acceleration that is not in the column of the speed from which on they have nothing to do with each other.
const INCOHERENT: f64 = 0.5;
/// Share of rows at a limit above which an effort is cut off.
const CUT_OFF: f64 = 0.1;
/// Power of the effort that accelerates over that of what is left of the effort, from which on the effort drives the
/// motion: at even speeds under noise that nobody logged at most 0.75, on logs that are driven 3 and more.
const DRIVEN: f64 = 1.0;
/// How many times beyond the speeds that friction was told from a log may go.
const FASTER: f64 = 1.5;
/// Share of the highest speed below which the lowest is next to rest.
const AT_REST: f64 = 0.1;
/// Shortest motion that an effect can be checked on, s.
const LEAST_HELD_OUT_S: f64 = 0.2;
/// Runs of equal values that are usual, from which on a column is held.
const HELD_ROWS: usize = 3;

fn finding(severity: Severity, column: &str, problem: String, remedy: impl Into<String>) -> HealthFinding {
    HealthFinding::new(severity, column, problem, remedy.into())
}

/// Findings about logs, those that are held out among them.
pub(super) fn check<'a>(logs: impl IntoIterator<Item = &'a Log>, declared: &Declared) -> Vec<HealthFinding> {
    let logs: Vec<&Log> = logs.into_iter().collect();
    let mut found: Vec<HealthFinding> = logs.iter().flat_map(|log| record::data_health(log)).collect();
    found.extend(rates::check(&logs));
    let names = declared.names();
    for log in logs {
        let column = |name: &str| log.column(name).unwrap_or_default();
        if let Some(row_s) = record::row_time_s(column("time_s"))
            && 1.0 / row_s < SLOWEST_HZ
        {
            found.push(finding(
                Severity::Error,
                "time_s",
                format!("{:.1} rows a second are too few to see what moves a motor", 1.0 / row_s),
                "record 50 rows a second or more, better as many as the loop has",
            ));
        }
        for name in [names.position, names.effort] {
            let values = column(name);
            if values.windows(2).all(|pair| pair[0] == pair[1] || pair.iter().any(|value| value.is_nan())) {
                found.push(finding(
                    Severity::Error,
                    name,
                    "the value does not change".to_owned(),
                    "check that the sensor is connected, or record the axis while it moves",
                ));
            }
            let held = usual_run(values);
            if held >= HELD_ROWS && name == names.position {
                found.push(finding(
                    Severity::Warning,
                    name,
                    format!("each value is held for {held} rows: the motion in between is not known"),
                    "record only fresh values, or at the sensor's own rate",
                ));
            }
        }
        let efforts = column(names.effort);
        let (times, positions) = (column("time_s"), column(names.position));
        let dead = |name: &str, rows: Range<usize>, goes_on: &str| {
            let [from_s, to_s] = [times[rows.start], times[rows.end - 1]];
            let problem = format!(
                "the value stays the same from {from_s:.1} to {to_s:.1} s while {goes_on} goes on as before: the sensor is \
                 dead there"
            );
            let remedy = "check the sensor and its cable, or cut the log to the part before";
            finding(Severity::Error, name, problem, remedy)
        };
        found.extend(dead::position(positions, efforts).map(|rows| dead(names.position, rows, "the effort")));
        // A load swings without a torque.
        let effort = dead::effort(positions, efforts).filter(|_| declared.gravity == 0.0);
        found.extend(effort.map(|rows| dead(names.effort, rows, "the motion")));
        let share = share_at_limits(efforts);
        if share > CUT_OFF && share < 1.0 {
            found.push(finding(
                Severity::Error,
                names.effort,
                format!(
                    "{:.0} % of the rows are at the largest or smallest value: it is cut off there",
                    100.0 * share
                ),
                "record the torque that really acts, or a motion that needs less",
            ));
        }
    }
    found
}

/// Whether what accelerates the axis is more than what is left of the effort.
pub(super) fn is_driven(rows: &Rows, inertia: f64, left: &[f64]) -> bool {
    let acceleration = rows.column(Trace::second_difference);
    let fitted = || (0..rows.rows.len()).filter(|&row| rows.rows[row].part == Part::Fit);
    let driven: f64 = fitted().map(|row| (inertia * acceleration[row]).powi(2)).sum();
    let rest: f64 = fitted().map(|row| left[row] * left[row]).sum();
    driven > DRIVEN * rest
}

/// The note that errors of declared numbers and of the effort's own way are not told.
pub(super) fn not_driven(declared: &Declared) -> HealthFinding {
    let problem =
        "the motion is so even that noise accelerates the axis as much as the logged effort does: errors \
                   of declared numbers and of the effort's way to the axis are not looked for"
            .to_owned();
    let remedy = "excite the axis with efforts of many frequencies";
    finding(Severity::Warning, declared.names().effort, problem, remedy)
}

/// The finding that the motion does not tell the parameters apart.
pub(super) fn inseparable(declared: &Declared) -> HealthFinding {
    finding(
        Severity::Error,
        declared.names().position,
        "the motion does not tell the model's parameters apart".to_owned(),
        "record motion at several speeds in both directions, or free fewer parameters",
    )
}

/// Share of rows in runs at the largest and smallest value.
fn share_at_limits(values: &[f64]) -> f64 {
    let range =
        values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)]);
    let flat = values.chunk_by(|a, b| a == b).filter(|run| run.len() > 2 && range.contains(&run[0]));
    flat.map(<[f64]>::len).sum::<usize>() as f64 / values.len().max(1) as f64
}

/// Findings about the rows that are left, and about the column of the speed.
pub(super) fn check_rows(
    rows: &Rows,
    declared: &Declared,
    fitted: usize,
    needed: usize,
) -> Vec<HealthFinding> {
    let (names, mut found) = (declared.names(), Vec::new());
    if fitted < needed {
        let problem = format!(
            "{fitted} rows in motion are left to fit after filtering at {:.0} Hz, and {needed} are needed; {:.0} % of \
             the time the axis rests",
            rows.kernel.cutoff_hz,
            100.0 * rows.rest_share
        );
        let remedy = "record at least ten seconds of motion in both directions";
        found.push(finding(Severity::Error, names.position, problem, remedy));
    } else if !rows.moves() {
        let problem = "the axis hardly moves: what there is may be noise of the position".to_owned();
        let remedy = "record motion at several speeds in both directions";
        found.push(finding(Severity::Error, names.position, problem, remedy));
    }
    if rows.agreement.is_some_and(|agreement| agreement.incoherent >= INCOHERENT) {
        let problem = format!(
            "the speed does not follow the change of `{}`: a dead or mistaken sensor",
            names.position
        );
        let remedy = "nothing has to be done: the speed is taken from the position";
        found.push(finding(Severity::Warning, names.speed, problem, remedy));
    }
    if let Some(speed) = rows.agreement.filter(|agreement| agreement.incoherent < INCOHERENT) {
        let map = |factor: f64| format!("read it with --map {0}={0}*{factor:.4}", names.speed);
        if (speed.factor - 1.0).abs() > 0.05 {
            let problem = format!(
                "the change of `{}` is {:.3} times this speed: they do not agree",
                names.position, speed.factor
            );
            found.push(finding(Severity::Warning, names.speed, problem, map(speed.factor)));
        } else if speed.lag_s > 0.75 * rows.kernel.step_s {
            let problem = format!(
                "the speed is {:.1} ms later than `{}` changes: a filter of the driver",
                1e3 * speed.lag_s,
                names.position
            );
            let remedy = "nothing has to be done: the speed is taken from the position";
            found.push(finding(Severity::Warning, names.speed, problem, remedy));
        }
    }
    found
}

/// The finding that too little of what is held out is in motion.
pub(super) fn check_held_out(declared: &Declared, rows: &Rows, held_out: usize) -> Option<HealthFinding> {
    let seconds = held_out as f64 * rows.kernel.step_s * rows.kernel.thinning as f64;
    if seconds >= LEAST_HELD_OUT_S {
        return None;
    }
    let problem = format!(
        "the axis moves for only {seconds:.1} s of what is held out and {LEAST_HELD_OUT_S} s are needed: on them nothing \
         can be checked"
    );
    let remedy = "hold out a log in which the axis moves for some seconds";
    Some(finding(Severity::Error, declared.names().position, problem, remedy))
}

/// The finding that rows go beyond the speeds that friction was told from.
pub(super) fn beyond(declared: &Declared, told_from: [f64; 2], seen: [f64; 2]) -> Option<HealthFinding> {
    // Down to rest is as good as rest.
    let fast_alone = told_from[0] > AT_REST * told_from[1];
    let (faster, slower) = (seen[1] > FASTER * told_from[1], fast_alone && FASTER * seen[0] < told_from[0]);
    let unit = declared.speed_unit();
    let problem = || {
        format!(
            "the log has speeds from {:.2} to {:.2} {unit}, and the friction of the model was told from {:.2} to {:.2} {unit}: \
             beyond them it is a guess, and may be far off",
            seen[0], seen[1], told_from[0], told_from[1]
        )
    };
    let remedy = "let these logs tell friction (--estimate all), or declare what was measured at such speeds";
    (faster || slower).then(|| finding(Severity::Warning, declared.names().position, problem(), remedy))
}

/// The note on the speeds that friction is told from.
pub(super) fn told_from(declared: &Declared, [low, high]: [f64; 2]) -> HealthFinding {
    let unit = declared.speed_unit();
    let problem = format!(
        "friction is told from speeds of {low:.2} to {high:.2} {unit}: slower or faster it is a guess"
    );
    let remedy = "nothing has to be done; the refined model says so where a log goes beyond them";
    finding(Severity::Info, declared.names().position, problem, remedy)
}

/// Whether a factor is that of a unit.
fn is_unit(ratio: f64) -> bool {
    UNITS.iter().any(|unit| (ratio.abs().ln().abs() - unit.ln()).abs() < 0.03)
}

/// The finding that the column of the speed is that of a motor before a gear, and so is the effort beside it.
fn before_a_gear(rows: &Rows, declared: &Declared) -> Option<HealthFinding> {
    let ratio = rows.agreement.filter(|speed| speed.incoherent < INCOHERENT)?.factor;
    if (RIGHT_UNIT[0]..=RIGHT_UNIT[1]).contains(&ratio) || is_unit(ratio) {
        return None;
    }
    let names = declared.names();
    let problem = format!(
        "`{}` changes {ratio:.3} times as fast as `{}` says: a gear lies between, and the effort of the motor before it \
         cannot be the one that acts on the axis",
        names.position, names.speed
    );
    let remedy = format!(
        "read both with the gear's ratio: --map {0}={0}*{ratio:.3} and the same of the speed",
        names.effort
    );
    Some(finding(Severity::Error, names.effort, problem, remedy))
}

/// Whether the position is in the unit that its column says: nothing else makes an inertia so many times as large.
pub(super) fn check_unit(
    rows: &Rows,
    declared: &Declared,
    nuisances: &[Nuisance],
    measured: &[f64],
) -> Option<HealthFinding> {
    if declared.gravity != 0.0 || nuisances.iter().any(|nuisance| nuisance.free && nuisance.is_inertia()) {
        return None;
    }
    let fitted: Vec<usize> = (0..rows.rows.len()).filter(|&row| rows.rows[row].part == Part::Fit).collect();
    let at = |column: &[f64]| -> Vec<f64> { fitted.iter().map(|&row| column[row]).collect() };
    let speed = rows.pick(|trace, sample| trace.speed[sample]);
    let columns = [
        at(&rows.column(Trace::second_difference)),
        at(&speed),
        at(&speed.iter().map(|&speed| direction(speed)).collect::<Vec<_>>()),
        vec![1.0; fitted.len()],
    ];
    let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let block: Vec<usize> = (0..fitted.len()).map(|row| row * UNIT_BLOCKS / fitted.len()).collect();
    let blocks = Blocks::new(&views, &at(measured), &block);
    let members = [0, 1, 2, 3].map(Member::free);
    let judged = blocks.judge(&members, 0.0)?;
    let inertia = judged.coefficients[0];
    let driven = blocks.power_beyond(&members[1..], 0.0, &[(0, inertia)])?;
    let is_sure = judged.standard_error(0) < SURE_UNIT * inertia && driven > DRIVES * (driven + judged.left);
    let units = if declared.is_linear() { WAYS } else { TURNS };
    let of = |(_, factor): &&(&str, f64)| (inertia * factor / declared.inertia - 1.0).abs() < NEAR_UNIT;
    let (unit, factor) = units.iter().find(of).filter(|_| is_sure)?;
    let name = declared.names().position;
    let problem = format!(
        "the effort accelerates the axis as if this column were in {unit}: its unit is wrong, or the declared inertia {:.1} \
         times off",
        (inertia / declared.inertia).max(declared.inertia / inertia)
    );
    let remedy = format!("read it with --map {name}={name}*{:.6}", 1.0 / factor);
    Some(finding(Severity::Error, name, problem, remedy))
}

/// Whether the measured effort can be what the declared model says it is.
pub(super) fn check_effort(
    rows: &Rows,
    declared: &Declared,
    nuisances: &[Nuisance],
    measured: &[f64],
    target: &[f64],
) -> Vec<HealthFinding> {
    let effort = declared.names().effort;
    let fitted: Vec<usize> = (0..rows.rows.len()).filter(|&row| rows.rows[row].part == Part::Fit).collect();
    if fitted.is_empty() {
        return Vec::new();
    }
    let at = |column: &dyn Fn(usize) -> f64| -> Vec<f64> { fitted.iter().map(|&row| column(row)).collect() };
    // What the model says without the numbers that are free.
    let known = |row: usize| {
        let free = nuisances.iter().filter(|nuisance| nuisance.free && !nuisance.is_logarithmic());
        measured[row]
            - target[row]
            - free.map(|nuisance| nuisance.declared * nuisance.column[row]).sum::<f64>()
    };
    let mut columns = vec![at(&known)];
    columns.extend(nuisances.iter().filter(|n| n.free).map(|nuisance| at(&|row| nuisance.column[row])));
    let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let blocks = Blocks::new(&views, &at(&|row| measured[row]), &vec![0; fitted.len()]);
    let members: Vec<Member> = (0..columns.len()).map(Member::free).collect();
    let (Some(found), Some(own)) =
        (blocks.fit(&members, 0.0), blocks.power_beyond(&members[1..], 0.0, &[(0, 1.0)]))
    else {
        return Vec::new();
    };
    let left = blocks.left(&members, &found);
    let factor = found[0];
    // Of no effort there is no factor.
    if factor == 0.0 {
        return Vec::new();
    }
    // Of the effort, what the known part explains and what nothing does.
    let explained = factor * factor * own;
    let gear = rows
        .agreement
        .map(|speed| speed.factor)
        .filter(|speed| (speed * factor.abs()).ln().abs() < 0.3 || (speed / factor.abs()).ln().abs() < 0.3)
        .filter(|speed| !(RIGHT_UNIT[0]..=RIGHT_UNIT[1]).contains(speed));
    // Beside numbers that are free, a factor that is no unit's and that the speed does not share may be the declared part
    // that is wrong.
    let alone = members.len() > 1 && gear.is_none() && !is_unit(factor) && rows.agreement.is_some();
    let needed = if gear.is_some() { COHERENT_WITH_GEAR } else { COHERENT };
    let of_all = if alone { COHERENT_ALONE } else { 0.5 * needed };
    if explained < needed * (explained + left) || explained < of_all * blocks.target_power() {
        return before_a_gear(rows, declared).into_iter().collect();
    }
    if factor < 0.0 {
        let problem = "the effort acts against what the declared model wants: its sign is turned".to_owned();
        let remedy = format!("turn the sign with --map {effort}={effort}*-1");
        return vec![finding(Severity::Error, effort, problem, remedy)];
    }
    if (RIGHT_UNIT[0]..=RIGHT_UNIT[1]).contains(&factor) {
        return Vec::new();
    }
    let cause = match gear {
        Some(gear) => format!(
            "a gear lies between, as the column of the speed, off by a factor of {gear:.3}, shows too"
        ),
        None => "it is measured before a gear, or in another unit".to_owned(),
    };
    let problem = format!(
        "the effort is {factor:.3} times what the declared model wants, so it cannot be the one that acts on the axis: {cause}"
    );
    let remedy =
        format!("read it with --map {effort}={effort}*{:.4}, or with the gear's own ratio", 1.0 / factor);
    vec![finding(Severity::Error, effort, problem, remedy)]
}
