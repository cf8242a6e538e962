//! 95 % intervals of the six parameters and the condition of the problem.
//!
//! The parameters are strongly correlated and the model is far from linear in v_s and ξ, so an interval from the
//! slope at the optimum would be too short. Each one here is a profile-likelihood interval: the values of the
//! parameter for which the other five, fitted anew within their ranges, leave a sum of squares of at most
//! S_min (1 + t²/(N − p)), with Student's t for N − p degrees of freedom (p fitted parameters). It assumes noise that
//! is independent from pair to pair. An end that the sum never reaches is the end of the searched range. The
//! linearised errors only choose the first step, and give the condition number.

use nalgebra::{SMatrix, SVector};

use super::SearchBox;
use super::parameters::{COULOMB, EXPONENT, OFFSET, Point, SPEED, STATIC, VISCOUS};
use super::polish::{Fit, polish_from};
use super::samples::Samples;
use crate::signal::quantile::student_t_975;

/// Information of the data on the six parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Confidence {
    /// `None` if the parameter was not fitted or there are not more pairs than parameters.
    pub(super) intervals: [Option<[f64; 2]>; 6],
    /// True if an interval ends at its searched range on either side.
    pub(super) open: [bool; 6],
    /// Condition number of JᵀJ with columns scaled to length 1.
    pub(super) condition: f64,
}

pub(super) fn confidence(samples: &Samples, range: &SearchBox, fit: &Fit) -> Confidence {
    let (errors, condition) = linearised(samples, range, fit);
    let mut found = Confidence { intervals: [None; 6], open: [false; 6], condition };
    let fitted = (0..6).filter(|&d| range.width(d) > 0.0).count();
    if samples.len() <= fitted {
        return found;
    }
    let freedom = samples.len() - fitted;
    let t = student_t_975(freedom);
    let profile = Profile { samples, range, fit, target: fit.sum * (1.0 + t * t / freedom as f64) };
    for d in (0..6).filter(|&d| range.width(d) > 0.0) {
        let ends = [-1.0, 1.0].map(|side| profile.end(d, side, t * errors[d]));
        found.intervals[d] = Some(ends.map(|end| end.value));
        found.open[d] = ends.iter().any(|end| end.at_range);
    }
    found
}

/// Standard errors by linearisation, those of v_s and ξ in logarithms, and the condition of scaled JᵀJ.
fn linearised(samples: &Samples, range: &SearchBox, fit: &Fit) -> ([f64; 6], f64) {
    let fitted: Vec<usize> = (0..6).filter(|&d| range.width(d) > 0.0).collect();
    let (mut power, mut fading) = (vec![0.0; samples.len()], vec![0.0; samples.len()]);
    let log2_speed = fit.point[SPEED].log2();
    let exponent = fit.point[EXPONENT];
    samples.fade(log2_speed, exponent, &mut power, &mut fading);
    let drop = fit.point[STATIC] - fit.point[COULOMB];
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    for i in 0..samples.len() {
        let steepness = drop * samples.direction[i] * power[i] * fading[i];
        let mut row = SVector::<f64, 6>::zeros();
        row[COULOMB] = samples.direction[i] * (1.0 - fading[i]);
        row[STATIC] = samples.direction[i] * fading[i];
        row[SPEED] = steepness * exponent;
        row[EXPONENT] = -steepness * samples.log_power(i, log2_speed, exponent);
        row[VISCOUS] = samples.speed[i];
        row[OFFSET] = 1.0;
        normal += row * row.transpose();
    }
    let scale = normal.diagonal().map(f64::sqrt);
    let scaled = SMatrix::<f64, 6, 6>::from_fn(|i, j| {
        let used = fitted.contains(&i) && fitted.contains(&j) && scale[i] * scale[j] > 0.0;
        if used { normal[(i, j)] / (scale[i] * scale[j]) } else { f64::from(u8::from(i == j)) }
    });
    let eigen = scaled.symmetric_eigen();
    let smallest = eigen.eigenvalues.min();
    let silent = fitted.iter().any(|&d| scale[d] == 0.0);
    let condition =
        if silent || smallest <= 0.0 { f64::INFINITY } else { eigen.eigenvalues.max() / smallest };
    let variance = fit.sum / samples.len().saturating_sub(fitted.len()).max(1) as f64;
    let spread = |d: usize| {
        (0..6).map(|k| eigen.eigenvectors[(d, k)].powi(2) / eigen.eigenvalues[k].max(1e-14)).sum::<f64>()
    };
    (std::array::from_fn(|d| (variance * spread(d)).sqrt() / scale[d]), condition)
}

/// The sum of squares as a function of one parameter.
struct Profile<'a> {
    samples: &'a Samples,
    range: &'a SearchBox,
    fit: &'a Fit,
    target: f64,
}

/// One end of an interval.
#[derive(Clone, Copy)]
struct End {
    value: f64,
    at_range: bool,
}

/// A point of a profile: coordinate, √(S − S_min) beyond the target's, and the candidate.
#[derive(Clone, Copy)]
struct Place {
    at: f64,
    beyond: f64,
    point: Point,
}

impl Profile<'_> {
    /// Walks outwards with growing steps until the target is passed, then closes in by false position.
    fn end(&self, d: usize, side: f64, first_step: f64) -> End {
        let limit = coordinate(d, if side < 0.0 { self.range.lower[d] } else { self.range.upper[d] });
        let start = coordinate(d, self.fit.point[d]);
        let span = (limit - start).abs();
        let mut inner =
            Place { at: start, beyond: -(self.target - self.fit.sum).sqrt(), point: self.fit.point };
        let mut step = if first_step.is_finite() && first_step > 0.0 { first_step } else { 0.1 * span };
        loop {
            let reached = (inner.at - limit) * side >= 0.0;
            if reached {
                return End { value: value(d, limit), at_range: true };
            }
            let at = if side < 0.0 { (inner.at - step).max(limit) } else { (inner.at + step).min(limit) };
            let outer = self.place(d, at, &inner.point);
            if outer.beyond > 0.0 {
                return End { value: value(d, self.close_in(d, inner, outer)), at_range: false };
            }
            inner = outer;
            step = (2.0 * step).max(1e-6 * span);
        }
    }

    /// The Illinois form of false position.
    fn close_in(&self, d: usize, mut inner: Place, mut outer: Place) -> f64 {
        const ROUNDS: usize = 30;
        let tolerance = 1e-4 * (self.target - self.fit.sum).sqrt();
        for _ in 0..ROUNDS {
            let at = (inner.at * outer.beyond - outer.at * inner.beyond) / (outer.beyond - inner.beyond);
            let middle = self.place(d, at, &inner.point);
            if middle.beyond.abs() <= tolerance {
                return middle.at;
            }
            if middle.beyond < 0.0 {
                inner = middle;
                outer.beyond *= 0.5;
            } else {
                outer = middle;
                inner.beyond *= 0.5;
            }
        }
        0.5 * (inner.at + outer.at)
    }

    fn place(&self, d: usize, at: f64, start: &Point) -> Place {
        let mut range = *self.range;
        range.lower[d] = value(d, at).clamp(self.range.lower[d], self.range.upper[d]);
        range.upper[d] = range.lower[d];
        let fit = polish_from(self.samples, &range, start);
        let beyond = (fit.sum - self.fit.sum).max(0.0).sqrt() - (self.target - self.fit.sum).sqrt();
        Place { at, beyond, point: fit.point }
    }
}

/// v_s and ξ are walked in logarithms.
fn coordinate(d: usize, value: f64) -> f64 {
    if d == SPEED || d == EXPONENT { value.ln() } else { value }
}

fn value(d: usize, coordinate: f64) -> f64 {
    if d == SPEED || d == EXPONENT { coordinate.exp() } else { coordinate }
}
