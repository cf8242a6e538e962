//! Friction of turning shafts, tabulated: Eq. 28 costs two powers and two exponentials at every evaluation of
//! the dynamics, which would be most of the simulation's time.

use crate::friction::Stribeck;

/// Cells of the table in each octave of speed, as a power of two.
const CELL_BITS: u32 = 6;
/// Lowest tabulated speed, 2⁻³⁰ rad/s, and the number of octaves above it: up to 1024 rad/s.
const LOWEST_EXPONENT: i32 = -30;
const OCTAVES: usize = 40;
/// Bits of a float below a cell's index.
const WITHIN_BITS: u32 = f64::MANTISSA_DIGITS - 1 - CELL_BITS;

/// Sum of the friction of motors that turn at one speed.
#[derive(Clone, Debug)]
pub(in crate::simulate) struct SlidingFriction {
    curves: Vec<Stribeck>,
    viscous_nm_s_rad: f64,
    offset_nm: f64,
    /// Cubic of each cell in the share of the cell, from the lowest power up. Cells are spaced as floats
    /// are, finer towards zero, where the curve is steepest.
    cells: Vec<[f64; 4]>,
    lowest_bits: u64,
}

impl SlidingFriction {
    pub(in crate::simulate) fn new(curves: impl IntoIterator<Item = Stribeck>) -> Self {
        let curves: Vec<Stribeck> = curves.into_iter().collect();
        let lowest_bits = 2.0_f64.powi(LOWEST_EXPONENT).to_bits();
        let count = if curves.is_empty() { 0 } else { (OCTAVES as u64) << CELL_BITS };
        let cells = (0..count).map(|cell| cubic(&curves, lowest_bits + (cell << WITHIN_BITS))).collect();
        Self {
            viscous_nm_s_rad: curves.iter().map(|curve| curve.parameters().viscous_nm_s_rad).sum(),
            offset_nm: curves.iter().map(|curve| curve.parameters().offset_nm).sum(),
            curves,
            cells,
            lowest_bits,
        }
    }

    /// Friction at a speed, N m, for shafts that slide in `direction` (1 or −1), also where the speed is
    /// still or already 0.
    #[inline(always)]
    pub(in crate::simulate) fn torque_nm(&self, speed_rad_s: f64, direction: f64) -> f64 {
        let level = self.level_nm(speed_rad_s.abs());
        direction * level + (self.viscous_nm_s_rad * speed_rad_s + self.offset_nm)
    }

    #[inline(always)]
    fn level_nm(&self, speed: f64) -> f64 {
        let bits = speed.to_bits().wrapping_sub(self.lowest_bits);
        let Some([a, b, c, d]) = self.cells.get((bits >> WITHIN_BITS) as usize) else {
            return exact_level_nm(&self.curves, speed);
        };
        let share = (bits & ((1 << WITHIN_BITS) - 1)) as f64 * (1.0 / (1_u64 << WITHIN_BITS) as f64);
        // Two short chains in place of Horner's long one: the next stage of the integrator waits for this.
        (a + share * b) + share * share * (c + share * d)
    }
}

fn exact_level_nm(curves: &[Stribeck], speed: f64) -> f64 {
    curves.iter().map(|curve| curve.level_nm(speed)).sum()
}

/// The cubic with the values and slopes of the level at both ends of a cell (Hermite).
fn cubic(curves: &[Stribeck], bits: u64) -> [f64; 4] {
    let [low, high] = [bits, bits + (1 << WITHIN_BITS)].map(f64::from_bits);
    let value = |speed| exact_level_nm(curves, speed);
    let slope = |speed: f64| -> f64 {
        let one = |curve: &Stribeck| curve.slope_nm_s_rad(speed) - curve.parameters().viscous_nm_s_rad;
        (high - low) * curves.iter().map(one).sum::<f64>()
    };
    let rise = value(high) - value(low);
    let (start, end) = (slope(low), slope(high));
    [value(low), start, 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::StribeckParameters;

    fn curve(stribeck_speed_rad_s: f64, stribeck_exponent: f64) -> Stribeck {
        Stribeck::new(StribeckParameters {
            coulomb_nm: 0.0338,
            static_nm: 0.0761,
            viscous_nm_s_rad: 4.9e-4,
            stribeck_speed_rad_s,
            stribeck_exponent,
            offset_nm: -0.0016,
        })
        .unwrap()
    }

    #[test]
    fn table_agrees_with_equation_28() {
        // Error allowed, N m: it grows with the fourth power of the exponent.
        for (exponent, allowed) in [(0.2310, 1e-11), (1.0, 1e-10), (2.2, 1e-9), (10.0, 1e-7)] {
            let curves = [curve(1.612, exponent), curve(2.253, exponent)];
            let table = SlidingFriction::new(curves);
            for step in -4000..3000 {
                let speed = 10.0_f64.powf(f64::from(step) / 400.0);
                for speed in [speed, -speed] {
                    let exact: f64 = curves.iter().map(|curve| curve.torque_nm(speed)).sum();
                    let error = (table.torque_nm(speed, speed.signum()) - exact).abs();
                    assert!(error < allowed, "{error} N m at {speed} rad/s, exponent {exponent}");
                }
            }
        }
    }

    #[test]
    fn outside_of_the_table_the_curve_itself_serves() {
        let curve = curve(1.612, 0.2310);
        let table = SlidingFriction::new([curve]);
        for speed in [1e-300, 1e-12, 2000.0, 1e6] {
            let error = (table.torque_nm(speed, 1.0) / curve.torque_nm(speed) - 1.0).abs();
            assert!(error < 1e-15, "{error} at {speed} rad/s");
        }
        let p = curve.parameters();
        assert_eq!(table.torque_nm(0.0, -1.0), p.offset_nm - p.static_nm);
        assert_eq!(SlidingFriction::new([]).torque_nm(3.0, 1.0), 0.0);
    }
}
