//! Mapping of values to an axis.

use super::chart::{Axis, Scale};
use super::ticks::{Tick, ticks};

/// From values to pixels along one axis.
#[derive(Clone, Copy)]
pub(super) struct Map {
    scale: Scale,
    /// The values at the ends.
    from: [f64; 2],
    /// Their pixels.
    pub(super) to: [f64; 2],
}

impl Map {
    /// Shows `values`, or the axis' own range, on the pixels `to`. `margin` is the fraction of the length left free
    /// at both ends of what the axis does not fix.
    pub(super) fn new(axis: &Axis, values: Option<[f64; 2]>, margin: f64, to: [f64; 2]) -> Self {
        let scale = axis.scale;
        let valid = |range: &[f64; 2]| {
            range.iter().all(|end| end.is_finite()) && (scale == Scale::Linear || range[0] > 0.0)
        };
        if let Some(range) = axis.range.filter(|range| valid(range) && range[0] < range[1]) {
            return Self { scale, from: range, to };
        }
        let [low, high] = values.filter(valid).unwrap_or([1.0, 1.0]).map(|value| along(scale, value));
        let length = high - low;
        let pad = if length > 1e-12 * (low.abs() + high.abs()) {
            margin * length
        } else {
            0.5 * low.abs().max(1e-3)
        };
        Self { scale, from: [low - pad, high + pad].map(|place| back(scale, place)), to }
    }

    pub(super) fn at(&self, value: f64) -> f64 {
        let [low, high, place] = [self.from[0], self.from[1], value].map(|value| along(self.scale, value));
        self.to[0] + (place - low) / (high - low) * (self.to[1] - self.to[0])
    }

    /// Ticks at least `spacing_px` apart, as far as two of them allow it.
    pub(super) fn ticks(&self, spacing_px: f64) -> Vec<Tick> {
        let count = ((self.to[1] - self.to[0]).abs() / spacing_px).max(2.0) as usize;
        ticks(self.scale, self.from, count)
    }
}

/// A value's place on an axis, in units of the axis; not a number where it has none.
pub(super) fn along(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Log => libm::log10(if value > 0.0 { value } else { f64::NAN }),
    }
}

fn back(scale: Scale, place: f64) -> f64 {
    match scale {
        Scale::Linear => place,
        Scale::Log => libm::pow(10.0, place),
    }
}
