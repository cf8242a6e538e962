//! Square matrices for the Riccati solvers, row by row: on the stack for the robot's four states, on the
//! heap for any other size. Every operation is written once; with a constant size the loops unroll.

use super::real::Real;

/// A square matrix of scalars.
pub(super) trait Square: Clone {
    type Scalar: Real;

    /// Number of rows.
    fn size(&self) -> usize;
    /// A zero matrix of the same size.
    fn zeros(&self) -> Self;
    /// The entries, row by row.
    fn entries(&self) -> &[Self::Scalar];
    fn entries_mut(&mut self) -> &mut [Self::Scalar];

    #[inline(always)]
    fn at(&self, row: usize, column: usize) -> Self::Scalar {
        self.entries()[row * self.size() + column]
    }

    #[inline(always)]
    fn set(&mut self, row: usize, column: usize, value: Self::Scalar) {
        let size = self.size();
        self.entries_mut()[row * size + column] = value;
    }

    #[inline(always)]
    fn row(&self, row: usize) -> &[Self::Scalar] {
        let size = self.size();
        &self.entries()[row * size..(row + 1) * size]
    }

    #[inline(always)]
    fn row_mut(&mut self, row: usize) -> &mut [Self::Scalar] {
        let size = self.size();
        &mut self.entries_mut()[row * size..(row + 1) * size]
    }

    /// self · other
    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        let mut product = self.zeros();
        for i in 0..self.size() {
            for k in 0..self.size() {
                add_multiple(product.row_mut(i), other.row(k), self.at(i, k));
            }
        }
        product
    }

    /// selfᵀ · other
    #[inline(always)]
    fn transposed_times(&self, other: &Self) -> Self {
        let mut product = self.zeros();
        for k in 0..self.size() {
            for i in 0..self.size() {
                add_multiple(product.row_mut(i), other.row(k), self.at(k, i));
            }
        }
        product
    }

    #[inline(always)]
    fn transposed(&self) -> Self {
        let mut transposed = self.zeros();
        for i in 0..self.size() {
            for j in 0..self.size() {
                transposed.set(j, i, self.at(i, j));
            }
        }
        transposed
    }

    /// self + factor · other
    #[inline(always)]
    fn plus_multiple(mut self, other: &Self, factor: Self::Scalar) -> Self {
        add_multiple(self.entries_mut(), other.entries(), factor);
        self
    }

    /// self + value · I
    #[inline(always)]
    fn plus_diagonal(mut self, value: Self::Scalar) -> Self {
        for i in 0..self.size() {
            let sum = self.at(i, i) + value;
            self.set(i, i, sum);
        }
        self
    }

    #[inline(always)]
    fn times_scalar(mut self, factor: Self::Scalar) -> Self {
        for entry in self.entries_mut() {
            *entry = *entry * factor;
        }
        self
    }

    /// (self + selfᵀ) / 2
    #[inline(always)]
    fn symmetric_part(mut self) -> Self {
        for i in 0..self.size() {
            for j in 0..i {
                let mean = (self.at(i, j) + self.at(j, i)).scaled(0.5);
                self.set(i, j, mean);
                self.set(j, i, mean);
            }
        }
        self
    }

    /// trace(self · other)
    #[inline(always)]
    fn trace_of_product(&self, other: &Self) -> Self::Scalar {
        let mut trace = Self::Scalar::ZERO;
        for i in 0..self.size() {
            for j in 0..self.size() {
                trace += self.at(i, j) * other.at(j, i);
            }
        }
        trace
    }

    /// Square of the Frobenius norm, as a double.
    #[inline(always)]
    fn norm_squared(&self) -> f64 {
        // Four sums, because one alone waits for each addition.
        let mut sums = [0.0; 4];
        for (index, entry) in self.entries().iter().enumerate() {
            sums[index % 4] += entry.to_f64() * entry.to_f64();
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }

    /// Frobenius norm, as a double.
    #[inline(always)]
    fn norm(&self) -> f64 {
        self.norm_squared().sqrt()
    }

    /// Replaces each of `sides` by self⁻¹ · side; `None` where self is singular or not finite.
    fn solve<const SIDES: usize>(self, sides: [&mut Self; SIDES]) -> Option<()>;

    /// self⁻¹, `None` where self is singular or not finite.
    #[inline(always)]
    fn inverse(self) -> Option<Self> {
        let mut inverse = self.zeros().plus_diagonal(Self::Scalar::ONE);
        self.solve([&mut inverse])?;
        Some(inverse)
    }
}

#[inline(always)]
fn add_multiple<T: Real>(sum: &mut [T], terms: &[T], factor: T) {
    for (entry, term) in sum.iter_mut().zip(terms) {
        *entry += factor * *term;
    }
}

/// 4×4 on the stack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square4(pub(super) [f64; 16]);

impl Square for Square4 {
    type Scalar = f64;

    #[inline(always)]
    fn size(&self) -> usize {
        4
    }

    #[inline(always)]
    fn zeros(&self) -> Self {
        Self([0.0; 16])
    }

    #[inline(always)]
    fn entries(&self) -> &[f64] {
        &self.0
    }

    #[inline(always)]
    fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }

    #[inline(always)]
    fn solve<const SIDES: usize>(self, sides: [&mut Self; SIDES]) -> Option<()> {
        let inverse = self.inverse()?;
        for side in sides {
            *side = inverse.times(side);
        }
        Some(())
    }

    /// By cofactors: no branch and one division, which here is worth more than pivoting.
    #[inline(always)]
    fn inverse(self) -> Option<Self> {
        let m = &self.0;
        let (s, c) = (minors(m, 0), minors(m, 8));
        let determinant = s[0] * c[5] - s[1] * c[4] + s[2] * c[3] + s[3] * c[2] - s[4] * c[1] + s[5] * c[0];
        let scale = 1.0 / determinant;
        if !scale.is_finite() {
            return None;
        }
        Some(Self([
            (m[5] * c[5] - m[6] * c[4] + m[7] * c[3]) * scale,
            (m[2] * c[4] - m[1] * c[5] - m[3] * c[3]) * scale,
            (m[13] * s[5] - m[14] * s[4] + m[15] * s[3]) * scale,
            (m[10] * s[4] - m[9] * s[5] - m[11] * s[3]) * scale,
            (m[6] * c[2] - m[4] * c[5] - m[7] * c[1]) * scale,
            (m[0] * c[5] - m[2] * c[2] + m[3] * c[1]) * scale,
            (m[14] * s[2] - m[12] * s[5] - m[15] * s[1]) * scale,
            (m[8] * s[5] - m[10] * s[2] + m[11] * s[1]) * scale,
            (m[4] * c[4] - m[5] * c[2] + m[7] * c[0]) * scale,
            (m[1] * c[2] - m[0] * c[4] - m[3] * c[0]) * scale,
            (m[12] * s[4] - m[13] * s[2] + m[15] * s[0]) * scale,
            (m[9] * s[2] - m[8] * s[4] - m[11] * s[0]) * scale,
            (m[5] * c[1] - m[4] * c[3] - m[6] * c[0]) * scale,
            (m[0] * c[3] - m[1] * c[1] + m[2] * c[0]) * scale,
            (m[13] * s[1] - m[12] * s[3] - m[14] * s[0]) * scale,
            (m[8] * s[3] - m[9] * s[1] + m[10] * s[0]) * scale,
        ]))
    }
}

/// The 2×2 minors of two neighbouring rows, from the entry `first` on, by pairs of columns.
#[inline(always)]
fn minors(m: &[f64; 16], first: usize) -> [f64; 6] {
    let [a, b, c, d] = [m[first], m[first + 1], m[first + 2], m[first + 3]];
    let [e, f, g, h] = [m[first + 4], m[first + 5], m[first + 6], m[first + 7]];
    [a * f - b * e, a * g - c * e, a * h - d * e, b * g - c * f, b * h - d * f, c * h - d * g]
}

/// n×n on the heap.
#[derive(Clone, Debug)]
pub(super) struct SquareN<T> {
    size: usize,
    entries: Vec<T>,
}

impl<T: Real> SquareN<T> {
    pub(super) fn from_fn(size: usize, entry: impl Fn(usize, usize) -> T) -> Self {
        let entries = (0..size * size).map(|index| entry(index / size, index % size)).collect();
        Self { size, entries }
    }

    pub(super) fn map<U: Real>(&self, entry: impl Fn(T) -> U) -> SquareN<U> {
        SquareN { size: self.size, entries: self.entries.iter().copied().map(entry).collect() }
    }

    /// |det self|^(1/size): the geometric mean of the moduli of the eigenvalues; 0 where singular.
    pub(super) fn mean_modulus(mut self) -> f64 {
        if self.eliminate([]).is_none() {
            return 0.0;
        }
        let logarithms: f64 = (0..self.size()).map(|i| self.at(i, i).to_f64().abs().ln()).sum();
        (logarithms / self.size() as f64).exp()
    }

    /// Gaussian elimination with partial pivoting: replaces each of `sides` by self⁻¹ · side and leaves the
    /// pivots on the diagonal. `None` where a pivot is zero or not finite.
    fn eliminate<const SIDES: usize>(&mut self, mut sides: [&mut Self; SIDES]) -> Option<()> {
        let size = self.size();
        for column in 0..size {
            self.pivot(column, &mut sides)?;
            let inverse = T::ONE / self.at(column, column);
            for row in column + 1..size {
                let factor = -(self.at(row, column) * inverse);
                self.add_row_multiple(column, row, factor, column + 1);
                for side in &mut sides {
                    side.add_row_multiple(column, row, factor, 0);
                }
            }
        }
        for row in (0..size).rev() {
            let inverse = T::ONE / self.at(row, row);
            for side in &mut sides {
                for later in row + 1..size {
                    side.add_row_multiple(later, row, -self.at(row, later), 0);
                }
                for entry in side.row_mut(row) {
                    *entry = *entry * inverse;
                }
            }
        }
        Some(())
    }

    /// Brings the largest entry of `column` on or below the diagonal onto it.
    fn pivot<const SIDES: usize>(&mut self, column: usize, sides: &mut [&mut Self; SIDES]) -> Option<()> {
        let mut best = column;
        for row in column + 1..self.size() {
            if self.at(row, column).abs() > self.at(best, column).abs() {
                best = row;
            }
        }
        if best != column {
            self.swap_rows(column, best);
            for side in sides {
                side.swap_rows(column, best);
            }
        }
        let pivot = self.at(column, column);
        (pivot.is_finite() && pivot != T::ZERO).then_some(())
    }

    fn swap_rows(&mut self, first: usize, second: usize) {
        for column in 0..self.size() {
            let (upper, lower) = (self.at(first, column), self.at(second, column));
            self.set(first, column, lower);
            self.set(second, column, upper);
        }
    }

    /// Row `to` += factor · row `from`, in the columns `start` and later.
    fn add_row_multiple(&mut self, from: usize, to: usize, factor: T, start: usize) {
        for column in start..self.size() {
            let sum = self.at(to, column) + factor * self.at(from, column);
            self.set(to, column, sum);
        }
    }
}

impl<T: Real> Square for SquareN<T> {
    type Scalar = T;

    fn size(&self) -> usize {
        self.size
    }

    fn zeros(&self) -> Self {
        Self { size: self.size, entries: vec![T::ZERO; self.size * self.size] }
    }

    fn entries(&self) -> &[T] {
        &self.entries
    }

    fn entries_mut(&mut self) -> &mut [T] {
        &mut self.entries
    }

    fn solve<const SIDES: usize>(mut self, sides: [&mut Self; SIDES]) -> Option<()> {
        self.eliminate(sides)
    }
}
