//! What no effect explains: whether there is any, and what it depends on.

use crate::effects::MotionSample as Moment;
use crate::refine::verdict::{Test, Unexplained};

use super::channels::Channels;
use super::dependence;
use super::lines;
use super::search::{Fit, Search};
use super::trace::{Pair, Part, Trace};

/// Variance of the white rows by that of noise, for the diagnostics of a declared model.
const WHOLE: f64 = 1.10;
/// Fraction of the error on left-out blocks that a variable, a line or a short time must explain for there to be structure.
const STRUCTURE: f64 = 0.04;
/// Mean square of a short time, s, in units of the rest, from which on it stands out.
const MOMENT: f64 = 12.0;
const MOMENT_S: f64 = 0.25;
/// Time over which means of what effects leave must be those of noise, s.
const DRIFT_S: f64 = 2.0;
/// Variance of the white rows above which there is structure on rows held out, whose noise may be another.
const ONLY_HELD_OUT: f64 = 2.0;

/// What is left beyond the noise.
pub(super) struct Structure {
    pub(super) told: Unexplained,
    /// Whether a wave over the motor's angle is.
    pub(super) is_wave: bool,
}

/// What is left beyond the noise on rows that are held out only, as they may have what the others do not reach.
pub(super) fn only_held_out(search: &Search<'_>, fit: &Fit) -> Option<Unexplained> {
    let left = search.channels.unseen(&search.left_raw(&search.picks, &fit.judged.coefficients));
    let power = left.iter().map(|v| v * v).sum::<f64>() / left.len().max(1) as f64;
    if power < ONLY_HELD_OUT {
        return None;
    }
    let mut shares = dependences(search, &left, search.channels.held_out());
    shares.truncate(3);
    let first = shares.first().map_or("nothing that was recorded", |(name, _)| name.as_str());
    let more = 100.0 * (power - 1.0);
    let description = format!(
        "{more:.0} % more than noise is left on the rows held out, which have what the rows of the fit do not; it \
         depends most on {first}"
    );
    let (depends_on, shares) = shares.into_iter().unzip();
    Some(Unexplained { depends_on, fractions: shares, description })
}

/// What is left beyond the noise; none where there is nothing.
pub(super) fn structure(search: &Search<'_>, fit: &Fit) -> Option<Structure> {
    let left = search.left(&search.picks, &fit.judged.coefficients);
    let (worst, at_s) = worst_moment(search, &left);
    let line = |found: Option<(f64, f64)>| found.filter(|(_, share)| *share > STRUCTURE);
    let (hum, order) = (line(lines::hum(search, &left)), line(lines::order(search, &left)));
    let mut shares: Vec<(String, f64)> = dependence::dependences(search, fit)
        .into_iter()
        .filter(|found| found.gain > STRUCTURE)
        .map(|found| (found.name.to_owned(), found.gain))
        .collect();
    for (name, line) in [("time_s", &hum), ("motor_angle_rad", &order)] {
        shares.extend(line.map(|(_, share)| (name.to_owned(), share)));
    }
    // Noise may wander slowly too; an effect's name is doubtful if what it leaves does.
    let drift = if search.picks.is_empty() { 0.0 } else { drift(&left, DRIFT_S / search.trace.step_s()) };
    if drift > STRUCTURE {
        shares.push(("time_s".to_owned(), drift));
    }
    // What was found explains its moments, but for those that its shape misses a little.
    let brief = worst > MOMENT && search.picks.is_empty() && search.is_push(at_s, MOMENT_S, fit);
    if brief {
        let rows = MOMENT_S / search.trace.step_s();
        shares.push(("time_s".to_owned(), worst * rows / left.len() as f64));
    }
    if shares.is_empty() {
        return None;
    }
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut named: Vec<String> = Vec::new();
    shares.retain(|(name, _)| {
        let is_new = !named.contains(name);
        named.push(name.clone());
        is_new
    });
    shares.truncate(3);
    let place = match (brief, hum, order) {
        (true, ..) => format!(", most of it about {at_s:.1} s"),
        (_, _, Some((order, _))) => format!(", with a wave of order {order:.2} of the motor angle"),
        (_, Some((hz, _)), _) => format!(", with a line at {hz:.1} Hz"),
        _ => String::new(),
    };
    let (first, share) = &shares[0];
    let description = format!("{first} still explains {:.1} % of the residual{place}", 100.0 * share);
    let (depends_on, shares) = shares.into_iter().unzip();
    Some(Structure {
        told: Unexplained { depends_on, fractions: shares, description },
        is_wave: order.is_some(),
    })
}

/// Fraction of the power of white rows in both channels that means over so many rows explain beyond what chance does.
fn drift(left: &[f64], rows: f64) -> f64 {
    let rows = (rows as usize).max(4);
    let total: f64 = left.iter().map(|v| v * v).sum::<f64>().max(1e-300);
    let channels = [&left[..left.len() / 2], &left[left.len() / 2..]];
    let windows = || channels.iter().flat_map(|channel| channel.chunks_exact(rows));
    let explained: f64 = windows().map(|w| w.iter().sum::<f64>().powi(2) / rows as f64).sum();
    explained / total - windows().count() as f64 / left.len() as f64
}

/// Largest mean square over a short time, and when that is.
fn worst_moment(search: &Search<'_>, left: &[f64]) -> (f64, f64) {
    let half = left.len() / 2;
    let width = ((MOMENT_S / search.trace.step_s()) as usize).max(4);
    let times = search.trace.variable(|m| m.time_s);
    let squares: Vec<f64> = (0..half).map(|i| 0.5 * (left[i].powi(2) + left[half + i].powi(2))).collect();
    let mean = |w: &[f64]| w.iter().sum::<f64>() / w.len() as f64;
    let usual = mean(&squares).max(1e-300);
    let worst = squares.windows(width).map(mean).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    worst.map_or((0.0, 0.0), |(start, value)| (value / usual, times[search.channels.rows()[start]]))
}

type Variable = (&'static str, fn(&Moment) -> f64);

const VARIABLES: [Variable; 7] = [
    ("motor_speed_rad_s", |m| m.motor_speed_rad_s),
    ("motor_angle_rad", |m| m.motor_angle_rad),
    ("x_m", |m| m.x_m),
    ("x_dot_m_s", |m| m.x_dot_m_s),
    ("pitch_rad", |m| m.pitch_rad),
    ("torque_nm", |m| m.torque_nm),
    ("time_s", |m| m.time_s),
];

/// Share of the left rows that bins of each variable explain, in both channels and beyond what chance does.
fn dependences(search: &Search<'_>, left: &[f64], rows: &[usize]) -> Vec<(String, f64)> {
    let half = left.len() / 2;
    let total: f64 = left.iter().map(|v| v * v).sum();
    let mut found: Vec<(String, f64)> = VARIABLES
        .iter()
        .map(|(name, of)| {
            let values = search.trace.variable(of);
            let own: Vec<f64> = rows.iter().map(|&row| values[row]).collect();
            let mut order: Vec<usize> = (0..own.len()).collect();
            order.sort_by(|&a, &b| own[a].total_cmp(&own[b]));
            const BINS: usize = 16;
            let mut explained = 0.0;
            for bin in order.chunks(half.div_ceil(BINS).max(1)) {
                for shift in [0, half] {
                    let sum: f64 = bin.iter().map(|&i| left[shift + i]).sum();
                    explained += sum * sum / bin.len() as f64;
                }
            }
            ((*name).to_owned(), (explained - 2.0 * BINS as f64) / total)
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found
}

/// Diagnostics of a declared model's residual.
pub(super) fn tests(trace: &Trace<'_>, channels: &Channels, residual: &Pair) -> Vec<Test> {
    let parts = trace.parts();
    let names = ["combined", "translation", "pitch"];
    let columns = [channels.combined(residual), residual[0].clone(), residual[1].clone()];
    let test = |(i, column): (usize, &Vec<f64>)| {
        let rows = column.iter().zip(&parts).filter(|(_, part)| **part != Part::Gap);
        let (sum, count) = rows.fold((0.0, 0.0), |(sum, count), (v, _)| (sum + v * v, count + 1.0));
        let value = sum / f64::max(count, 1.0) / channels.floors[i].powi(2);
        Test {
            name: format!("power of {} by that of its noise", names[i]),
            value,
            threshold: WHOLE,
            structure: value > WHOLE,
        }
    };
    columns.iter().enumerate().map(test).collect()
}
