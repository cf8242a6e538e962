//! Effects that the model declares already, on logs that they were not found in: where the angle of each log counts
//! from, and what they are worth there.

use std::f64::consts::TAU;

use crate::effects::Role;
use crate::identify::motion::kinematics::direction;
use crate::model::{Effect, MachineKind};
use crate::record::{HealthFinding, Log, Severity};
use crate::refine::{
    gain::Gain,
    select::{Blocks, Member},
    verdict::Transfer,
};

use super::rig::{Declared, torque_between};
use super::trace::{Acting, Part, Rows, Trace};

/// Zeros that are tried in a period of the finest wave.
const TRIES: f64 = 24.0;
/// Most zeros that are tried.
const MOST: usize = 4000;
/// Shares of the error's power that another zero must take: of that with the declared zero, and of that without effects.
const CLEARLY: f64 = 0.3;
const A_LITTLE: f64 = 0.02;
const LEAST_ROWS: usize = 100;
/// By how much more an error is worth a warning, percent.
const HARM_PERCENT: f64 = 2.0;

/// Where the angle of each log counts from, as the declared effects have it, rad. An encoder in relative mode starts at
/// any angle: where another zero explains a log much better, it is that of the log and of no model.
pub(super) fn zeros_rad(declared: &Declared, rows: &Rows) -> Vec<f64> {
    let logs = rows.traces.iter().map(|trace| trace.log + 1).max().unwrap_or(0);
    let turning: Vec<&Effect> = declared.effects.iter().filter(|effect| effect.kind().series()).collect();
    // The load of a pendulum says where the angle counts from.
    if turning.is_empty() || declared.is_linear() || declared.gravity != 0.0 {
        return Vec::new();
    }
    let columns = Columns::new(declared, &turning, rows);
    (0..logs).map(|log| zero_of(&turning, rows, &columns, log).unwrap_or(0.0)).collect()
}

/// What a zero is looked for with, at the rows of all logs.
struct Columns {
    torque: Vec<f64>,
    /// Acceleration, speed, direction and offset.
    plain: [Vec<f64>; 4],
    /// The terms of the effects.
    terms: Vec<Vec<f64>>,
}

impl Columns {
    fn new(declared: &Declared, effects: &[&Effect], rows: &Rows) -> Self {
        let terms = effects.iter().flat_map(|effect| {
            let shape = effect.values(Role::Shape);
            let how = Acting::of(effect.kind(), MachineKind::Rotary, &shape);
            let terms = effect.kind().terms(&declared.machine, &shape);
            terms.into_iter().map(move |term| rows.column(|trace| trace.acts(&*term.law, how)))
        });
        Self {
            torque: rows.column(torque_between),
            plain: [
                rows.column(Trace::second_difference),
                rows.column(|trace| trace.speed.clone()),
                rows.column(|trace| trace.speed.iter().map(|&speed| direction(speed)).collect()),
                rows.column(|trace| vec![1.0; trace.position.len()]),
            ],
            terms: terms.collect(),
        }
    }
}

fn zero_of(effects: &[&Effect], rows: &Rows, columns: &Columns, log: usize) -> Option<f64> {
    let of = |part: Part| -> Vec<usize> {
        let own = |row: &usize| rows.traces[rows.rows[*row].trace].log == log && rows.rows[*row].part == part;
        (0..rows.rows.len()).filter(own).collect()
    };
    let chosen = [Part::Fit, Part::HeldOut].map(of).into_iter().find(|rows| rows.len() >= LEAST_ROWS)?;
    let at = |column: &Vec<f64>| -> Vec<f64> { chosen.iter().map(|&row| column[row]).collect() };
    let base = columns.plain.len();
    let own: Vec<Vec<f64>> = columns.plain.iter().chain(&columns.terms).map(at).collect();
    let views: Vec<&[f64]> = own.iter().map(Vec::as_slice).collect();
    let blocks = Blocks::new(&views, &at(&columns.torque), &vec![0; chosen.len()]);
    // In one direction alone, friction is one constant.
    let both = blocks.fit(&[0, 1, 2, 3].map(Member::free), 0.0).is_some();
    let members: Vec<Member> =
        if both { vec![0, 1, 2, 3] } else { vec![0, 1, 3] }.into_iter().map(Member::free).collect();
    let left = |signal: &[(usize, f64)]| {
        let all = [&[(blocks.target(), 1.0)], signal].concat();
        blocks.power_beyond(&members, 0.0, &all)
    };
    let turned = |zero_rad: f64| {
        let sizes = effects.iter().flat_map(|effect| effect.turned(zero_rad).values(Role::Amplitude));
        left(&sizes.enumerate().map(|(index, size)| (base + index, -size)).collect::<Vec<_>>())
    };
    let (without, declared) = (left(&[])?, turned(0.0)?);
    let orders = || effects.iter().flat_map(|effect| effect.values(Role::Shape));
    let common = orders().fold(0, |common, order| gcd(common, order as u64)) as f64;
    let tries = ((orders().fold(0.0, f64::max) / common * TRIES) as usize).min(MOST);
    let zero = |index: usize| TAU / common * index as f64 / tries as f64;
    let tried = (1..tries).filter_map(|index| Some((turned(zero(index))?, zero(index))));
    let (best, zero_rad) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (best < (1.0 - CLEARLY) * declared && best < (1.0 - A_LITTLE) * without).then_some(zero_rad)
}

/// Residuals with and without each declared effect: what it is worth on the held-out rows.
///
/// `without` gives what is left where its column is not taken off.
pub(super) fn carried(
    declared: &Declared,
    rows: &Rows,
    with: &[f64],
    without: impl Fn(&[f64]) -> Option<Vec<f64>>,
) -> Vec<Transfer> {
    let held_out = rows.held_out();
    let worth = |effect: &Effect| {
        let gain = Gain::new(&without(&declared.known(effect, rows))?, with, &held_out)?;
        Some(Transfer {
            id: effect.id(),
            error_drop_percent: 100.0 * gain.share,
            error_drop_ci95: gain.ci95.map(|ends| ends.map(|share| 100.0 * share)),
            encoder_offsets_rad: if effect.kind().series() { declared.zeros_rad.clone() } else { Vec::new() },
        })
    };
    declared.effects.iter().filter_map(worth).collect()
}

/// Findings about other zeros of the angle, and about effects without which the logs are told better.
pub(super) fn findings(declared: &Declared, logs: &[&Log], carried: &[Transfer]) -> Vec<HealthFinding> {
    let column = declared.names().position;
    let finding = |column: &str, problem: String, mend: &str| {
        HealthFinding::new(Severity::Warning, column, problem, mend)
    };
    let turned = declared.zeros_rad.iter().zip(logs).filter(|(zero_rad, _)| **zero_rad != 0.0);
    let mut found: Vec<HealthFinding> = turned
        .map(|(zero_rad, log)| {
            let problem = format!(
                "the angle of {} counts from elsewhere than the model's waves do: with another zero, {zero_rad:.4} rad on, \
                 they explain much more",
                log.source
            );
            finding(column, problem, "nothing has to be done: they are turned by that here, and in the refined model")
        })
        .collect();
    found.dedup();
    let worse = carried.iter().filter(|c| {
        c.error_drop_ci95.is_some_and(|[_, high]| high < 0.0) && c.error_drop_percent < -HARM_PERCENT
    });
    found.extend(worse.map(|carried| {
        let problem = format!(
            "the model's {} does not carry over to these logs: without it the error is lower by {:.1} %",
            carried.id,
            100.0 - 100.0 / (1.0 - 0.01 * carried.error_drop_percent)
        );
        finding(
            declared.names().effort,
            problem,
            "take the effect out of the model file, or refine with these logs",
        )
    }));
    found
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a.max(1) } else { gcd(b, a % b) }
}
