//! Which harmonics of the position a residual has.

use crate::effects::{EffectKind, KINDS, Machine, MotionSample as Moment};
use crate::refine::whiten::Whitener;

use super::candidates::{Candidate, Scales, shape_of_wave, wave_numbers};
use super::trace::Rows;

/// Waves of each kind that are looked at closely.
const CLOSELY: usize = 4;

/// The waves of each kind of harmonic effect that go best with a white residual.
///
/// What the kernel and the whitening leave of a wave is taken at the row's speed, which is enough to choose by.
pub(super) fn strongest(
    machine: &Machine,
    rows: &Rows,
    scales: &Scales,
    whitener: &Whitener,
    white_residual: &[f64],
    picks: &[Candidate],
) -> Vec<(&'static EffectKind, Vec<f64>)> {
    let (first, step, last) = wave_numbers(machine.kind, scales);
    let kinds: Vec<&'static EffectKind> =
        KINDS.into_iter().filter(|kind| kind.series() && kind.is_on(machine.kind)).collect();
    let speed = rows.pick(|trace, sample| trace.speed[sample]);
    let effort = rows.pick(|trace, sample| trace.effort[sample]);
    let residual = whitener.transposed(white_residual, speed.len());
    let chosen: Vec<usize> = (0..speed.len()).filter(|&row| residual[row] != 0.0).collect();
    let weights: Vec<Vec<f64>> = kinds
        .iter()
        .map(|kind| {
            let moment = |row: usize| Moment {
                motor_speed_rad_s: speed[row],
                torque_nm: effort[row],
                ..Moment::default()
            };
            chosen.iter().map(|&row| kind.harmonic_nm(&moment(row))).collect()
        })
        .collect();
    let gains = GainTable::new(rows, whitener);
    let turn: Vec<[f64; 2]> = {
        let position = rows.pick(|trace, sample| step * trace.position[sample]);
        chosen.iter().map(|&row| [position[row].cos(), position[row].sin()]).collect()
    };
    let mut wave = vec![[1.0, 0.0]; chosen.len()];
    let mut scores: Vec<Vec<(f64, f64)>> = vec![Vec::new(); kinds.len()];
    for index in 1..=last {
        let number = index as f64 * step;
        let mut sums = vec![[0.0; 3]; kinds.len()];
        for (place, ([re, im], &[cos, sin])) in wave.iter_mut().zip(&turn).enumerate() {
            (*re, *im) = (*re * cos - *im * sin, *re * sin + *im * cos);
            let [kernel, power] = gains.at(number * speed[chosen[place]]);
            let said = residual[chosen[place]] * kernel;
            for (sum, weight) in sums.iter_mut().zip(&weights) {
                let weight = weight[place];
                sum[0] += weight * said * *re;
                sum[1] += weight * said * *im;
                sum[2] += 0.5 * weight * weight * power;
            }
        }
        for (scores, [re, im, power]) in scores.iter_mut().zip(sums) {
            if index >= first && power > 0.0 {
                scores.push(((re * re + im * im) / power, number));
            }
        }
    }
    let mut found = Vec::new();
    for (kind, mut scores) in kinds.into_iter().zip(scores) {
        scores.sort_by(|a, b| b.0.total_cmp(&a.0));
        let shapes = scores.iter().map(|&(_, number)| vec![shape_of_wave(machine.kind, number)]);
        let new = shapes.filter(|shape| picks.iter().all(|pick| pick.kind != kind || pick.shape != *shape));
        found.extend(new.take(CLOSELY).map(|shape| (kind, shape)));
    }
    found
}

/// The kernel's gain over angular frequency, and the power that kernel and whitening leave.
struct GainTable {
    step: f64,
    gains: Vec<[f64; 2]>,
}

impl GainTable {
    fn new(rows: &Rows, whitener: &Whitener) -> Self {
        const STEPS: usize = 512;
        let step = 0.5 / STEPS as f64;
        let gains = (0..STEPS).map(|index| {
            let frequency = index as f64 * step;
            let kernel = rows.kernel.gain(frequency);
            [kernel, kernel * kernel * whitener.power_gain(frequency * rows.kernel.thinning as f64)]
        });
        Self { step: std::f64::consts::TAU * step / rows.kernel.step_s, gains: gains.collect() }
    }

    fn at(&self, angular_frequency: f64) -> [f64; 2] {
        self.gains.get((angular_frequency.abs() / self.step) as usize).copied().unwrap_or([0.0; 2])
    }
}
