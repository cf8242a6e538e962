//! From the neighbourhood of the optimum to the optimum: variable projection.
//!
//! For given v_s and ξ the other four parameters are a linear least-squares problem with ranges, solved exactly
//! ([`super::linear`]). What remains is a search in two dimensions, ln v_s and ln ξ: a coarse grid finds the valleys,
//! and Levenberg–Marquardt steps with the linear parameters projected out (Golub and Pereyra 1973, in Kaufman's
//! approximation of the Jacobian) descend to their bottoms.

use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

use super::SearchBox;
use super::linear::{LinearFit, NormalEquations};
use super::parameters::{COULOMB, EXPONENT, OFFSET, Point, SPEED, STATIC, VISCOUS};
use super::samples::Samples;

/// The linear parameters' places in a [`Point`], in the order of the columns.
const LINEAR: [usize; 4] = [COULOMB, STATIC, VISCOUS, OFFSET];
/// Nodes of the grid over v_s and over ξ, both geometric.
const GRID: [usize; 2] = [12, 8];
/// Valleys that are descended.
const STARTS: usize = 3;
/// Fraction of the sum of squares below which a gain is lost in rounding.
const ROUNDING: f64 = 1e-12;

/// A candidate with its sum of squared errors, (N m)².
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) point: Point,
    pub(super) sum: f64,
    /// True if no step promises a lower sum.
    pub(super) converged: bool,
}

/// The optimum within the box. `hint` is one more point to descend from, such as a swarm's best.
pub(super) fn polish(samples: &Samples, range: &SearchBox, hint: Option<&Point>) -> Fit {
    let mut projection = Projection::new(samples, range);
    let mut starts = projection.valleys();
    starts.extend(hint.map(nonlinear));
    starts
        .into_iter()
        .map(|start| projection.descend(start))
        .reduce(better)
        .expect("the smallest node of a grid is a valley")
}

/// The one with the lower sum. Of two in one valley it is converged where either is.
fn better(one: Fit, other: Fit) -> Fit {
    let (mut best, second) = if other.sum < one.sum { (other, one) } else { (one, other) };
    best.converged |= second.converged && second.sum <= (1.0 + ROUNDING) * best.sum;
    best
}

/// The optimum next to a point, within another box: for profiles.
pub(super) fn polish_from(samples: &Samples, range: &SearchBox, start: &Point) -> Fit {
    Projection::new(samples, range).descend(nonlinear(start))
}

fn nonlinear(point: &Point) -> Vector2<f64> {
    Vector2::new(point[SPEED].ln(), point[EXPONENT].ln())
}

/// The reduced problem and its scratch columns.
struct Projection<'a> {
    samples: &'a Samples,
    low: Vector2<f64>,
    high: Vector2<f64>,
    linear_low: Vector4<f64>,
    linear_high: Vector4<f64>,
    /// u = (|q̇|/v_s)^ξ and exp(−u) of the last evaluation.
    power: Vec<f64>,
    fading: Vec<f64>,
}

/// One evaluation: the best candidate at a (ln v_s, ln ξ).
struct Node {
    fit: Fit,
    equations: NormalEquations,
    linear: LinearFit,
}

impl<'a> Projection<'a> {
    fn new(samples: &'a Samples, range: &SearchBox) -> Self {
        let pick = |ends: &Point| Vector4::from_fn(|i, _| ends[LINEAR[i]]);
        Self {
            samples,
            low: nonlinear(&range.lower),
            high: nonlinear(&range.upper),
            linear_low: pick(&range.lower),
            linear_high: pick(&range.upper),
            power: vec![0.0; samples.len()],
            fading: vec![0.0; samples.len()],
        }
    }

    fn evaluate(&mut self, at: &Vector2<f64>) -> Node {
        let exponent = at[1].exp();
        let log2_speed = at[0] / std::f64::consts::LN_2;
        self.samples.fade(log2_speed, exponent, &mut self.power, &mut self.fading);
        let (gram, right) = self.products();
        let equations = NormalEquations::new(&gram, &right);
        let linear = equations.solve(&self.linear_low, &self.linear_high);
        let mut point = [0.0; 6];
        for (column, &place) in LINEAR.iter().enumerate() {
            point[place] = linear.value[column];
        }
        point[SPEED] = at[0].exp();
        point[EXPONENT] = exponent;
        let sum = (0..self.samples.len()).map(|i| self.error(&linear.value, i).powi(2)).sum();
        Node { fit: Fit { point, sum, converged: false }, equations, linear }
    }

    /// Row `i` of A: derivatives of Eq. 28 by f_c, f_s, f_v and f_p.
    fn row(&self, i: usize) -> Vector4<f64> {
        let faded = self.fading[i] * self.samples.direction[i];
        Vector4::new(self.samples.direction[i] - faded, faded, self.samples.speed[i], 1.0)
    }

    fn error(&self, linear: &Vector4<f64>, i: usize) -> f64 {
        self.samples.torque[i] - self.row(i).dot(linear)
    }

    fn products(&self) -> (Matrix4<f64>, Vector4<f64>) {
        (0..self.samples.len()).fold((Matrix4::zeros(), Vector4::zeros()), |(gram, right), i| {
            let row = self.row(i);
            (gram + row * row.transpose(), right + row * self.samples.torque[i])
        })
    }

    /// Gradient and Gauss–Newton matrix of half the sum of squares in (ln v_s, ln ξ), the free linear
    /// parameters projected out; for the last evaluated node.
    fn slope(&self, node: &Node) -> (Vector2<f64>, Matrix2<f64>) {
        let exponent = node.fit.point[EXPONENT];
        let log2_speed = node.fit.point[SPEED].log2();
        let drop = node.fit.point[STATIC] - node.fit.point[COULOMB];
        let mut gradient = Vector2::zeros();
        let mut square = Matrix2::zeros();
        let mut mixed = [Vector4::zeros(), Vector4::zeros()];
        for i in 0..self.samples.len() {
            let steepness = drop * self.samples.direction[i] * self.power[i] * self.fading[i];
            let log_power = self.samples.log_power(i, log2_speed, exponent);
            let derivative = Vector2::new(steepness * exponent, -steepness * log_power);
            gradient -= derivative * self.error(&node.linear.value, i);
            square += derivative * derivative.transpose();
            mixed[0] += self.row(i) * derivative[0];
            mixed[1] += self.row(i) * derivative[1];
        }
        let solved = mixed.map(|column| node.equations.apply_inverse(&node.linear.free, &column));
        (gradient, square - Matrix2::from_fn(|i, j| mixed[i].dot(&solved[j])))
    }

    /// Levenberg–Marquardt within the ranges of v_s and ξ.
    fn descend(&mut self, start: Vector2<f64>) -> Fit {
        const STEPS: usize = 200;
        const LARGEST_DAMPING: f64 = 1e10;
        /// Relative error at which every pair is met.
        const EXACT: f64 = 1e-10;
        let exact = EXACT.powi(2) * self.samples.torque.iter().map(|t| t * t).sum::<f64>();
        let mut at = self.inside(&start);
        let mut node = self.evaluate(&at);
        let mut slope = self.slope(&node);
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let step = self.inside(&(at + self.step(&at, &slope, damping))) - at;
            let expected = -slope.0.dot(&step);
            if expected <= 1e-15 * node.fit.sum || node.fit.sum <= exact {
                node.fit.converged = true;
                break;
            }
            if damping > LARGEST_DAMPING {
                let full = self.inside(&(at + self.step(&at, &slope, 0.0))) - at;
                node.fit.converged = -slope.0.dot(&full) <= ROUNDING * node.fit.sum;
                break;
            }
            let trial = self.evaluate(&(at + step));
            if trial.fit.sum < node.fit.sum {
                at += step;
                slope = self.slope(&trial);
                node = trial;
                damping *= 0.1;
            } else {
                damping *= 5.0;
            }
        }
        node.fit
    }

    /// The damped step; a coordinate at an end of its range that would leave it stays.
    fn step(
        &self,
        at: &Vector2<f64>,
        (gradient, square): &(Vector2<f64>, Matrix2<f64>),
        damping: f64,
    ) -> Vector2<f64> {
        let mut matrix = *square;
        let mut right = -gradient;
        let diagonal = square.diagonal();
        for i in 0..2 {
            matrix[(i, i)] += damping * diagonal[i] + f64::MIN_POSITIVE;
            let outwards =
                (at[i] <= self.low[i] && right[i] < 0.0) || (at[i] >= self.high[i] && right[i] > 0.0);
            if outwards || self.low[i] == self.high[i] || diagonal[i] <= 0.0 {
                right[i] = 0.0;
                matrix[(i, 1 - i)] = 0.0;
                matrix[(1 - i, i)] = 0.0;
                matrix[(i, i)] = 1.0;
            }
        }
        matrix.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * right)
    }

    fn inside(&self, at: &Vector2<f64>) -> Vector2<f64> {
        Vector2::from_fn(|i, _| at[i].clamp(self.low[i], self.high[i]))
    }

    /// The lowest valleys of the grid: nodes that no neighbour undercuts.
    fn valleys(&mut self) -> Vec<Vector2<f64>> {
        let [speeds, exponents] = GRID;
        let low = Vector2::new(self.low[0], self.low[1].max(0.02f64.ln().min(self.high[1])));
        let nodes: Vec<Vector2<f64>> = (0..speeds * exponents)
            .map(|n| {
                let share = Vector2::new(
                    (n / exponents) as f64 / (speeds - 1) as f64,
                    (n % exponents) as f64 / (exponents - 1) as f64,
                );
                low + (self.high - low).component_mul(&share)
            })
            .collect();
        let sums: Vec<f64> = nodes.iter().map(|node| self.evaluate(node).fit.sum).collect();
        let mut valleys: Vec<usize> = (0..nodes.len()).filter(|&n| is_valley(&sums, n)).collect();
        valleys.sort_by(|&a, &b| sums[a].total_cmp(&sums[b]));
        valleys.into_iter().take(STARTS).map(|n| nodes[n]).collect()
    }
}

fn is_valley(sums: &[f64], n: usize) -> bool {
    let [speeds, exponents] = GRID;
    let (row, column) = (n / exponents, n % exponents);
    let rows = row.saturating_sub(1)..(row + 2).min(speeds);
    rows.flat_map(|r| (column.saturating_sub(1)..(column + 2).min(exponents)).map(move |c| r * exponents + c))
        .all(|neighbour| sums[n].total_cmp(&sums[neighbour]).is_le())
}
