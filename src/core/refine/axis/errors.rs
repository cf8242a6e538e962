//! Errors of a model on the held-out rows.

use crate::refine::verdict::{Channels, Errors, Quantity};

use super::rig::Declared;
use super::trace::{Part, Rows};

/// Errors of what a model leaves of the measured effort, at the held-out rows.
pub(super) fn errors(declared: &Declared, rows: &Rows, measured: &[f64], left: &[f64]) -> Errors {
    let unit = declared.effort_unit();
    let rms = |values: &[f64]| {
        let held_out = rows.rows.iter().zip(values).filter(|(row, _)| row.part == Part::HeldOut);
        let (sum, count) = held_out.fold((0.0, 0_usize), |(sum, count), (_, v)| (sum + v * v, count + 1));
        (sum / count.max(1) as f64).sqrt()
    };
    let channel = |value: f64, unit| Channels(vec![(declared.channel(), Quantity::new(value, unit))]);
    Errors {
        rmse: channel(rms(left), unit),
        noise_floor: channel(noise_floor(declared, rows), unit),
        nrmse: channel(rms(left) / rms(measured), "1"),
        prediction: Vec::new(),
    }
}

/// What white noise of position and effort leaves behind the kernel.
pub(super) fn noise_floor(declared: &Declared, rows: &Rows) -> f64 {
    let kernel = &rows.kernel;
    let acceleration = rows.position_noise * kernel.noise_gain(2) * declared.inertia.powi(2);
    (acceleration + rows.effort_noise * kernel.noise_gain(0)).sqrt()
}
