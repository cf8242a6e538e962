//! Weights that put a pole where it is wanted: the least change of Q's diagonal that does it, if there is one.

use nalgebra::{Complex, SMatrix, Vector2, Vector4};

use super::design::design;
use super::margins::SampledLoop;
use super::running::{SampledPole, sampled_poles};
use crate::model::LinearModel;
use crate::model::Weights;

/// In how many parts the way is walked: where a way of few parts is lost, one of more is tried.
const PARTS: [usize; 3] = [1, 4, 12];
const NEWTON_STEPS: usize = 8;
/// Distance that counts as reached, relative to the pole's size.
const REACHED: f64 = 1e-3;
/// Range of Q's diagonal, SI.
const SMALLEST: f64 = 1e-6;
const LARGEST: f64 = 1e8;
/// Change of a weight's logarithm for a derivative.
const STEP: f64 = 1e-4;
/// Longest step of a weight's logarithm: a factor of 3.
const LONGEST: f64 = 1.1;
/// Imaginary part, relative to the pole's size, below which it counts as real.
const REAL: f64 = 1e-6;

/// Reachable range of a pole by changing weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Those that take it there, or as far along the way as there are any; to three digits, as people write weights,
    /// where the loop is as stable with these.
    pub weights: Weights,
    /// Pole with these weights, 1/s.
    pub pole: Complex<f64>,
    /// True if that is where it was wanted.
    pub is_reached: bool,
}

/// Weights with R and the correlations of `start` whose loop, when sampled, has its pole `from` at `to`, 1/s; a real
/// pole stays real. Of all that do, those next to `start` in the logarithms of Q's diagonal, about: Newton's method
/// along the line from one to the other. Where the line leaves what diagonals of Q from 1e-6 to 1e8 can do, they are
/// those of its last place. No pole comes to lie further right than the rightmost of `start`, or than the imaginary
/// axis.
pub fn weights_for_pole(
    model: &LinearModel,
    timing: &SampledLoop,
    start: &Weights,
    from: Complex<f64>,
    to: Complex<f64>,
) -> Placement {
    let is_real = from.im.abs() < REAL * from.norm();
    let to = if is_real { Complex::new(to.re, 0.0) } else { to };
    let mut search = Search { model, timing, start, rightmost: f64::INFINITY };
    let logarithms = Vector4::from_fn(|state, _| start.q[(state, state)].clamp(SMALLEST, LARGEST).ln());
    search.rightmost = rightmost(&search.poles(&logarithms).unwrap_or_default()).max(0.0);
    let mut farthest = (logarithms, from);
    for parts in PARTS {
        match search.walk(logarithms, from, to, parts) {
            Ok((found, pole)) => return search.placement(&found, pole, true),
            Err(lost) => farthest = lost,
        }
    }
    search.placement(&farthest.0, farthest.1, false)
}

/// Logarithms of Q's diagonal, and where a pole is with them.
type Place = (Vector4<f64>, Complex<f64>);

struct Search<'a> {
    model: &'a LinearModel,
    timing: &'a SampledLoop,
    start: &'a Weights,
    /// Largest real part of a pole, 1/s.
    rightmost: f64,
}

fn rightmost(poles: &[SampledPole]) -> f64 {
    poles.iter().map(|pole| pole.s.re).fold(f64::NEG_INFINITY, f64::max)
}

impl Search<'_> {
    fn weights(&self, logarithms: &Vector4<f64>) -> Weights {
        let mut weights = *self.start;
        for state in 0..4 {
            weights.set_state_weight(state, logarithms[state].exp());
        }
        weights
    }

    fn placement(&self, logarithms: &Vector4<f64>, pole: Complex<f64>, is_reached: bool) -> Placement {
        let rounded = logarithms.map(|value| {
            let weight = value.exp();
            format!("{weight:.2e}").parse().unwrap_or(weight).ln()
        });
        let of_rounded = self.pole(&rounded, pole);
        let (logarithms, pole) = of_rounded.map_or((*logarithms, pole), |pole| (rounded, pole));
        Placement { weights: self.weights(&logarithms), pole, is_reached }
    }

    fn poles(&self, logarithms: &Vector4<f64>) -> Option<Vec<SampledPole>> {
        let gain = design(self.model, &self.weights(logarithms)).ok()?.gain;
        Some(sampled_poles(self.model, &gain, self.timing))
    }

    /// The pole next to `near`, where none is too far to the right.
    fn pole(&self, logarithms: &Vector4<f64>, near: Complex<f64>) -> Option<Complex<f64>> {
        let poles = self.poles(logarithms).filter(|poles| rightmost(poles) <= self.rightmost)?;
        let distance = |pole: &Complex<f64>| (pole - near).norm();
        poles.into_iter().map(|pole| pole.s).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Weights along the line between two places of a pole, in equal parts; how far it came where they end.
    fn walk(
        &self,
        mut logarithms: Vector4<f64>,
        from: Complex<f64>,
        to: Complex<f64>,
        parts: usize,
    ) -> Result<Place, Place> {
        let mut pole = from;
        for part in 1..=parts {
            let wanted = from + (to - from) * (part as f64 / parts as f64);
            (logarithms, pole) = self.newton(logarithms, pole, wanted).ok_or((logarithms, pole))?;
        }
        Ok((logarithms, pole))
    }

    /// Weights whose pole next to `pole` is at `wanted`, by steps of least length.
    fn newton(
        &self,
        mut logarithms: Vector4<f64>,
        mut pole: Complex<f64>,
        wanted: Complex<f64>,
    ) -> Option<Place> {
        for _ in 0..NEWTON_STEPS {
            pole = self.pole(&logarithms, pole)?;
            let error = wanted - pole;
            if error.norm() <= REACHED * wanted.norm() {
                return Some((logarithms, pole));
            }
            let mut slope = SMatrix::<f64, 2, 4>::zeros();
            for state in 0..4 {
                let mut beside = logarithms;
                beside[state] += STEP;
                let change = (self.pole(&beside, pole)? - pole) / STEP;
                slope.set_column(state, &Vector2::new(change.re, change.im));
            }
            let inverse = slope.pseudo_inverse(1e-9 * slope.norm()).ok()?;
            let step: Vector4<f64> = inverse * Vector2::new(error.re, error.im);
            logarithms += step * (LONGEST / step.amax()).min(1.0);
            logarithms = logarithms.map(|value| value.clamp(SMALLEST.ln(), LARGEST.ln()));
        }
        None
    }
}
