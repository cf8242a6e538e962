//! Which of many columns a target needs: least squares with bounded nuisances, assessed by leaving out blocks.
//!
//! Everything is computed from the Gram matrices of blocks of neighbouring rows, which one pass over the rows makes.
//! A block is long against the memory of the residual, so that errors and intervals hold under coloured noise:
//! nothing here takes rows for independent.

mod products;

use nalgebra::{DMatrix, DVector};

use products::{gram_of_blocks, products_with};

/// A pivot of the scaled matrix below this is a column that depends on those before it.
const DEPENDENT: f64 = 1e-9;

/// Gram matrices of columns and target, one for each block of rows.
#[derive(Clone, Debug)]
pub struct Blocks {
    /// The target is the last column.
    blocks: Vec<DMatrix<f64>>,
    block_rows: Vec<usize>,
    total: DMatrix<f64>,
    rows: usize,
}

/// A column that takes part in a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Which column.
    pub column: usize,
    /// Standard deviation of what is known of its coefficient beforehand, about 0; infinite where nothing is.
    pub spread: f64,
    /// Lowest and highest coefficient.
    pub bounds: [f64; 2],
}

impl Member {
    /// A column with any coefficient.
    pub fn free(column: usize) -> Self {
        Self { column, spread: f64::INFINITY, bounds: [f64::NEG_INFINITY, f64::INFINITY] }
    }

    /// A correction of a declared number that is known within ± `tolerance`.
    pub fn within(column: usize, tolerance: f64) -> Self {
        Self { column, spread: tolerance / 3_f64.sqrt(), bounds: [-tolerance, tolerance] }
    }
}

/// A fit and what leaving out one block after another says of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Coefficients of the members in their order.
    pub coefficients: Vec<f64>,
    /// Sum of squares that is left on the rows of the fit.
    pub left: f64,
    /// Sum of squares left on each block by the fit of the others.
    pub held_out: Vec<f64>,
    /// Covariance of the coefficients by the jackknife over blocks.
    pub covariance: DMatrix<f64>,
}

/// Estimates without bounds, and how sure they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Coefficients of the members in their order.
    pub estimates: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Standard errors by the rows alone, with nothing known beforehand.
    pub alone: Vec<f64>,
}

impl Spread {
    /// Standard error of a coefficient.
    pub fn standard_error(&self, member: usize) -> f64 {
        self.covariance[(member, member)].max(0.0).sqrt()
    }
}

impl Judged {
    /// Sum of squares over all left-out blocks.
    pub fn error(&self) -> f64 {
        self.held_out.iter().sum()
    }

    /// Share by which the error on left-out blocks is lower than that of `other`.
    pub fn gain_over(&self, other: &Self) -> f64 {
        1.0 - self.error() / other.error()
    }

    /// Returns the gain over `other` in standard errors, from its spread over the blocks.
    pub fn gain_z(&self, other: &Self) -> f64 {
        let gains: Vec<f64> = other.held_out.iter().zip(&self.held_out).map(|(a, b)| a - b).collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0);
        mean / (variance / count).sqrt()
    }

    /// Length of a group's coefficients in standard errors along their own direction; `lengths` make coefficients of
    /// different units comparable.
    pub fn z(&self, members: std::ops::Range<usize>, lengths: &[f64]) -> f64 {
        let scaled: Vec<f64> =
            members.clone().zip(lengths).map(|(i, length)| self.coefficients[i] * length).collect();
        let size = scaled.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut variance = 0.0;
        for (a, i) in members.clone().enumerate() {
            for (b, j) in members.clone().enumerate() {
                variance += scaled[a] * scaled[b] * lengths[a] * lengths[b] * self.covariance[(i, j)];
            }
        }
        if size > 0.0 { size * size / variance.sqrt() } else { 0.0 }
    }

    /// Standard error of a coefficient.
    pub fn standard_error(&self, member: usize) -> f64 {
        self.covariance[(member, member)].max(0.0).sqrt()
    }
}

/// Numbers of the blocks of rows, which lie log by log: no block spans two logs, and each log has as many as its length
/// asks for.
pub fn blocks_of(log_rows: &[usize], blocks: usize) -> Vec<usize> {
    let total: usize = log_rows.iter().sum();
    let (mut found, mut next) = (Vec::with_capacity(total), 0);
    for &rows in log_rows.iter().filter(|rows| **rows > 0) {
        let own = ((blocks * rows) as f64 / total as f64).round().max(1.0) as usize;
        found.extend((0..rows).map(|row| next + row * own / rows));
        next += own;
    }
    found
}

impl Blocks {
    /// Products of `columns` and `target`; `block` numbers the block of each row, from 0.
    pub fn new(columns: &[&[f64]], target: &[f64], block: &[usize]) -> Self {
        let all: Vec<&[f64]> = columns.iter().copied().chain([target]).collect();
        let (blocks, block_rows) = gram_of_blocks(&all, block);
        let mut total = DMatrix::zeros(all.len(), all.len());
        for block in &blocks {
            total += block;
        }
        Self { blocks, block_rows, total, rows: target.len() }
    }

    /// Takes out of a product of two columns what noise that both have puts into it, `share` in each row.
    pub fn discount(&mut self, a: usize, b: usize, share: f64) {
        for (gram, rows) in self.blocks.iter_mut().zip(&self.block_rows) {
            let noise = share * *rows as f64;
            gram[(a, b)] -= noise;
            self.total[(a, b)] -= noise;
            if a != b {
                gram[(b, a)] -= noise;
                self.total[(b, a)] -= noise;
            }
        }
    }

    /// Place of the target in a product.
    pub fn target(&self) -> usize {
        self.total.nrows() - 1
    }

    /// Rows in all.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        self.blocks.len()
    }

    /// Length of a column.
    pub fn length(&self, column: usize) -> f64 {
        self.total[(column, column)].sqrt()
    }

    /// Sum of squares of the target.
    pub fn target_power(&self) -> f64 {
        let target = self.total.nrows() - 1;
        self.total[(target, target)]
    }

    /// The fit of all rows; nothing where the members depend on each other. `noise` is the variance of a row, against
    /// which what is known beforehand is weighed.
    pub fn fit(&self, members: &[Member], noise: f64) -> Option<Vec<f64>> {
        fit(&self.total, members, noise)
    }

    /// Sum of squares that coefficients leave on all rows.
    pub fn left(&self, members: &[Member], coefficients: &[f64]) -> f64 {
        left(&self.total, members, coefficients)
    }

    /// The fit, assessed by leaving out one block after another; nothing where the members depend on each other, in all
    /// rows or without a block.
    pub fn judge(&self, members: &[Member], noise: f64) -> Option<Judged> {
        let small = self.of_members(members);
        let own: Vec<Member> =
            members.iter().enumerate().map(|(column, member)| Member { column, ..*member }).collect();
        small.judge_all(&own, noise)
    }

    /// Estimates without bounds and how sure they are; nothing where the members depend on each other.
    ///
    /// The covariance is that of the jackknife over blocks, so that it holds under coloured noise, with what the
    /// declared tolerances leave open: an interval does not collapse where a bound would have held the number.
    pub fn spread(&self, members: &[Member], noise: f64) -> Option<Spread> {
        // What has one possible value is no estimate.
        let (fixed, open): (Vec<usize>, Vec<usize>) =
            (0..members.len()).partition(|&i| members[i].bounds[0] == members[i].bounds[1]);
        let active: Vec<Member> = open.iter().map(|&i| members[i]).collect();
        let size = active.len();
        let right = |gram: &DMatrix<f64>| {
            let held = |column: usize| -> f64 {
                fixed.iter().map(|&i| members[i].bounds[0] * gram[(members[i].column, column)]).sum()
            };
            let products =
                active.iter().map(|member| gram[(member.column, self.target())] - held(member.column));
            DVector::from_iterator(size, products)
        };
        let matrix = normal(&self.total, &active, noise);
        let own = solve(matrix.clone(), &right(&self.total))?;
        let count = self.blocks.len() as f64;
        let mut of_own = DMatrix::zeros(size, size);
        for block in &self.blocks {
            let rest = &self.total - block;
            let shift = solve(normal(&rest, &active, noise), &right(&rest))? - &own;
            of_own.ger((count - 1.0) / count, &shift, &shift, 1.0);
        }
        let scale = matrix.diagonal().map(|value| 1.0 / value.sqrt());
        let scaled = DMatrix::from_fn(size, size, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        for (k, member) in active.iter().enumerate() {
            let known = noise * noise / (member.spread * member.spread);
            if known > 0.0 {
                of_own.ger(known, &inverse.column(k), &inverse.column(k), 1.0);
            }
        }
        let mut estimates: Vec<f64> = members.iter().map(|member| member.bounds[0]).collect();
        let mut covariance = DMatrix::zeros(members.len(), members.len());
        let mut alone = vec![0.0; members.len()];
        for ((i, &a), error) in open.iter().enumerate().zip(self.alone(&active, noise)) {
            (estimates[a], alone[a]) = (own[i], error);
            for (j, &b) in open.iter().enumerate() {
                covariance[(a, b)] = of_own[(i, j)];
            }
        }
        Some(Spread { estimates, covariance, alone })
    }

    /// Standard errors by the information of the rows alone, with nothing known beforehand.
    fn alone(&self, members: &[Member], noise: f64) -> Vec<f64> {
        let lengths: Vec<f64> = members.iter().map(|member| self.length(member.column).max(1e-300)).collect();
        // Of columns that say the same, this leaves an error far beyond any tolerance.
        const RIDGE: f64 = 1e-9;
        let scaled = DMatrix::from_fn(members.len(), members.len(), |i, j| {
            let product = self.total[(members[i].column, members[j].column)] / (lengths[i] * lengths[j]);
            if i == j { product + RIDGE } else { product }
        });
        let inverse = scaled.cholesky().map(|factors| factors.inverse());
        let error = |i: usize| {
            inverse.as_ref().map_or(f64::INFINITY, |m| (noise * m[(i, i)].max(0.0)).sqrt() / lengths[i])
        };
        (0..members.len()).map(error).collect()
    }

    fn judge_all(&self, members: &[Member], noise: f64) -> Option<Judged> {
        let coefficients = self.fit(members, noise)?;
        let count = self.blocks.len() as f64;
        let mut held_out = Vec::with_capacity(self.blocks.len());
        let mut covariance = DMatrix::zeros(members.len(), members.len());
        for block in &self.blocks {
            let others = fit(&(&self.total - block), members, noise)?;
            held_out.push(left(block, members, &others));
            let shift =
                DVector::from_iterator(members.len(), others.iter().zip(&coefficients).map(|(a, b)| a - b));
            covariance.ger((count - 1.0) / count, &shift, &shift, 1.0);
        }
        let left = left(&self.total, members, &coefficients);
        Some(Judged { coefficients, left, held_out, covariance })
    }

    /// Only what a fit of some members needs of the products.
    fn of_members(&self, members: &[Member]) -> Self {
        let columns: Vec<usize> = members.iter().map(|member| member.column).chain([self.target()]).collect();
        let picked = |gram: &DMatrix<f64>| {
            DMatrix::from_fn(columns.len(), columns.len(), |i, j| gram[(columns[i], columns[j])])
        };
        Self {
            blocks: self.blocks.iter().map(picked).collect(),
            block_rows: self.block_rows.clone(),
            total: picked(&self.total),
            rows: self.rows,
        }
    }

    /// Returns the same columns with another target.
    pub fn retargeted(&self, columns: &[&[f64]], target: &[f64], block: &[usize]) -> Self {
        let mut found = self.clone();
        let last = self.target();
        found.total.row_mut(last).fill(0.0);
        found.total.column_mut(last).fill(0.0);
        let of_blocks = products_with(columns, target, block);
        for (gram, products) in found.blocks.iter_mut().zip(of_blocks) {
            for (column, product) in products.into_iter().enumerate() {
                (gram[(last, column)], gram[(column, last)]) = (product, product);
                found.total[(last, column)] += product;
                if column != last {
                    found.total[(column, last)] += product;
                }
            }
        }
        found
    }

    /// Fraction of one combination of columns (what an effect does) that other columns can say instead, with the
    /// nuisances taken out of both: the squared cosine.
    pub fn overlap(&self, nuisances: &[Member], noise: f64, one: &[(usize, f64)], other: &[usize]) -> f64 {
        let others: Vec<Member> =
            nuisances.iter().copied().chain(other.iter().map(|&column| Member::free(column))).collect();
        match (self.power_beyond(nuisances, noise, one), self.power_beyond(&others, noise, one)) {
            (Some(alone), Some(with)) if alone > 0.0 => (1.0 - with / alone).clamp(0.0, 1.0),
            _ => 0.0,
        }
    }

    /// Sum of squares of a combination of columns that members cannot say.
    pub fn power_beyond(&self, members: &[Member], noise: f64, one: &[(usize, f64)]) -> Option<f64> {
        let inner =
            |a: usize| one.iter().map(|&(column, share)| share * self.total[(column, a)]).sum::<f64>();
        let right = DVector::from_iterator(members.len(), members.iter().map(|member| inner(member.column)));
        let own: f64 = one.iter().map(|&(column, share)| share * inner(column)).sum();
        let said = if members.is_empty() {
            0.0
        } else {
            solve(normal(&self.total, members, noise), &right)?.dot(&right)
        };
        Some(own - said)
    }
}

/// Normal equations of some members, with what is known of them.
fn normal(gram: &DMatrix<f64>, members: &[Member], noise: f64) -> DMatrix<f64> {
    DMatrix::from_fn(members.len(), members.len(), |i, j| {
        let known = if i == j { noise / (members[i].spread * members[i].spread) } else { 0.0 };
        gram[(members[i].column, members[j].column)] + known
    })
}

/// Least squares within bounds, by an active set: the member that breaks its bound most is held there, and a held member
/// whose gradient points back inside is released, until neither is left.
fn fit(gram: &DMatrix<f64>, members: &[Member], noise: f64) -> Option<Vec<f64>> {
    let target = gram.nrows() - 1;
    let mut values = vec![0.0; members.len()];
    let mut free: Vec<usize> = (0..members.len()).collect();
    // A member is released once: rounding alone could hold and release two of them in turn endlessly.
    let mut released = vec![false; members.len()];
    loop {
        let size = free.len();
        let chosen: Vec<Member> = free.iter().map(|&member| members[member]).collect();
        let held = |column: usize| -> f64 {
            let others = (0..members.len()).filter(|member| !free.contains(member));
            others.map(|other| values[other] * gram[(members[other].column, column)]).sum()
        };
        let right = DVector::from_iterator(
            size,
            free.iter().map(|&i| gram[(members[i].column, target)] - held(members[i].column)),
        );
        let solution = if size == 0 { right } else { solve(normal(gram, &chosen, noise), &right)? };
        free.iter().zip(&solution).for_each(|(&member, value)| values[member] = *value);
        let beyond = |member: usize| {
            let [low, high] = members[member].bounds;
            let over = (values[member] - high).max(low - values[member]);
            // A bound on one side alone has no width to measure by.
            let width = if (high - low).is_finite() { high - low } else { values[member].abs() };
            if over > 0.0 { over / width.max(1e-300) } else { 0.0 }
        };
        let worst = free.iter().copied().max_by(|&a, &b| beyond(a).total_cmp(&beyond(b)));
        if let Some(member) = worst.filter(|&member| beyond(member) > 0.0) {
            let [low, high] = members[member].bounds;
            values[member] = values[member].clamp(low, high);
            free.retain(|&other| other != member);
            continue;
        }
        let inward = |member: usize| {
            let Member { column, spread, bounds: [low, high] } = members[member];
            if released[member] || free.contains(&member) || low >= high {
                return 0.0;
            }
            let fitted: f64 =
                members.iter().zip(&values).map(|(other, value)| value * gram[(other.column, column)]).sum();
            let gradient = gram[(column, target)] - fitted - noise / (spread * spread) * values[member];
            let inside = if values[member] >= high { -gradient } else { gradient };
            inside / gram[(column, column)].sqrt().max(1e-300)
        };
        let back = (0..members.len()).max_by(|&a, &b| inward(a).total_cmp(&inward(b)));
        let tolerance = 1e-9 * gram[(target, target)].sqrt();
        match back.filter(|&member| inward(member) > tolerance) {
            None => return Some(values),
            Some(member) => {
                released[member] = true;
                free.push(member);
                free.sort_unstable();
            }
        }
    }
}

fn left(gram: &DMatrix<f64>, members: &[Member], values: &[f64]) -> f64 {
    let target = gram.nrows() - 1;
    let mut sum = gram[(target, target)];
    for (a, value) in members.iter().zip(values) {
        sum -= 2.0 * value * gram[(a.column, target)];
        for (b, other) in members.iter().zip(values) {
            sum += value * other * gram[(a.column, b.column)];
        }
    }
    sum.max(0.0)
}

/// Solves with the matrix scaled to a diagonal of 1; nothing where it is singular.
fn solve(mut matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = matrix.diagonal().map(|value| 1.0 / value.sqrt());
    if !scale.iter().all(|value| value.is_finite()) {
        return None;
    }
    for j in 0..matrix.ncols() {
        for i in 0..matrix.nrows() {
            matrix[(i, j)] *= scale[i] * scale[j];
        }
    }
    let factors = matrix.cholesky()?;
    if factors.l_dirty().diagonal().iter().any(|&pivot| pivot * pivot < DEPENDENT) {
        return None;
    }
    Some(factors.solve(&right.component_mul(&scale)).component_mul(&scale))
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn columns(seed: u64, rows: usize) -> (Vec<Vec<f64>>, Vec<usize>) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
        let columns = (0..4).map(|_| (0..rows).map(|_| uniform()).collect()).collect();
        (columns, (0..rows).map(|row| row * 10 / rows).collect())
    }

    fn target(columns: &[Vec<f64>], noise: f64) -> Vec<f64> {
        (0..columns[0].len())
            .map(|row| 2.0 * columns[0][row] - columns[1][row] + noise * columns[3][row])
            .collect()
    }

    fn blocks(columns: &[Vec<f64>], target: &[f64], block: &[usize]) -> Blocks {
        let views: Vec<&[f64]> = columns[..3].iter().map(Vec::as_slice).collect();
        Blocks::new(&views, target, block)
    }

    #[test]
    fn coefficients_errors_and_intervals_are_those_of_the_rows() {
        let (columns, block) = columns(1, 5003);
        let target = target(&columns, 0.3);
        let blocks = blocks(&columns, &target, &block);
        let members = [Member::free(0), Member::free(1)];
        let judged = blocks.judge(&members, 1.0).unwrap();
        let left: f64 = (0..target.len())
            .map(|row| {
                target[row]
                    - judged.coefficients[0] * columns[0][row]
                    - judged.coefficients[1] * columns[1][row]
            })
            .map(|r| r * r)
            .sum();
        assert!((judged.left / left - 1.0).abs() < 1e-9);
        // Uniform noise of variance 0.3²/12 on columns of variance 1/12.
        let expected = 0.3 / (5003_f64).sqrt();
        for member in 0..2 {
            assert!((judged.coefficients[member] - [2.0, -1.0][member]).abs() < 4.0 * expected);
            assert!((0.4..2.0).contains(&(judged.standard_error(member) / expected)));
        }
        let less = blocks.judge(&members[..1], 1.0).unwrap();
        assert!(judged.gain_over(&less) > 0.9 && judged.gain_z(&less) > 5.0);
        assert!(judged.z(1..2, &[blocks.length(1)]) > 50.0);
    }

    #[test]
    fn bounds_and_tolerances_hold() {
        let (columns, block) = columns(2, 2000);
        let target = target(&columns, 0.1);
        let blocks = blocks(&columns, &target, &block);
        let bounded = Member { bounds: [-3.0, 1.5], ..Member::free(0) };
        let found = blocks.fit(&[bounded, Member::free(1)], 0.01).unwrap();
        assert_eq!(found[0], 1.5);
        let one_sided = Member { bounds: [-0.5, f64::INFINITY], ..Member::free(1) };
        let found = blocks.fit(&[Member::free(0), one_sided], 0.01).unwrap();
        assert_eq!(found[1], -0.5);
        // A number that is known within a hundredth moves no further.
        let found = blocks.fit(&[Member::within(0, 0.01), Member::free(1)], 0.01).unwrap();
        assert_eq!(found[0], 0.01);
        assert!(blocks.fit(&[Member::free(0), Member::free(0)], 0.01).is_none());
    }

    /// The conditions of Karush, Kuhn and Tucker: a free coefficient has no gradient, a held one is pushed outward.
    #[test]
    fn bounded_fits_are_the_best_within_their_bounds() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
        for _ in 0..200 {
            let common: Vec<f64> = (0..60).map(|_| uniform()).collect();
            let mut column = || common.iter().map(|value| value + 0.4 * uniform()).collect::<Vec<f64>>();
            let (columns, target): (Vec<Vec<f64>>, Vec<f64>) = ((0..4).map(|_| column()).collect(), column());
            let target: Vec<f64> = target.iter().zip(&columns[0]).map(|(a, b)| 3.0 * a - b).collect();
            let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let blocks = Blocks::new(&views, &target, &[0; 60]);
            let members: Vec<Member> =
                (0..4).map(|place| Member { bounds: [-0.4, 0.7], ..Member::free(place) }).collect();
            let found = blocks.fit(&members, 0.0).unwrap();
            for (place, column) in columns.iter().enumerate() {
                let left = |row: usize| {
                    target[row] - (0..4).map(|other| found[other] * columns[other][row]).sum::<f64>()
                };
                let gradient: f64 = column.iter().enumerate().map(|(row, value)| value * left(row)).sum();
                match found[place] {
                    value if value >= 0.7 => assert!(gradient > -1e-9),
                    value if value <= -0.4 => assert!(gradient < 1e-9),
                    _ => assert!(gradient.abs() < 1e-9, "{gradient}"),
                }
            }
        }
    }

    #[test]
    fn a_number_at_its_bound_is_no_surer_than_the_rows_make_it() {
        let (columns, block) = columns(5, 4000);
        let blocks = blocks(&columns, &target(&columns, 0.3), &block);
        let members = [Member::within(0, 0.5), Member::free(1)];
        let noise = 0.3_f64.powi(2) / 12.0;
        let judged = blocks.judge(&members, noise).unwrap();
        assert_eq!((judged.coefficients[0], judged.standard_error(0)), (0.5, 0.0));
        let spread = blocks.spread(&members, noise).unwrap();
        let expected = 0.3 / (4000_f64).sqrt();
        assert!((spread.estimates[0] - 2.0).abs() < 5.0 * expected);
        assert!((0.4..2.0).contains(&(spread.standard_error(0) / expected)));
        assert!((0.9..1.1).contains(&(spread.alone[0] / expected)));
        // Of two columns that say the same, neither is determined.
        let twice = Blocks::new(&[&columns[0], &columns[0]], &columns[1], &block);
        let members = [Member::within(0, 0.5), Member::within(1, 0.5)];
        assert!(twice.spread(&members, noise).unwrap().alone[0] > 1.0);
    }

    #[test]
    fn no_block_spans_two_logs() {
        assert_eq!(blocks_of(&[4, 0, 2], 3), [0, 0, 1, 1, 2, 2]);
        assert_eq!(blocks_of(&[3, 1], 1), [0, 0, 0, 1]);
        assert_eq!(blocks_of(&[], 5), [0_usize; 0]);
    }

    #[test]
    fn overlap_is_the_squared_cosine_beyond_the_nuisances() {
        let (mut columns, block) = columns(3, 4000);
        // Half of column 2 is column 0, which is a nuisance, and half of the rest is column 1.
        columns[2] = (0..4000).map(|row| columns[0][row] + columns[1][row] + columns[3][row]).collect();
        let blocks = blocks(&columns, &vec![0.0; 4000], &block);
        let overlap = blocks.overlap(&[Member::free(0)], 1.0, &[(1, 3.0)], &[2]);
        assert!((overlap - 0.5).abs() < 0.05, "{overlap}");
    }

    #[test]
    fn noise_that_is_taken_out_no_longer_lowers_a_coefficient() {
        let (columns, block) = columns(4, 20_000);
        // Column 2 is column 0 with noise of the same variance, 1/12.
        let noisy: Vec<f64> = columns[0].iter().zip(&columns[3]).map(|(a, b)| a + b).collect();
        let mut blocks = Blocks::new(&[&noisy], &columns[0], &block);
        let attenuated = blocks.fit(&[Member::free(0)], 1.0).unwrap()[0];
        blocks.discount(0, 0, 1.0 / 12.0);
        let fixed = blocks.fit(&[Member::free(0)], 1.0).unwrap()[0];
        assert!((attenuated - 0.5).abs() < 0.02 && (fixed - 1.0).abs() < 0.05, "{attenuated} {fixed}");
    }
}
