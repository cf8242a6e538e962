//! Eigenvalues of a real square matrix: Householder reduction to Hessenberg form, then Francis' implicit
//! double-shift QR steps with deflation (Golub, Van Loan, Matrix Computations, 7.4 and 7.5).

use nalgebra::Complex;

use super::real::Real;
use super::square::Square;

/// QR steps spent on one eigenvalue before giving up; three are usual.
const STEPS_PER_POLE: usize = 60;

/// Writes the eigenvalues of `matrix` to `poles` (as many as rows), conjugates next to each other. `None`
/// where the matrix is not finite or, which has not been seen, the iteration does not converge.
#[inline(always)]
pub(super) fn eigenvalues<M: Square>(mut matrix: M, poles: &mut [Complex<f64>]) -> Option<()> {
    if !matrix.norm_squared().is_finite() {
        return None;
    }
    reduce_to_hessenberg(&mut matrix);
    let mut last = matrix.size();
    let mut steps = 0;
    while last > 0 {
        let first = deflate(&mut matrix, last - 1);
        match last - first {
            1 => poles[first] = Complex::new(matrix.at(first, first).to_f64(), 0.0),
            2 => [poles[first], poles[first + 1]] = pair(&matrix, first),
            _ => {
                steps += 1;
                if steps > STEPS_PER_POLE {
                    return None;
                }
                francis_step(&mut matrix, first, last - 1, steps % 10 == 0);
                continue;
            }
        }
        last = first;
        steps = 0;
    }
    Some(())
}

/// A reflection I − w vᵀ of up to three neighbouring coordinates that maps the vector it was made from onto
/// a multiple of the first.
struct Reflection<T> {
    v: [T; 3],
    w: [T; 3],
}

impl<T: Real> Reflection<T> {
    /// `None` where the vector is a multiple of the first coordinate already.
    #[inline(always)]
    fn new([x, y, z]: [T; 3]) -> Option<Self> {
        let others = y * y + z * z;
        if others.to_f64() == 0.0 {
            return None;
        }
        let (first, beta) = householder(x, others);
        Some(Self { v: [first, y, z], w: [beta * first, beta * y, beta * z] })
    }

    /// Reflects `COUNT` rows from `top` on, in the columns from `start` to `end` exclusive.
    #[inline(always)]
    fn rows<const COUNT: usize, M>(&self, matrix: &mut M, top: usize, start: usize, end: usize)
    where
        M: Square<Scalar = T>,
    {
        for column in start..end {
            let entries: [T; COUNT] = std::array::from_fn(|i| matrix.at(top + i, column));
            let along = self.along(&entries);
            for (i, entry) in entries.into_iter().enumerate() {
                matrix.set(top + i, column, entry - self.w[i] * along);
            }
        }
    }

    /// Reflects `COUNT` columns from `left` on, in the rows from `start` to `end` exclusive.
    #[inline(always)]
    fn columns<const COUNT: usize, M>(&self, matrix: &mut M, left: usize, start: usize, end: usize)
    where
        M: Square<Scalar = T>,
    {
        for row in start..end {
            let entries: [T; COUNT] = std::array::from_fn(|i| matrix.at(row, left + i));
            let along = self.along(&entries);
            for (i, entry) in entries.into_iter().enumerate() {
                matrix.set(row, left + i, entry - self.w[i] * along);
            }
        }
    }

    /// vᵀ · entries
    #[inline(always)]
    fn along<const COUNT: usize>(&self, entries: &[T; COUNT]) -> T {
        let pair = self.v[0] * entries[0] + self.v[1] * entries[1];
        if COUNT == 3 { pair + self.v[2] * entries[2] } else { pair }
    }
}

/// First entry of v and β of the reflection I − β v vᵀ for a vector that starts with `x` and goes on with
/// entries whose squares add up to `others`; these are v's too.
#[inline(always)]
fn householder<T: Real>(x: T, others: T) -> (T, T) {
    let squares = x * x + others;
    let length = squares.sqrt();
    let first = if x < T::ZERO { x - length } else { x + length };
    (first, T::ONE / (squares + x.abs() * length))
}

/// Clears each column below its subdiagonal by a reflection of the rows and columns after it.
#[inline(always)]
fn reduce_to_hessenberg<M: Square>(matrix: &mut M) {
    let size = matrix.size();
    // Its first row holds the vector of the reflection.
    let mut v = matrix.zeros();
    for column in 0..size.saturating_sub(2) {
        let top = column + 1;
        let others = (top + 1..size)
            .fold(M::Scalar::ZERO, |sum, row| sum + matrix.at(row, column) * matrix.at(row, column));
        if others.to_f64() == 0.0 {
            continue;
        }
        let x = matrix.at(top, column);
        let (first, beta) = householder(x, others);
        v.set(0, top, first);
        for row in top + 1..size {
            v.set(0, row, matrix.at(row, column));
        }
        reflect(matrix, v.row(0), top, beta);
        for row in top + 1..size {
            matrix.set(row, column, M::Scalar::ZERO);
        }
    }
}

/// Applies I − β v vᵀ from both sides, v being zero before `top`.
#[inline(always)]
fn reflect<M: Square>(matrix: &mut M, v: &[M::Scalar], top: usize, beta: M::Scalar) {
    let size = matrix.size();
    for column in top - 1..size {
        let along = (top..size).fold(M::Scalar::ZERO, |sum, row| sum + v[row] * matrix.at(row, column));
        for (row, part) in v.iter().enumerate().skip(top) {
            let entry = matrix.at(row, column) - *part * (beta * along);
            matrix.set(row, column, entry);
        }
    }
    for row in 0..size {
        let along = (top..size).fold(M::Scalar::ZERO, |sum, column| sum + v[column] * matrix.at(row, column));
        for (column, part) in v.iter().enumerate().skip(top) {
            let entry = matrix.at(row, column) - *part * (beta * along);
            matrix.set(row, column, entry);
        }
    }
}

/// Start of the unreduced block that ends at `end`: above it the subdiagonal entry is negligible.
#[inline(always)]
fn deflate<M: Square>(matrix: &mut M, end: usize) -> usize {
    for row in (1..=end).rev() {
        let neighbours = matrix.at(row, row).abs().to_f64() + matrix.at(row - 1, row - 1).abs().to_f64();
        let around = if neighbours > 0.0 { neighbours } else { matrix.norm() };
        if matrix.at(row, row - 1).abs().to_f64() <= M::Scalar::EPSILON * around {
            matrix.set(row, row - 1, M::Scalar::ZERO);
            return row;
        }
    }
    0
}

/// Eigenvalues of the 2×2 block at `first`.
#[inline(always)]
fn pair<M: Square>(matrix: &M, first: usize) -> [Complex<f64>; 2] {
    let (a, d) = (matrix.at(first, first), matrix.at(first + 1, first + 1));
    let half = (a - d).scaled(0.5);
    let product = matrix.at(first, first + 1) * matrix.at(first + 1, first);
    let discriminant = half * half + product;
    let centre = (a + d).scaled(0.5);
    if discriminant < M::Scalar::ZERO {
        let imaginary = (-discriminant).sqrt().to_f64();
        let real = centre.to_f64();
        return [Complex::new(real, imaginary), Complex::new(real, -imaginary)];
    }
    // Away from d without cancellation; the other from the product of both differences.
    let root = discriminant.sqrt();
    let away = if half < M::Scalar::ZERO { half - root } else { half + root };
    let near = if away == M::Scalar::ZERO { d } else { d - product / away };
    [Complex::new((d + away).to_f64(), 0.0), Complex::new(near.to_f64(), 0.0)]
}

/// One QR step with the two shifts of the trailing 2×2 block, or with made-up ones (`exceptional`) that
/// break a cycle, on the unreduced block `first`..=`end` of at least three rows.
#[inline(always)]
fn francis_step<M: Square>(matrix: &mut M, first: usize, end: usize, exceptional: bool) {
    let (trace, determinant) = shifts(matrix, end, exceptional);
    let (corner, below) = (matrix.at(first, first), matrix.at(first + 1, first));
    let next = matrix.at(first + 1, first + 1);
    let mut bulge = [
        corner * (corner - trace) + determinant + matrix.at(first, first + 1) * below,
        below * (corner + next - trace),
        below * matrix.at(first + 2, first + 1),
    ];
    let size = matrix.size();
    for row in first..end {
        if let Some(reflection) = Reflection::new(bulge) {
            // Of few rows it is faster to reflect all than to count those that matter.
            let (left, right, top, bottom) = match size {
                ..=4 => (0, size, 0, size),
                _ => (row.max(first + 1) - 1, end + 1, first, (row + 4).min(end + 1)),
            };
            if row + 2 <= end {
                reflection.rows::<3, M>(matrix, row, left, right);
                reflection.columns::<3, M>(matrix, row, top, bottom);
            } else {
                reflection.rows::<2, M>(matrix, row, left, right);
                reflection.columns::<2, M>(matrix, row, top, bottom);
            }
        }
        if row + 1 < end {
            let third = if row + 3 <= end { matrix.at(row + 3, row) } else { M::Scalar::ZERO };
            bulge = [matrix.at(row + 1, row), matrix.at(row + 2, row), third];
        }
    }
    for row in first + 2..=end {
        for column in first..row - 1 {
            matrix.set(row, column, M::Scalar::ZERO);
        }
    }
}

/// Sum and product of the two shifts.
#[inline(always)]
fn shifts<M: Square>(matrix: &M, end: usize, exceptional: bool) -> (M::Scalar, M::Scalar) {
    let (a, b) = (matrix.at(end - 1, end - 1), matrix.at(end - 1, end));
    let (c, d) = (matrix.at(end, end - 1), matrix.at(end, end));
    if exceptional {
        let size = c.abs() + matrix.at(end - 1, end - 2).abs();
        let shifted = d + size.scaled(0.75);
        return (shifted + shifted, shifted * shifted + (size * size).scaled(0.4375));
    }
    (a + d, a * d - b * c)
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::double_double::DoubleDouble;
    use super::super::square::{Square4, SquareN};
    use super::*;

    fn of(size: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<Complex<f64>> {
        let matrix = SquareN::from_fn(size, entry);
        let (mut double, mut exact) = (vec![Complex::default(); size], vec![Complex::default(); size]);
        eigenvalues(matrix.clone(), &mut double).unwrap();
        eigenvalues(matrix.map(DoubleDouble::from), &mut exact).unwrap();
        assert!(gap(&double, &exact) < 1e-7, "{double:?} {exact:?}");
        exact
    }

    /// Largest distance from one of `found` to the nearest of `expected` that is not taken yet.
    fn gap(found: &[Complex<f64>], expected: &[Complex<f64>]) -> f64 {
        let mut rest = expected.to_vec();
        found.iter().fold(0.0, |largest: f64, value| {
            let distance = |other: &Complex<f64>| (other - value).norm();
            let nearest = (0..rest.len()).min_by(|&i, &j| distance(&rest[i]).total_cmp(&distance(&rest[j])));
            largest.max(distance(&rest.swap_remove(nearest.unwrap())))
        })
    }

    #[test]
    fn cyclic_permutations_have_the_roots_of_unity() {
        for size in 1..=12 {
            let found = of(size, |i, j| f64::from(u8::from((i + 1) % size == j)));
            let root = |k: usize| Complex::from_polar(1.0, std::f64::consts::TAU * k as f64 / size as f64);
            let expected: Vec<_> = (0..size).map(root).collect();
            assert!(gap(&found, &expected) < 1e-14, "{found:?}");
        }
    }

    #[test]
    fn triangular_and_defective_matrices_have_their_diagonal() {
        let found = of(5, |i, j| if i == j { i as f64 - 2.0 } else { f64::from(u8::from(i < j)) });
        assert!(gap(&found, &[-2.0, -1.0, 0.0, 1.0, 2.0].map(Complex::from)) < 1e-15);
        let jordan = of(6, |i, j| f64::from(u8::from(i + 1 == j)));
        assert_eq!(jordan, vec![Complex::default(); 6]);
    }

    #[test]
    fn random_matrices_agree_with_nalgebra() {
        let mut generator = ChaCha8Rng::seed_from_u64(3);
        for size in [2, 3, 4, 4, 7, 15] {
            let entries: Vec<f64> = (0..size * size).map(|_| generator.random_range(-1.0..1.0)).collect();
            let found = of(size, |i, j| entries[i * size + j]);
            let peer = DMatrix::from_row_slice(size, size, &entries).complex_eigenvalues();
            assert!(gap(&found, peer.as_slice()) < 1e-12);
            if let Ok(stack) = <[f64; 16]>::try_from(entries) {
                let mut poles = [Complex::default(); 4];
                eigenvalues(Square4(stack), &mut poles).unwrap();
                assert!(gap(&poles, &found) < 1e-13);
            }
        }
    }

    #[test]
    fn not_a_number_has_no_eigenvalues() {
        let matrix = SquareN::from_fn(3, |_, _| f64::NAN);
        assert!(eigenvalues(matrix, &mut [Complex::default(); 3]).is_none());
    }
}
