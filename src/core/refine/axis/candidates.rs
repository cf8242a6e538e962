//! Effects of the library as columns, and which shapes are worth a look on a log.

use std::f64::consts::TAU;

use crate::effects::{EffectKind, Grid, KINDS, Machine, Parameter, Place, Signal};
use crate::model::MachineKind;
use crate::refine::{select::Member, whiten::Whitener};

use super::trace::{Acting, Rows};

/// An effect at certain shape parameters.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) kind: &'static EffectKind,
    /// Shape parameters as the kind takes them; of a series, those of one member.
    pub(super) shape: Vec<f64>,
    /// One for each term, at all rows.
    pub(super) columns: Vec<Vec<f64>>,
    /// The same, white.
    pub(super) white: Vec<Vec<f64>>,
    /// Whether the terms have no amplitude: the shape alone says how large it is.
    pub(super) fixed: bool,
    /// How much of the acceleration's noise its first column has.
    pub(super) noise: f64,
}

/// How far the amplitude of an effect without one may be off while its shape is looked for.
const FIXED_SEARCH: [f64; 2] = [0.2, 5.0];

impl Candidate {
    pub(super) fn new(
        kind: &'static EffectKind,
        machine: &Machine,
        rows: &Rows,
        whitener: &Whitener,
        shape: Vec<f64>,
    ) -> Self {
        let terms = kind.terms(machine, &shape);
        let fixed = terms.iter().all(|term| term.amplitude.is_none());
        let how = Acting::of(kind, machine.kind, &shape);
        let mut columns: Vec<Vec<f64>> = terms.iter().map(|term| rows.law_column(&*term.law, how)).collect();
        if fixed {
            let mut terms = columns.drain(..);
            let mut sum = terms.next().unwrap_or_default();
            for column in terms {
                sum.iter_mut().zip(&column).for_each(|(sum, value)| *sum += value);
            }
            columns = vec![sum];
        }
        let noise = if kind.trial.signal == Signal::Acceleration { 1.0 } else { 0.0 };
        Self::of_columns(kind, whitener, shape, columns, (fixed, noise))
    }

    /// A torque constant that is off. The effort that the model wants is the column, not the measured one, which would
    /// explain itself; the coefficient is 1/(1 + gain) − 1.
    fn gain(kind: &'static EffectKind, whitener: &Whitener, wanted: &[f64], inertia: f64) -> Self {
        Self::of_columns(kind, whitener, Vec::new(), vec![wanted.to_vec()], (false, inertia))
    }

    fn of_columns(
        kind: &'static EffectKind,
        whitener: &Whitener,
        shape: Vec<f64>,
        columns: Vec<Vec<f64>>,
        (fixed, noise): (bool, f64),
    ) -> Self {
        let white = columns.iter().map(|column| whitener.apply(column)).collect();
        Self { kind, shape, columns, white, fixed, noise }
    }

    /// An amplitude of the effect from its coefficient.
    pub(super) fn amplitude(&self, coefficient: f64) -> f64 {
        if self.is_gain() { 1.0 / (1.0 + coefficient) - 1.0 } else { coefficient }
    }

    /// How fast that amplitude changes with its coefficient, whatever the sign.
    pub(super) fn amplitude_slope(&self, coefficient: f64) -> f64 {
        if self.is_gain() { (1.0 + coefficient).powi(-2) } else { 1.0 }
    }

    /// Whether its columns are made of the measured effort, which then explains itself.
    pub(super) fn uses_effort(&self) -> bool {
        self.kind.trial.signal == Signal::MeasuredTorque
    }

    pub(super) fn is_gain(&self) -> bool {
        self.kind.trial.signal == Signal::WantedTorque
    }

    /// Its columns in a fit, from `first` on. While a shape is `searched` for, an effect without an amplitude has one.
    pub(super) fn members(&self, first: usize, machine: MachineKind, searched: bool) -> Vec<Member> {
        if self.fixed {
            let bounds = if searched { FIXED_SEARCH } else { [1.0, 1.0] };
            return vec![Member { column: first, spread: f64::INFINITY, bounds }];
        }
        if self.is_gain() {
            return vec![Member { column: first, spread: f64::INFINITY, bounds: [-0.6, 1.5] }];
        }
        let ranges = self.kind.amplitudes().map(|parameter| {
            let [low, high] = parameter.range(machine);
            [if parameter.opposing { low.max(0.0) } else { low }, high]
        });
        let member = |(index, bounds)| Member { column: first + index, spread: f64::INFINITY, bounds };
        ranges.enumerate().map(member).collect()
    }
}

/// What the shapes are measured against.
#[derive(Clone)]
pub(super) struct Scales {
    pub(super) speed: f64,
    /// Speed that a fair share of the rows is below.
    pub(super) slow: f64,
    /// Speed that all but a twentieth of the rows exceed, where the motion goes one way; 0 where it passes through rest.
    pub(super) slowest: f64,
    pub(super) travel: f64,
    pub(super) effort: f64,
    pub(super) largest_effort: f64,
    pub(super) seconds: f64,
    pub(super) step_s: f64,
    pub(super) cutoff_hz: f64,
    pub(super) inertia: f64,
}

impl Scales {
    pub(super) fn new(rows: &Rows, inertia: f64) -> Self {
        let speeds = rows.counted(|trace, sample| trace.speed[sample].abs());
        let efforts = rows.counted(|trace, sample| trace.effort[sample].abs());
        let rms =
            |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let positions = rows.traces.iter().flat_map(|trace| &trace.position);
        let range =
            positions.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &q| [low.min(q), high.max(q)]);
        let seconds = rows.rows.iter().map(|row| row.time_s).fold(0.0, f64::max);
        Self {
            speed: rms(&speeds),
            slow: slow(&speeds),
            slowest: if rows.both_ways() { 0.0 } else { lowest_twentieth(&speeds) },
            travel: range[1] - range[0],
            effort: rms(&efforts),
            largest_effort: largest(&efforts),
            seconds,
            step_s: rows.kernel.step_s,
            cutoff_hz: rows.kernel.cutoff_hz,
            inertia,
        }
    }

    /// Values of a shape parameter that are worth a look, by its unit.
    fn grid(&self, kind: &EffectKind, parameter: &Parameter, machine: MachineKind) -> Vec<f64> {
        let times = |shares: &[f64], of: f64| shares.iter().map(|share| share * of).collect();
        match parameter.unit(machine) {
            "s" if kind.place == Place::Actuator => {
                times(&[1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0], self.step_s.max(0.1 / self.cutoff_hz))
            }
            "s" => times(&[0.05, 0.1, 0.2, 0.4, 0.8], self.seconds),
            "rad/s" | "m/s" => {
                let scales: Vec<f64> = times(&[0.05, 0.1, 0.2, 0.4], self.speed);
                scales.into_iter().filter(|scale| *scale >= self.slowest).collect()
            }
            "rad" | "m" if kind.place == Place::Actuator => times(&[0.003, 0.01, 0.03], self.speed),
            "rad" | "m" => times(&[0.001, 0.003, 0.01, 0.03], self.speed),
            _ if is_of_torque(parameter) => {
                times(&[0.15, 0.22, 0.3, 0.4, 0.55, 0.7, 0.82, 0.92], self.largest_effort)
            }
            "N m" | "N" => times(&[0.05, 0.12, 0.25, 0.5], self.effort),
            "Hz" => times(&[0.05, 0.1, 0.2, 0.4], self.cutoff_hz),
            "kg m²" | "kg" => times(&[0.1, 0.3], self.inertia),
            _ => vec![0.5, 1.0, 2.0],
        }
    }
}

impl Scales {
    /// Lowest and highest value of a shape that a log can show.
    pub(super) fn seen(&self, kind: &EffectKind, parameter: &Parameter, machine: MachineKind) -> [f64; 2] {
        let grid = self.grid(kind, parameter, machine);
        let [low, high] =
            grid.iter().fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], &v| [low.min(v), high.max(v)]);
        match parameter.unit(machine) {
            _ if kind.series() => [0.0, f64::INFINITY],
            // Less than a row is the sampling's own.
            "s" if kind.place == Place::Actuator => [self.step_s, 2.0 * high],
            _ if is_of_torque(parameter) => [0.5 * low, self.largest_effort],
            "rad/s" | "m/s" => [self.slowest.max(0.25 * low), 4.0 * high],
            _ => [0.25 * low, 4.0 * high],
        }
    }
}

/// Whether a shape is a share of the largest torque.
fn is_of_torque(parameter: &Parameter) -> bool {
    matches!(parameter.grid, Grid::OfTorque(_))
}

/// Share of the rows, and fewest of them, that a wave must be seen in.
const SEEN: f64 = 0.1;
const LEAST_SEEN: usize = 400;

/// Speed below which a wave of the position is seen often enough.
fn slow(speeds: &[f64]) -> f64 {
    let mut sorted = speeds.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = ((SEEN * sorted.len() as f64) as usize).max(LEAST_SEEN);
    sorted.get(place.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// What a twentieth of some values is below.
fn lowest_twentieth(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 20).copied().unwrap_or(0.0)
}

/// Candidates at the grid of their shapes; not those whose shapes are harmonics.
pub(super) fn library(
    machine: &Machine,
    rows: &Rows,
    whitener: &Whitener,
    scales: &Scales,
    (wanted, inertia): (&[f64], f64),
) -> Vec<Candidate> {
    let mut found = Vec::new();
    // A body that gives way is the robot's.
    let is_own = |kind: &&EffectKind| kind.is_on(machine.kind) && kind.place != Place::Pitch;
    for kind in KINDS.into_iter().filter(is_own).filter(|kind| !kind.series()) {
        if kind.trial.signal == Signal::WantedTorque {
            found.push(Candidate::gain(kind, whitener, wanted, inertia));
            continue;
        }
        for shape in shapes(kind, machine.kind, scales) {
            found.push(Candidate::new(kind, machine, rows, whitener, shape));
        }
    }
    found
}

/// All combinations of the grids of a kind's shape parameters.
fn shapes(kind: &'static EffectKind, machine: MachineKind, scales: &Scales) -> Vec<Vec<f64>> {
    let mut shapes = vec![Vec::new()];
    for parameter in kind.shapes() {
        let [low, high] = parameter.range(machine);
        let grid: Vec<f64> = scales
            .grid(kind, parameter, machine)
            .into_iter()
            .filter(|value| (low..=high).contains(value))
            .collect();
        shapes = shapes
            .iter()
            .flat_map(|shape| grid.iter().map(move |&value| [shape.as_slice(), &[value]].concat()))
            .collect();
    }
    shapes
}

/// Waves of the position that can be seen, rad per unit: whole orders of a shaft, half waves of a carriage's travel.
/// First, step and number.
pub(super) fn wave_numbers(machine: MachineKind, scales: &Scales) -> (usize, f64, usize) {
    const MOST: usize = 240;
    let linear = machine == MachineKind::Linear;
    let step = if linear { 0.5 * TAU / scales.travel } else { 1.0 };
    let seen = scales.cutoff_hz * TAU / (0.5 * scales.slow);
    let count = if step > 0.0 && step.is_finite() { ((seen / step) as usize).min(MOST) } else { 0 };
    let first = if linear { 3 } else { 1 };
    (first, step, count)
}

/// Shape parameter of a harmonic: order, or period on a carriage.
pub(super) fn shape_of_wave(machine: MachineKind, wave_number: f64) -> f64 {
    if machine == MachineKind::Linear { TAU / wave_number } else { wave_number }
}
