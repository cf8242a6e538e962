//! Lines that noise does not have: in the spectrum of time, and in that of the motor's angle.

use std::f64::consts::TAU;

use crate::effects::{Action, MotionSample as Moment};

use super::kernel::dot;
use super::search::Search;

/// Rows of a piece of the spectrum, and places on each side whose median is the level about a line.
const PIECE: usize = 256;
const AROUND: usize = 12;
/// Lines are looked for from here on, Hz: below, all that is slow would be one.
const FROM_HZ: f64 = 1.5;
/// Standard deviations above its level at which a place is a line.
const SURE: f64 = 6.0;
/// Orders of the motor's angle that are looked at: the last one, and how far they are apart.
const LAST_ORDER: f64 = 24.0;
const APART: f64 = 0.5;
/// Place of the first order: slow things look like lower ones.
const FIRST_ORDER: usize = 8;
/// Power in units of the noise at which an order is a line, and the share of the whole that one must have beside no
/// effect: friction that sticks at the same places of a tone leaves fainter ones on clean robots.
const LEAST_POWER: f64 = 40.0;
const LEAST_SHARE: f64 = 0.01;

/// The strongest line in the spectrum of a residual: its frequency, Hz, and its share of the power.
pub(super) fn hum(search: &Search<'_>, left: &[f64]) -> Option<(f64, f64)> {
    let half = left.len() / 2;
    let hz = 1.0 / (PIECE as f64 * search.trace.step_s());
    let first = (FROM_HZ / hz).ceil() as usize;
    let mut best: Option<(f64, f64, f64)> = None;
    for channel in [&left[..half], &left[half..]] {
        let (power, pieces) = spectrum(channel);
        let total: f64 = power.iter().sum();
        // The mean of so many squares of pairs, by Wilson and Hilferty.
        let spread = 2.0 / (9.0 * 2.0 * 0.75 * pieces as f64);
        let limit = (1.0 - spread + SURE * spread.sqrt()).powi(3);
        for place in first..power.len() {
            let around = place.saturating_sub(AROUND).max(first)..(place + AROUND).min(power.len());
            let mut near: Vec<f64> = power[around].to_vec();
            near.sort_by(f64::total_cmp);
            let ratio = power[place] / near[near.len() / 2];
            if ratio > limit && best.is_none_or(|(strongest, ..)| ratio > strongest) {
                best = Some((ratio, place as f64 * hz, power[place] / total));
            }
        }
    }
    best.map(|(_, hz, share)| (hz, share))
}

/// Power of half-overlapping pieces, and how many there are.
fn spectrum(column: &[f64]) -> (Vec<f64>, usize) {
    let waves: Vec<(f64, f64)> = (0..PIECE).map(|i| libm::sincos(TAU * i as f64 / PIECE as f64)).collect();
    let mut power = vec![0.0; PIECE / 2];
    let mut pieces = 0;
    for piece in column.windows(PIECE).step_by(PIECE / 2) {
        pieces += 1;
        for (place, power) in power.iter_mut().enumerate() {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, value) in piece.iter().enumerate() {
                let window = 0.5 - 0.5 * waves[i].1;
                let (sin, cos) = waves[i * place % PIECE];
                re += window * value * cos;
                im += window * value * sin;
            }
            *power += re * re + im * im;
        }
    }
    (power, pieces)
}

/// The strongest wave over the motor's angle, of a whole order or between two: its order and its share of the power.
pub(super) fn order(search: &Search<'_>, left: &[f64]) -> Option<(f64, f64)> {
    let total = dot(left, left);
    let count = (LAST_ORDER / APART) as usize;
    let power = |number: usize| {
        let order = number as f64 * APART;
        let wave = |quarter: f64| {
            let pair = search
                .trace
                .pair(|| move |m: &Moment| Action::motor(libm::cos(order * m.motor_angle_rad - quarter)));
            search.channels.white(&pair)
        };
        let (cos, sin) = (wave(0.0), wave(0.25 * TAU));
        let of = |column: &[f64]| dot(left, column).powi(2) / dot(column, column).max(1e-300);
        (order, of(&cos) + of(&sin))
    };
    let best = (FIRST_ORDER..=count).map(power).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let least = if search.picks.is_empty() { LEAST_SHARE * total } else { 0.0 };
    (best.1 > LEAST_POWER.max(least)).then_some((best.0, best.1 / total))
}
