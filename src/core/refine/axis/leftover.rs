//! What a residual depends on, beyond any effect of the library: smooth functions of everything that was recorded.

use std::f64::consts::{PI, TAU};

use crate::refine::verdict::Test;
use crate::refine::whiten::Whitener;

use super::rig::Declared;
use super::trace::{Rows, Trace};

/// Waves over the range of a variable.
const WAVES: usize = 8;
/// Bins of a variable by its quantiles.
const BINS: usize = 12;

/// Periods of the cut-off over which a noisy variable is averaged.
const SMOOTHED_PERIODS: f64 = 3.0;

/// Gain on left-out blocks above which a variable explains a residual, and its standard errors above 0.
const STRUCTURE: f64 = 0.06;
const STRUCTURE_Z: f64 = 2.5;

/// What a residual may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variable {
    Position,
    Speed,
    Effort,
    Acceleration,
    Time,
    Frequency,
}

impl Variable {
    /// As the log, or its derivative, is named.
    pub(super) fn name(self, declared: &Declared) -> &'static str {
        let names = declared.names();
        match self {
            Self::Position => names.position,
            Self::Speed => names.speed,
            Self::Effort => names.effort,
            Self::Acceleration if declared.is_linear() => "acceleration_m_s2",
            Self::Acceleration => "motor_acceleration_rad_s2",
            Self::Time | Self::Frequency => "time_s",
        }
    }
}

/// How much a variable explains of a white residual.
#[derive(Clone, Debug)]
pub(super) struct Dependence {
    pub(super) variable: Variable,
    /// Share of the error on left-out blocks.
    pub(super) gain: f64,
    /// Standard errors of that gain above 0.
    pub(super) z: f64,
}

impl Dependence {
    pub(super) fn test(&self, declared: &Declared) -> Test {
        let name = match self.variable {
            Variable::Frequency => "one frequency".to_owned(),
            other => other.name(declared).to_owned(),
        };
        Test {
            name: format!("share explained by {name}"),
            // What makes left-out blocks worse explains nothing.
            value: self.gain.max(0.0),
            threshold: STRUCTURE,
            structure: self.shows(),
        }
    }

    /// Whether the residual has structure over the variable.
    pub(super) fn shows(&self) -> bool {
        (self.gain > STRUCTURE && self.z > STRUCTURE_Z)
            || (self.gain > 5.0 * STRUCTURE && self.z > 0.5 * STRUCTURE_Z)
    }
}

/// Columns for each variable, at all rows.
pub(super) fn groups(
    rows: &Rows,
    wanted: &[f64],
    whitener: &Whitener,
    white_residual: &[f64],
) -> Vec<(Variable, Vec<Vec<f64>>)> {
    let pick = |signal: fn(&Trace, usize) -> f64| rows.pick(signal);
    let position = pick(|trace, sample| trace.position[sample]);
    let speed = pick(|trace, sample| trace.speed[sample]);
    let acceleration = rows.column(|trace| trace.acceleration.clone());
    let time: Vec<f64> = rows.rows.iter().map(|row| row.time_s).collect();
    let mut found = vec![
        (Variable::Position, waves(&position)),
        (Variable::Speed, bins(&speed)),
        (Variable::Effort, bins(&smoothed(rows, wanted))),
        (Variable::Acceleration, bins(&smoothed(rows, &acceleration))),
        (Variable::Time, waves(&time)),
    ];
    let line = strongest_line(&time, whitener, white_residual, 0.5 / rows.kernel.step_s);
    found.push((Variable::Frequency, line));
    found
}

/// Means over some periods of the cut-off: the residual has the noise of the position too, and would depend on itself.
fn smoothed(rows: &Rows, values: &[f64]) -> Vec<f64> {
    let reach = (SMOOTHED_PERIODS / (rows.kernel.cutoff_hz * rows.kernel.step_s)) as usize;
    let own = &rows.rows;
    let near =
        |a: usize, b: usize| own[a].trace == own[b].trace && own[a].sample.abs_diff(own[b].sample) <= reach;
    let mean = |row: usize| {
        let before = (0..row).rev().take_while(|&other| near(row, other));
        let after = (row..own.len()).take_while(|&other| near(row, other));
        let (sum, count) =
            before.chain(after).fold((0.0, 0_usize), |(sum, count), other| (sum + values[other], count + 1));
        sum / count as f64
    };
    (0..own.len()).map(mean).collect()
}

fn waves(values: &[f64]) -> Vec<Vec<f64>> {
    let [low, high] = range(values);
    let width = if high > low { high - low } else { 1.0 };
    (1..=WAVES)
        .map(|wave| values.iter().map(|v| (PI * wave as f64 * (v - low) / width).cos()).collect())
        .collect()
}

fn bins(values: &[f64]) -> Vec<Vec<f64>> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let edge = |index: usize| sorted[(index * sorted.len() / BINS).min(sorted.len() - 1)];
    (1..BINS)
        .map(|bin| {
            let inside = |v: &f64| *v >= edge(bin) && (*v < edge(bin + 1) || bin + 1 == BINS);
            values.iter().map(|v| f64::from(u8::from(inside(v)))).collect()
        })
        .collect()
}

fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)])
}

/// Cosine and sine of the frequency that the residual has most of.
fn strongest_line(time: &[f64], whitener: &Whitener, residual: &[f64], highest_hz: f64) -> Vec<Vec<f64>> {
    const MOST: usize = 2000;
    let times: Vec<f64> = whitener.rows().iter().map(|&row| time[row]).collect();
    let [low, high] = range(&times);
    let step = TAU / (high - low).max(1e-9);
    let count = ((TAU * highest_hz.min(60.0) / step) as usize).min(MOST);
    let turn: Vec<[f64; 2]> = times.iter().map(|t| [(step * t).cos(), (step * t).sin()]).collect();
    let mut wave: Vec<[f64; 2]> = residual.iter().map(|&value| [value, 0.0]).collect();
    let mut best = (0.0, 0);
    for index in 1..count {
        let mut sum = [0.0; 2];
        for ([re, im], &[cos, sin]) in wave.iter_mut().zip(&turn) {
            (*re, *im) = (*re * cos - *im * sin, *re * sin + *im * cos);
            sum[0] += *re;
            sum[1] += *im;
        }
        let power = sum[0] * sum[0] + sum[1] * sum[1];
        if power > best.0 {
            best = (power, index);
        }
    }
    let omega = best.1.max(1) as f64 * step;
    let wave = |phase: fn(f64) -> f64| time.iter().map(|t| phase(omega * t)).collect();
    vec![wave(f64::cos), wave(f64::sin)]
}
