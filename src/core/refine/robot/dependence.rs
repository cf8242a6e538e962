//! What a residual depends on beyond any effect of the library: free functions of everything that was recorded, judged by
//! left-out blocks, so that neither the level of the noise nor its colour counts.

use crate::effects::{Action, MotionSample as Moment};
use crate::refine::select::Member;

use super::search::{Fit, Search};

/// Bins of a variable, by its quantiles.
const BINS: usize = 14;
/// Of the motor's angle within a turn, and of the place on the floor.
const FINE_BINS: usize = 24;
/// Times before a row, s, whose torque and pitch make its history: shorter ones see the controller's answer to noise.
const HISTORY_S: [f64; 5] = [0.2, 0.28, 0.38, 0.52, 0.7];
/// Standard deviation of a bin's coefficient beforehand, in units of what noise makes of it.
const LOOSE: f64 = 3.0;
/// Fraction of the blocks whose error must fall.
const BLOCKS_BETTER: f64 = 0.6;

/// How much a variable explains.
pub(super) struct Dependence {
    pub(super) name: &'static str,
    /// Fraction of the error on left-out blocks.
    pub(super) gain: f64,
}

type Variable = (&'static str, usize, fn(&Moment) -> f64);

const VARIABLES: [Variable; 6] = [
    ("motor_angle_rad", FINE_BINS, |m| m.motor_angle_rad.rem_euclid(std::f64::consts::TAU)),
    ("motor_speed_rad_s", BINS, |m| m.motor_speed_rad_s),
    ("torque_nm", BINS, |m| m.torque_sum_nm),
    ("x_m", FINE_BINS, |m| m.x_m),
    ("x_dot_m_s", BINS, |m| m.x_dot_m_s),
    ("pitch_rad", BINS, |m| m.pitch_rad),
];

/// Where something may act: in the motors, at the axle, on the body.
const PLACES: [fn(f64) -> Action; 3] = [Action::motor, |force| Action::force(force, 0.0, 0.0), Action::body];

/// What the residual of a fit depends on, the strongest first.
pub(super) fn dependences(search: &Search<'_>, fit: &Fit) -> Vec<Dependence> {
    let mut found: Vec<Dependence> = Vec::new();
    let mut add = |name: &'static str, columns: Vec<Vec<f64>>| {
        let Some(gain) = gain(search, fit, &columns) else { return };
        match found.iter_mut().find(|known| known.name == name) {
            Some(known) => known.gain = known.gain.max(gain),
            None => found.push(Dependence { name, gain }),
        }
    };
    for (name, bins, of) in VARIABLES {
        let edges = edges(search.trace.moments().map(of).collect(), bins);
        if edges.len() < 4 {
            continue;
        }
        for place in PLACES {
            let bin = |bin: usize| {
                let edges = &edges;
                search.white(&search.trace.pair(|| {
                    move |m: &Moment| {
                        let value = of(m);
                        let inside =
                            value >= edges[bin] && (value < edges[bin + 1] || bin + 2 == edges.len());
                        if inside { place(1.0) } else { Action::default() }
                    }
                }))
            };
            add(name, (0..edges.len() - 1).map(bin).collect());
        }
    }
    let signals: [fn(&Moment) -> f64; 3] = [|m| m.torque_sum_nm, |m| m.pitch_rad, |m| m.pitch_rate_rad_s];
    let row_s = search.trace.row_s();
    for place in PLACES {
        let mut columns = Vec::new();
        for signal in signals {
            for back_s in HISTORY_S {
                let rows = ((back_s / row_s) as usize).max(1);
                columns.push(search.white(&search.trace.pair(|| {
                    let mut past = std::collections::VecDeque::with_capacity(rows);
                    move |m: &Moment| {
                        past.push_back(signal(m));
                        let then = past[0];
                        if past.len() > rows {
                            past.pop_front();
                        }
                        place(then)
                    }
                })));
            }
        }
        add("history", columns);
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found
}

/// Fraction of the error on left-out blocks that columns beside those of the fit explain.
fn gain(search: &Search<'_>, fit: &Fit, more: &[Vec<f64>]) -> Option<f64> {
    let mut columns = search.columns(&search.picks);
    let first = columns.len();
    columns.extend(more.iter().filter(|column| column.iter().any(|v| *v != 0.0)).map(Vec::as_slice));
    let blocks = search.blocks(&columns);
    let noise = fit.judged.left / search.rows() as f64;
    let mut members = fit.members.clone();
    let base = blocks.judge(&members, noise)?;
    for column in first..columns.len() {
        let spread = LOOSE * (noise * blocks.rows() as f64).sqrt() / blocks.length(column);
        members.push(Member { spread, ..Member::free(column) });
    }
    let with = blocks.judge(&members, noise)?;
    let better = base.held_out.iter().zip(&with.held_out).filter(|(base, with)| with < base).count();
    let enough = better as f64 >= BLOCKS_BETTER * base.held_out.len() as f64;
    Some(if enough { with.gain_over(&base) } else { 0.0 })
}

/// Ends of bins with as many values in each.
fn edges(mut values: Vec<f64>, bins: usize) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let mut found: Vec<f64> = (0..=bins).map(|bin| values[bin * last / bins]).collect();
    found.dedup();
    found
}
