//! The residual row by row, for pictures and for looking around in it.

use std::f64::consts::TAU;

use crate::signal::quantile::student_t_975;

/// The main channel of a log over everything that it may depend on.
///
/// Residuals are what was measured less what the model asks for at that row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Explorer {
    /// Name of the channel: `torque`, `force` or `combined`.
    pub channel: &'static str,
    /// Everything that the residual may depend on, time first.
    pub variables: Vec<Variable>,
    /// Rows that took no part in the estimates.
    pub held_out: Vec<bool>,
    /// Measured signal, in `unit`.
    pub measured: Vec<f64>,
    /// Residual of the declared model, in `unit`.
    pub before: Vec<f64>,
    /// Residual with the effects, in `unit`.
    pub after: Vec<f64>,
    /// Unit of the channel.
    pub unit: &'static str,
    /// Noise floor of the residual, in `unit`.
    pub noise_floor: f64,
    /// Order of the motor angle, amplitude before and amplitude after in `unit`; none on a linear axis.
    pub orders: Vec<[f64; 3]>,
}

/// Something that a residual may depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name as of a log's column.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// One for each row.
    pub values: Vec<f64>,
}

/// Most rows that are kept.
const MOST: usize = 4000;
/// Highest order of the spectrum.
const HIGHEST_ORDER: usize = 160;
/// Blocks of an interval.
const BLOCKS: usize = 12;
/// Fewest rows in a wave of an order, on the average, for it to be told.
const ROWS_A_WAVE: f64 = 2.2;

impl Variable {
    /// A variable with one value for each row.
    pub fn new(name: &'static str, unit: &'static str, values: Vec<f64>) -> Self {
        Self { name, unit, values }
    }
}

impl Explorer {
    /// The variable with a name.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// The orders of a residual over the motor angle, rad, then thinned to what a picture takes.
    pub(super) fn finished(mut self, angle_rad: Option<&[f64]>) -> Self {
        if let Some(angle_rad) = angle_rad {
            self.orders = orders(angle_rad, [&self.before, &self.after]);
        }
        let step = self.before.len().div_ceil(MOST).max(1);
        let thin = |values: &mut Vec<f64>| {
            *values = values.iter().copied().step_by(step).collect();
        };
        self.variables.iter_mut().for_each(|variable| thin(&mut variable.values));
        [&mut self.measured, &mut self.before, &mut self.after].into_iter().for_each(thin);
        self.held_out = self.held_out.iter().copied().step_by(step).collect();
        self
    }
}

/// 95 % interval of the root mean square of a residual on the held-out rows, by blocks of these; `None` if they are
/// too few.
pub(super) fn interval(residual: &[f64], held_out: &[bool]) -> Option<[f64; 2]> {
    let held = residual.iter().zip(held_out).filter(|(_, held)| **held).map(|(value, _)| value * value);
    let squares: Vec<f64> = held.collect();
    if squares.len() < 10 * BLOCKS {
        return None;
    }
    let block = |number: usize| {
        let rows = &squares[number * squares.len() / BLOCKS..(number + 1) * squares.len() / BLOCKS];
        rows.iter().sum::<f64>() / rows.len() as f64
    };
    let means: Vec<f64> = (0..BLOCKS).map(block).collect();
    let mean = means.iter().sum::<f64>() / BLOCKS as f64;
    let variance = means.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (BLOCKS - 1) as f64;
    let half = student_t_975(BLOCKS - 1) * (variance / BLOCKS as f64).sqrt();
    Some([mean - half, mean + half].map(|square| square.max(0.0).sqrt()))
}

/// Amplitudes of the orders of an angle, every stretch of it of the same weight however fast it was passed.
fn orders(angle_rad: &[f64], residuals: [&[f64]; 2]) -> Vec<[f64; 3]> {
    let ways: Vec<f64> = std::iter::once(0.0)
        .chain(angle_rad.windows(2).map(|pair| (pair[1] - pair[0]).abs()))
        .map(|way| if way < 1.0 { way } else { 0.0 })
        .collect();
    let total: f64 = ways.iter().sum();
    let turns = total / TAU;
    let finest = ways.iter().filter(|way| **way > 0.0).count() as f64 / turns.max(1e-9) / ROWS_A_WAVE;
    let highest = (finest as usize).min(HIGHEST_ORDER);
    if turns < 1.0 || highest == 0 {
        return Vec::new();
    }
    // Waves of order 1 at every row, turned on by themselves from order to order.
    let first: Vec<(f64, f64)> = angle_rad.iter().map(|angle| libm::sincos(*angle)).collect();
    let mut waves = vec![(0.0, 1.0); first.len()];
    let amplitude = |waves: &[(f64, f64)], residual: &[f64]| {
        let (mut re, mut im) = (0.0, 0.0);
        for ((&(sin, cos), value), way) in waves.iter().zip(residual).zip(&ways) {
            re += way * value * cos;
            im += way * value * sin;
        }
        2.0 * re.hypot(im) / total
    };
    (1..=highest)
        .map(|order| {
            for ((sin, cos), (s, c)) in waves.iter_mut().zip(&first) {
                (*sin, *cos) = (*sin * c + *cos * s, *cos * c - *sin * s);
            }
            [order as f64, amplitude(&waves, residuals[0]), amplitude(&waves, residuals[1])]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave of order 7 with an amplitude of 0.3, passed at changing speed both ways.
    #[test]
    fn order_of_a_wave_has_its_amplitude() {
        let angle: Vec<f64> = (0..20_000).map(|i| 60.0 * f64::sin(f64::from(i) * 3e-4)).collect();
        let wave: Vec<f64> = angle.iter().map(|q| 0.3 * f64::cos(7.0 * q + 0.4)).collect();
        let found = orders(&angle, [&wave, &vec![0.0; wave.len()]]);
        let strongest = found.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        assert_eq!(strongest[0], 7.0);
        assert!((strongest[1] - 0.3).abs() < 0.01 && strongest[2] == 0.0, "{strongest:?}");
        assert!(found.iter().all(|order| order[0] == 7.0 || order[1] < 0.06));
    }

    #[test]
    fn rows_are_thinned_alike() {
        let rows = 9001;
        let column: Vec<f64> = (0..rows).map(f64::from).collect();
        let explorer = Explorer {
            variables: vec![Variable::new("time_s", "s", column.clone())],
            held_out: column.iter().map(|row| *row > 5000.0).collect(),
            measured: column.clone(),
            before: column.clone(),
            after: column,
            ..Explorer::default()
        }
        .finished(None);
        assert_eq!(explorer.before.len(), 3001);
        assert_eq!(explorer.variable("time_s").unwrap().values, explorer.after);
        assert!(explorer.held_out.len() == 3001 && explorer.held_out[1667] && !explorer.held_out[1666]);
    }
}
