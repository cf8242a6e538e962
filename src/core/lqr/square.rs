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
        self.entries().iter().map(|entry| entry.to_f64() * entry.to_f64()).sum()
    }

    /// Frobenius norm, as a double.
    #[inline(always)]
    fn norm(&self) -> f64 {
        self.norm_squared().sqrt()
    }

    /// Gaussian elimination with partial pivoting: replaces each right side by self⁻¹ · side and leaves
    /// the pivots on the diagonal. `None` where a pivot is zero or not finite.
    #[inline(always)]
    fn solve<const SIDES: usize>(&mut self, mut sides: [&mut Self; SIDES]) -> Option<()> {
        let size = self.size();
        for column in 0..size {
            self.pivot(column, &mut sides)?;
            let inverse = Self::Scalar::ONE / self.at(column, column);
            for row in column + 1..size {
                let factor = -(self.at(row, column) * inverse);
                self.add_row_multiple(column, row, factor, column + 1);
                for side in &mut sides {
                    side.add_row_multiple(column, row, factor, 0);
                }
            }
        }
        for row in (0..size).rev() {
            let inverse = Self::Scalar::ONE / self.at(row, row);
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
    #[inline(always)]
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
        (pivot.is_finite() && pivot != Self::Scalar::ZERO).then_some(())
    }

    #[inline(always)]
    fn swap_rows(&mut self, first: usize, second: usize) {
        for column in 0..self.size() {
            let (upper, lower) = (self.at(first, column), self.at(second, column));
            self.set(first, column, lower);
            self.set(second, column, upper);
        }
    }

    /// Row `to` += factor · row `from`, in the columns `start` and later.
    #[inline(always)]
    fn add_row_multiple(&mut self, from: usize, to: usize, factor: Self::Scalar, start: usize) {
        for column in start..self.size() {
            let sum = self.at(to, column) + factor * self.at(from, column);
            self.set(to, column, sum);
        }
    }

    /// self⁻¹, `None` where a pivot is zero.
    #[inline(always)]
    fn inverse(mut self) -> Option<Self> {
        let mut inverse = self.zeros().plus_diagonal(Self::Scalar::ONE);
        self.solve([&mut inverse])?;
        Some(inverse)
    }

    /// |det self|^(1/size): the geometric mean of the moduli of the eigenvalues; 0 where singular.
    #[inline(always)]
    fn mean_modulus(mut self) -> f64 {
        if self.solve([]).is_none() {
            return 0.0;
        }
        let logarithms: f64 = (0..self.size()).map(|i| self.at(i, i).to_f64().abs().ln()).sum();
        (logarithms / self.size() as f64).exp()
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
}
