//! Products of columns with each other: one pass over the rows, in tiles whose sums stay in registers.

use nalgebra::DMatrix;
use pulp::{Simd, WithSimd};

/// Rows of one chunk, whose products stay near the processor.
const CHUNK: usize = 256;
/// Columns on either side of a tile.
const TILE: usize = 4;

/// Gram matrices of `columns`, one for each block; `block` numbers the block of each row, from 0. Besides, the number
/// of rows in each block.
pub(super) fn gram_of_blocks(columns: &[&[f64]], block: &[usize]) -> (Vec<DMatrix<f64>>, Vec<usize>) {
    let count = block.iter().max().map_or(0, |last| last + 1);
    let mut blocks = vec![DMatrix::zeros(columns.len(), columns.len()); count];
    let mut block_rows = vec![0; count];
    let (mut runs, mut start) = (Vec::new(), 0);
    for run in block.chunk_by(|a, b| a == b) {
        runs.push((run[0], start..start + run.len()));
        block_rows[run[0]] += run.len();
        start += run.len();
    }
    for (block, rows) in runs {
        pulp::Arch::new().dispatch(AddProducts { gram: &mut blocks[block], columns, rows });
    }
    blocks.iter_mut().for_each(mirror);
    (blocks, block_rows)
}

/// Σ column target for each column and for the target itself, in each block.
pub(super) fn products_with(columns: &[&[f64]], target: &[f64], block: &[usize]) -> Vec<Vec<f64>> {
    let mut found = vec![vec![0.0; columns.len() + 1]; block.iter().max().map_or(0, |last| last + 1)];
    let mut start = 0;
    for run in block.chunk_by(|a, b| a == b) {
        let rows = start..start + run.len();
        start = rows.end;
        for (sum, column) in found[run[0]].iter_mut().zip(columns.iter().chain([&target])) {
            let add = Dot { left: &column[rows.clone()], right: &target[rows.clone()] };
            *sum += pulp::Arch::new().dispatch(add);
        }
    }
    found
}

/// Σ left right.
struct Dot<'a> {
    left: &'a [f64],
    right: &'a [f64],
}

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        const SIDE_BY_SIDE: usize = 4;
        let (left, left_rest) = S::as_simd_f64s(self.left);
        let (right, right_rest) = S::as_simd_f64s(self.right);
        let mut sums = [simd.splat_f64s(0.0); SIDE_BY_SIDE];
        for (left, right) in left.chunks(SIDE_BY_SIDE).zip(right.chunks(SIDE_BY_SIDE)) {
            for ((sum, left), right) in sums.iter_mut().zip(left).zip(right) {
                *sum = simd.mul_add_e_f64s(*left, *right, *sum);
            }
        }
        let rest: f64 = left_rest.iter().zip(right_rest).map(|(a, b)| a * b).sum();
        sums.iter().map(|sum| simd.reduce_sum_f64s(*sum)).sum::<f64>() + rest
    }
}

/// Adds the products of some rows to the lower triangle.
struct AddProducts<'a> {
    gram: &'a mut DMatrix<f64>,
    columns: &'a [&'a [f64]],
    rows: std::ops::Range<usize>,
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { gram, columns, rows } = self;
        let count = columns.len();
        let corners = || (0..count).step_by(TILE).flat_map(|j| (j..count).step_by(TILE).map(move |i| (i, j)));
        let mut tiles: Vec<Tile<S>> = corners().map(|_| Tile::new(simd)).collect();
        for from in rows.clone().step_by(CHUNK) {
            let chunk = from..(from + CHUNK).min(rows.end);
            // Columns beyond the last are the last again, and their sums are dropped.
            let side = |first: usize| -> [&[f64]; TILE] {
                std::array::from_fn(|i| &columns[(first + i).min(count - 1)][chunk.clone()])
            };
            for (tile, (left, right)) in tiles.iter_mut().zip(corners()) {
                tile.add(simd, side(left), side(right));
            }
        }
        for (tile, (left, right)) in tiles.iter().zip(corners()) {
            for (j, sums) in (right..count).zip(tile.sums(simd)) {
                for (i, sum) in (left..count).zip(sums) {
                    gram[(i, j)] += sum;
                }
            }
        }
    }
}

/// Σ left right for each pair of a tile's columns, those with the first of `right` first: lanes side by side, and the
/// rows that fill no lane.
struct Tile<S: Simd> {
    lanes: [[S::f64s; TILE]; TILE],
    rest: [[f64; TILE]; TILE],
}

impl<S: Simd> Tile<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { lanes: [[simd.splat_f64s(0.0); TILE]; TILE], rest: [[0.0; TILE]; TILE] }
    }

    #[inline(always)]
    fn add(&mut self, simd: S, left: [&[f64]; TILE], right: [&[f64]; TILE]) {
        let whole = S::as_simd_f64s(left[0]).0.len();
        let lanes_of = left.map(|column| &S::as_simd_f64s(column).0[..whole]);
        let lanes_with = right.map(|column| &S::as_simd_f64s(column).0[..whole]);
        let mut sums = self.lanes;
        for place in 0..whole {
            let left = lanes_of.map(|column| column[place]);
            let right = lanes_with.map(|column| column[place]);
            for (sums, right) in sums.iter_mut().zip(right) {
                for (sum, left) in sums.iter_mut().zip(left) {
                    *sum = simd.mul_add_e_f64s(left, right, *sum);
                }
            }
        }
        self.lanes = sums;
        let (left, right) = (left.map(|c| S::as_simd_f64s(c).1), right.map(|c| S::as_simd_f64s(c).1));
        for (sums, right) in self.rest.iter_mut().zip(right) {
            for (sum, left) in sums.iter_mut().zip(left) {
                *sum += left.iter().zip(right).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }

    #[inline(always)]
    fn sums(&self, simd: S) -> [[f64; TILE]; TILE] {
        std::array::from_fn(|j| {
            std::array::from_fn(|i| simd.reduce_sum_f64s(self.lanes[j][i]) + self.rest[j][i])
        })
    }
}

fn mirror(gram: &mut DMatrix<f64>) {
    for j in 0..gram.ncols() {
        for i in 0..j {
            gram[(i, j)] = gram[(j, i)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_is_that_of_its_columns_in_its_block() {
        let value = |column: usize, row: usize| ((7 * column + 3) * row % 11) as f64 - 5.0;
        for (count, rows) in [(1, 3), (4, 64), (6, 1500), (17, 700)] {
            let columns: Vec<Vec<f64>> =
                (0..count).map(|column| (0..rows).map(|row| value(column, row)).collect()).collect();
            let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let block: Vec<usize> = (0..rows).map(|row| 2 * row / rows).collect();
            let (blocks, of_block) = gram_of_blocks(&views, &block);
            assert_eq!(of_block.iter().sum::<usize>(), rows);
            let with = products_with(&views, views[0], &block);
            for (number, gram) in blocks.iter().enumerate() {
                for i in 0..count {
                    for j in 0..count {
                        let own = (0..rows).filter(|&row| block[row] == number);
                        let sum: f64 = own.map(|row| value(i, row) * value(j, row)).sum();
                        assert_eq!(gram[(i, j)], sum, "{count} {rows} {i} {j}");
                        assert!(i > 0 || with[number][j] == sum, "{count} {rows} {j}");
                    }
                }
            }
        }
    }
}
