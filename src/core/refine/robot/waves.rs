//! Harmonics of the motors' angle: orders next to each other in one pass over the rows.

use crate::effects::{Action, MotionSample as Moment};

use super::kernel::Kernel;
use super::trace::Pair;

/// Rows that the kernel leaves, of one part of a pass, whose waves stay near the processor.
const PART: usize = 64;

/// One motor's rows: what a wave of size 1 puts on the shaft, and cos and sin of one angle and of an order of it.
#[derive(Default)]
struct Wheel {
    size_nm: Vec<f64>,
    turn: [Vec<f64>; 2],
    wave: [Vec<f64>; 2],
}

impl Wheel {
    fn load(&mut self, moments: &[Moment], action: fn(f64, &Moment) -> Action, order: f64) {
        let clear = |columns: &mut [Vec<f64>; 2]| columns.iter_mut().for_each(Vec::clear);
        self.size_nm.clear();
        clear(&mut self.turn);
        clear(&mut self.wave);
        for moment in moments {
            self.size_nm.push(action(1.0, moment).on_motor_nm(moment.direction()));
            for (columns, order) in [(&mut self.turn, 1.0), (&mut self.wave, order)] {
                let (sin, cos) = libm::sincos(order * moment.motor_angle_rad);
                columns[0].push(cos);
                columns[1].push(sin);
            }
        }
    }

    /// On to the next order: cos and sin of a sum of angles.
    fn advance(&mut self) {
        let ([turn_cos, turn_sin], [wave_cos, wave_sin]) = (&self.turn, &mut self.wave);
        let turn = turn_cos.iter().zip(turn_sin);
        for ((wave_cos, wave_sin), (cos, sin)) in wave_cos.iter_mut().zip(wave_sin).zip(turn) {
            (*wave_cos, *wave_sin) = (*wave_cos * cos - *wave_sin * sin, *wave_sin * cos + *wave_cos * sin);
        }
    }
}

/// Adds to the columns of cos and sin of the orders `first`, `first` + 1, … those of one log. `action` is what a wave
/// does inside a motor, in proportion to it.
pub(super) fn extend(
    found: &mut [[Pair; 2]],
    first: f64,
    action: fn(f64, &Moment) -> Action,
    moments: &[Vec<Moment>; 2],
    (kernel, radius_m): (&Kernel, f64),
) {
    let mut wheels = [Wheel::default(), Wheel::default()];
    let mut shaft_nm = Vec::new();
    let count = kernel.count(moments[0].len());
    for start in (0..count).step_by(PART) {
        let rows = kernel.rows_of(start..(start + PART).min(count));
        for (wheel, moments) in wheels.iter_mut().zip(moments) {
            wheel.load(&moments[rows.clone()], action, first);
        }
        for (place, pairs) in found.iter_mut().enumerate() {
            if place > 0 {
                wheels.iter_mut().for_each(Wheel::advance);
            }
            let [left, right] = &wheels;
            for (part, [r1, r2]) in pairs.iter_mut().enumerate() {
                let each = |wheel: &'_ Wheel, row: usize| wheel.size_nm[row] * wheel.wave[part][row];
                shaft_nm.clear();
                shaft_nm.extend((0..rows.len()).map(|row| each(left, row) + each(right, row)));
                let smooth = kernel.apply(&shaft_nm, 0);
                r1.extend(smooth.iter().map(|shaft| shaft / radius_m));
                r2.extend(smooth.iter().map(|shaft| -shaft));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{EffectKind, KINDS, Machine};
    use crate::model::{MachineKind, Model};
    use crate::refine::robot::motion::of_action;

    /// Against the laws themselves, row by row.
    #[test]
    fn orders_in_one_pass_are_those_of_the_laws() {
        let preset = include_str!("../../../../presets/paper.toml");
        let model = Model::from_toml(preset, "paper.toml").unwrap();
        let robot = model.robot().unwrap();
        let (machine, kernel) = (Machine::robot(robot), Kernel::new(1e-3));
        let moment = |motor: f64, row: usize| Moment {
            motor_angle_rad: 3.0 * libm::sin(0.004 * row as f64 + motor) + motor,
            motor_speed_rad_s: 12.0 * libm::cos(0.004 * row as f64 + motor),
            torque_nm: libm::sin(0.013 * row as f64),
            ..Moment::default()
        };
        let moments = [0.0, 0.7].map(|motor| (0..1500).map(|row| moment(motor, row)).collect::<Vec<_>>());
        let is_wave = |kind: &&'static EffectKind| kind.wave.is_some() && kind.is_on(MachineKind::Robot);
        let mut kinds = 0;
        for kind in KINDS.into_iter().filter(is_wave) {
            let mut found: Vec<[Pair; 2]> = vec![Default::default(); 10];
            let radius_m = machine.parameters.wheel_radius_m;
            extend(&mut found, 4.0, kind.wave.unwrap(), &moments, (&kernel, radius_m));
            for (pairs, order) in found.iter().zip(4..) {
                for (pair, term) in pairs.iter().zip(kind.terms(&machine, &[f64::from(order)])) {
                    let sum = |row: usize, equation: usize| -> f64 {
                        let of = |m: &Moment| of_action(&term.law.at(m).unwrap(), m.direction(), radius_m);
                        moments.iter().map(|moments| of(&moments[row])[equation]).sum()
                    };
                    for (equation, column) in pair.iter().enumerate() {
                        let raw: Vec<f64> = (0..1500).map(|row| sum(row, equation)).collect();
                        let wanted = kernel.apply(&raw, 0);
                        let scale = wanted.iter().fold(0.0, |most, v| f64::max(most, v.abs()));
                        assert_eq!(wanted.len(), column.len());
                        for (own, wanted) in column.iter().zip(&wanted) {
                            assert!((own - wanted).abs() < 1e-12 * scale, "{} {order}", kind.id);
                        }
                    }
                }
            }
            kinds += 1;
        }
        assert_eq!(kinds, 3);
    }
}
