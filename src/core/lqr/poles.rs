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
    fn new(vector: [T; 3]) -> Option<Self> {
        let largest = vector.iter().fold(0.0, |largest, x| x.abs().to_f64().max(largest));
        if vector[1].abs().to_f64().max(vector[2].abs().to_f64()) == 0.0 {
            return None;
        }
        let unit = T::ONE / T::from_f64(largest);
        let [x, y, z] = vector.map(|entry| entry * unit);
        let length = (x * x + y * y + z * z).sqrt();
        let first = if x < T::ZERO { x - length } else { x + length };
        let (second, third) = (y / first, z / first);
        let scale = first.abs() / length;
        Some(Self { v: [T::ONE, second, third], w: [scale, scale * second, scale * third] })
    }

    /// Reflects `count` rows from `top` on, in the columns from `start` to `end` exclusive.
    #[inline(always)]
    fn rows<M: Square<Scalar = T>>(
        &self,
        matrix: &mut M,
        top: usize,
        count: usize,
        start: usize,
        end: usize,
    ) {
        for column in start..end {
            let mut sum = T::ZERO;
            for i in 0..count {
                sum += self.v[i] * matrix.at(top + i, column);
            }
            for i in 0..count {
                let entry = matrix.at(top + i, column) - self.w[i] * sum;
                matrix.set(top + i, column, entry);
            }
        }
    }

    /// Reflects `count` columns from `left` on, in the rows from `start` to `end` exclusive.
    #[inline(always)]
    fn columns<M: Square<Scalar = T>>(
        &self,
        matrix: &mut M,
        left: usize,
        count: usize,
        start: usize,
        end: usize,
    ) {
        for row in start..end {
            let mut sum = T::ZERO;
            for i in 0..count {
                sum += self.v[i] * matrix.at(row, left + i);
            }
            for i in 0..count {
                let entry = matrix.at(row, left + i) - self.w[i] * sum;
                matrix.set(row, left + i, entry);
            }
        }
    }
}

/// Clears each column below its subdiagonal, by reflections of the pairs (column + 1, row).
#[inline(always)]
fn reduce_to_hessenberg<M: Square>(matrix: &mut M) {
    let size = matrix.size();
    for column in 0..size.saturating_sub(2) {
        eliminate(matrix, column);
    }
}

/// One Householder similarity: rows and columns after `column`.
#[inline(always)]
fn eliminate<M: Square>(matrix: &mut M, column: usize) {
    let size = matrix.size();
    let top = column + 1;
    let mut largest = 0.0_f64;
    for row in top + 1..size {
        largest = largest.max(matrix.at(row, column).abs().to_f64());
    }
    if largest == 0.0 {
        return;
    }
    largest = largest.max(matrix.at(top, column).abs().to_f64());
    let unit = M::Scalar::ONE / M::Scalar::from_f64(largest);
    let mut squares = M::Scalar::ZERO;
    for row in top..size {
        let entry = matrix.at(row, column) * unit;
        squares += entry * entry;
    }
    let length = squares.sqrt();
    let x = matrix.at(top, column) * unit;
    let first = if x < M::Scalar::ZERO { x - length } else { x + length };
    // v = (1, …) stays in the column below the subdiagonal while it is applied to the rest.
    let to_v = unit / first;
    for row in top + 1..size {
        let entry = matrix.at(row, column) * to_v;
        matrix.set(row, column, entry);
    }
    matrix.set(top, column, M::Scalar::ONE);
    let scale = first.abs() / length;
    for other in column + 1..size {
        let mut sum = M::Scalar::ZERO;
        for row in top..size {
            sum += matrix.at(row, column) * matrix.at(row, other);
        }
        for row in top..size {
            let entry = matrix.at(row, other) - scale * sum * matrix.at(row, column);
            matrix.set(row, other, entry);
        }
    }
    for row in 0..size {
        let mut sum = M::Scalar::ZERO;
        for other in top..size {
            sum += matrix.at(row, other) * matrix.at(other, column);
        }
        for other in top..size {
            let entry = matrix.at(row, other) - scale * sum * matrix.at(other, column);
            matrix.set(row, other, entry);
        }
    }
    let image = if x < M::Scalar::ZERO { length } else { -length };
    matrix.set(top, column, image * M::Scalar::from_f64(largest));
    for row in top + 1..size {
        matrix.set(row, column, M::Scalar::ZERO);
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
    for row in first..end {
        let count = if row + 2 <= end { 3 } else { 2 };
        if let Some(reflection) = Reflection::new(bulge) {
            let start = if row > first { row - 1 } else { first };
            if count == 3 {
                reflection.rows(matrix, row, 3, start, end + 1);
                reflection.columns(matrix, row, 3, first, (row + 4).min(end + 1));
            } else {
                reflection.rows(matrix, row, 2, start, end + 1);
                reflection.columns(matrix, row, 2, first, end + 1);
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
