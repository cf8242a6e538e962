//! Friction of turning shafts, tabulated: Eq. 28 costs two powers and two exponentials at every evaluation of
//! the dynamics, which would be most of the simulation's time.

use super::laws::Level;
use super::number::Number;
use crate::friction::Stribeck;

/// Cells of the table in each octave of speed, as a power of two.
const CELL_BITS: u32 = 6;
/// Lowest tabulated speed, 2⁻³⁰ rad/s, and the number of octaves above it: up to 1024 rad/s.
const LOWEST_BITS: u64 = (1023 - 30) << (f64::MANTISSA_DIGITS - 1);
const CELLS: usize = 40 << CELL_BITS;
/// Bits of a float below a cell's index.
const WITHIN_BITS: u32 = f64::MANTISSA_DIGITS - 1 - CELL_BITS;

/// Sum of the friction of motors that turn at one speed.
#[derive(Clone, Debug)]
pub(in crate::simulate) struct SlidingFriction {
    curves: Vec<Stribeck>,
    pub(super) viscous_nm_s_rad: f64,
    pub(super) offset_nm: f64,
    /// Cubic of each cell in the speed t above its lower end: factors of 1, t², t, t³, so that those used
    /// alike lie side by side. Cells are spaced as floats are, finer towards zero, where the curve is
    /// steepest.
    cells: Box<[[f64; 4]; CELLS]>,
}

impl SlidingFriction {
    pub(in crate::simulate) fn new(curves: impl IntoIterator<Item = Stribeck>) -> Self {
        let curves: Vec<Stribeck> = curves.into_iter().collect();
        let nodes: Vec<Node> =
            (0..=CELLS as u64).map(|node| Node::new(&curves, LOWEST_BITS + (node << WITHIN_BITS))).collect();
        let cells: Vec<_> = nodes.windows(2).map(|ends| cubic(&ends[0], &ends[1])).collect();
        Self {
            viscous_nm_s_rad: curves.iter().map(|curve| curve.parameters().viscous_nm_s_rad).sum(),
            offset_nm: curves.iter().map(|curve| curve.parameters().offset_nm).sum(),
            curves,
            cells: cells.try_into().expect("there is a cell between two nodes"),
        }
    }

    /// Friction at a speed, N m, for shafts that slide in `direction` (1 or −1), also where the speed is
    /// still or already 0.
    #[inline(always)]
    pub(in crate::simulate) fn torque_nm(&self, speed_rad_s: f64, direction: f64) -> f64 {
        direction * self.amplitude_nm(speed_rad_s) + (self.viscous_nm_s_rad * speed_rad_s + self.offset_nm)
    }

    /// The cubic that serves at a speed of at least 0; none outside of the table.
    #[inline(always)]
    fn cell(&self, speed: f64) -> Option<&[f64; 4]> {
        self.cells.get((speed.to_bits().wrapping_sub(LOWEST_BITS) >> WITHIN_BITS) as usize)
    }

    /// Same with a constant outside of the table.
    #[inline(always)]
    pub(super) fn cell_or_constant(&self, speed: f64) -> [f64; 4] {
        match self.cell(speed) {
            Some(cubic) => *cubic,
            None => [self.exact_level_nm(speed), 0.0, 0.0, 0.0],
        }
    }

    #[cold]
    #[inline(never)]
    fn exact_level_nm(&self, speed: f64) -> f64 {
        exact_level_nm(&self.curves, speed)
    }
}

impl Level<f64> for SlidingFriction {
    #[inline(always)]
    fn amplitude_nm(&self, speed: f64) -> f64 {
        let speed = speed.abs();
        match self.cell(speed) {
            Some(cubic) => level(cubic, within(speed)),
            None => self.exact_level_nm(speed),
        }
    }
}

/// Bits of a speed that name its place within a cell.
pub(super) const WITHIN_MASK: u64 = (1 << WITHIN_BITS) - 1;

/// Distance of a speed from the lower end of its cell, rad/s.
#[inline(always)]
fn within(speed: f64) -> f64 {
    speed - f64::from_bits(speed.to_bits() & !WITHIN_MASK)
}

/// Value of a cell's cubic.
#[inline(always)]
pub(super) fn level<N: Number>([a, c, b, d]: &[N; 4], t: N) -> N {
    // Two short chains in place of Horner's long one: the next stage of the integrator waits for this.
    (*a + t * *b) + (t * t) * (*c + t * *d)
}

fn exact_level_nm(curves: &[Stribeck], speed: f64) -> f64 {
    curves.iter().map(|curve| curve.amplitude_nm(speed)).sum()
}

/// Speed, rad/s, level, N m, and its slope, N m s/rad, at an end of a cell.
struct Node {
    speed: f64,
    level: f64,
    slope: f64,
}

impl Node {
    fn new(curves: &[Stribeck], bits: u64) -> Self {
        let speed = f64::from_bits(bits);
        let slope = |curve: &Stribeck| curve.slope_nm_s_rad(speed) - curve.parameters().viscous_nm_s_rad;
        Self { speed, level: exact_level_nm(curves, speed), slope: curves.iter().map(slope).sum() }
    }
}

/// The cubic with the values and slopes of the level at both ends of a cell (Hermite).
fn cubic(low: &Node, high: &Node) -> [f64; 4] {
    let width = high.speed - low.speed;
    let rise = (high.level - low.level) / width;
    let square = (3.0 * rise - 2.0 * low.slope - high.slope) / width;
    let cube = (low.slope + high.slope - 2.0 * rise) / (width * width);
    [low.level, square, low.slope, cube]
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
