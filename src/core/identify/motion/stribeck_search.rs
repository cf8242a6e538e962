//! Search over the two parameters in which the Stribeck curve is not linear.

use super::MotionError;

/// v_s, in the axis' unit of speed, and ξ of Eq. 28.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    pub(super) speed: f64,
    pub(super) exponent: f64,
}

impl Shape {
    /// exp(−(|v|/v_s)^ξ)
    pub(super) fn fading(self, speed: f64) -> f64 {
        (-(speed.abs() / self.speed).powf(self.exponent)).exp()
    }
}

/// Search range of the shape.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Span {
    slowest: f64,
    fastest: f64,
}

const LOWEST_EXPONENT: f64 = 0.2;
const HIGHEST_EXPONENT: f64 = 4.0;
/// Grid points on each axis before the search is refined.
const GRID: usize = 7;
/// Refinement ends at this step of the logarithms.
const FINEST: f64 = 1e-4;

impl Default for Span {
    fn default() -> Self {
        Self { slowest: f64::INFINITY, fastest: 0.0 }
    }
}

impl Span {
    /// Takes in a log whose rest begins below `rest` and whose speed has the root mean square `rms`.
    pub(super) fn widen(&mut self, rest: f64, rms: f64) {
        self.slowest = self.slowest.min(rest);
        self.fastest = self.fastest.max(rms);
    }

    /// Returns whether speeds are seen at which the curve could bend.
    pub(super) fn is_open(&self) -> bool {
        self.slowest < self.fastest
    }

    fn lower(&self) -> [f64; 2] {
        [self.slowest.ln(), LOWEST_EXPONENT.ln()]
    }

    fn upper(&self) -> [f64; 2] {
        [self.fastest.ln(), HIGHEST_EXPONENT.ln()]
    }

    /// The geometric middle, with exponent 1.
    pub(super) fn middle(&self) -> Shape {
        Shape { speed: (self.slowest * self.fastest).sqrt(), exponent: 1.0 }
    }

    pub(super) fn speed_at_edge(&self, shape: Shape) -> bool {
        at_edge(shape.speed.ln(), self.lower()[0], self.upper()[0])
    }

    pub(super) fn exponent_at_edge(&self, shape: Shape) -> bool {
        at_edge(shape.exponent.ln(), self.lower()[1], self.upper()[1])
    }
}

fn at_edge(value: f64, lower: f64, upper: f64) -> bool {
    value <= lower + 1e-3 || value >= upper - 1e-3
}

/// The shape with the smallest cost: the best point of a grid over the span, then steps along the axes and the
/// diagonals that are halved where none helps. Coordinates that are not free keep the start's value.
pub(super) fn search(
    start: Shape,
    free: [bool; 2],
    span: &Span,
    mut cost: impl FnMut(Shape, f64) -> Result<f64, MotionError>,
) -> Result<Shape, MotionError> {
    let (lower, upper) = (span.lower(), span.upper());
    let shape = |point: [f64; 2]| Shape { speed: point[0].exp(), exponent: point[1].exp() };
    let start = [start.speed.ln(), start.exponent.ln()];
    let points = |axis: usize| -> Vec<f64> {
        if !free[axis] {
            return vec![start[axis]];
        }
        let place = |index: usize| index as f64 / (GRID - 1) as f64;
        (0..GRID).map(|index| lower[axis] + place(index) * (upper[axis] - lower[axis])).collect()
    };
    let mut best = (f64::INFINITY, start);
    for &speed in &points(0) {
        for &exponent in &points(1) {
            let found = cost(shape([speed, exponent]), 0.1)?;
            if found < best.0 {
                best = (found, [speed, exponent]);
            }
        }
    }
    let mut step = 0.5;
    while step > FINEST {
        let before = best.0;
        for (by_speed, by_exponent) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)]
        {
            let mut point = best.1;
            for (axis, sign) in [(0, by_speed), (1, by_exponent)] {
                if free[axis] {
                    point[axis] = (point[axis] + f64::from(sign) * step).clamp(lower[axis], upper[axis]);
                }
            }
            let found = cost(shape(point), 1.0 - step)?;
            if found < best.0 {
                best = (found, point);
            }
        }
        if best.0 >= before {
            step /= 2.0;
        }
    }
    Ok(shape(best.1))
}
