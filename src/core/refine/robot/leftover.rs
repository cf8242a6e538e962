//! What no effect explains: whether there is any, and what it depends on.

use crate::effects::MotionSample as Moment;
use crate::refine::verdict::{Test, Unexplained};

use super::channels::Channels;
use super::lines;
use super::search::{Fit, Search};
use super::trace::{Pair, Part, Trace};

/// Variance of the white rows, whose floor is 1, and that of the worst quarter of a second, above which there is
/// structure.
const WHOLE: f64 = 1.10;
const MOMENT: f64 = 8.0;
const MOMENT_S: f64 = 0.25;
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
    let whole = fit.score / search.rows() as f64;
    let (worst, at_s) = worst_moment(search, &left);
    let (hum, order) = (lines::hum(search, &left), lines::order(search, &left));
    if whole < WHOLE && worst < MOMENT && hum.is_none() && order.is_none() {
        return None;
    }
    let mut shares = dependences(search, &left, search.channels.rows());
    for (name, line) in [("time_s", &hum), ("motor_angle_rad", &order)] {
        // What is slow has lines too.
        if let Some((_, share)) = line
            && whole < WHOLE
        {
            shares.insert(0, (name.to_owned(), *share));
        }
    }
    let brief = worst > MOMENT && whole < 1.6;
    if brief {
        shares.insert(0, ("time_s".to_owned(), 1.0 - 1.0 / whole.max(1.0)));
    }
    let mut named: Vec<String> = Vec::new();
    shares.retain(|(name, _)| {
        let is_new = !named.contains(name);
        named.push(name.clone());
        is_new
    });
    shares.truncate(3);
    let first = shares.first().map_or("nothing that was recorded", |(name, _)| name.as_str());
    let place = match (brief, hum, order) {
        (true, ..) => format!(", most of it about {at_s:.1} s"),
        (_, _, Some((order, _))) => format!(", with a wave of order {order:.2} of the motor angle"),
        (_, Some((hz, _)), _) => format!(", with a line at {hz:.1} Hz"),
        _ => String::new(),
    };
    let more = 100.0 * (whole - 1.0).max(0.0);
    let description = format!("{more:.0} % more than noise is left{place}; it depends most on {first}");
    let (depends_on, shares) = shares.into_iter().unzip();
    Some(Structure {
        told: Unexplained { depends_on, fractions: shares, description },
        is_wave: order.is_some(),
    })
}

/// Largest mean square over a short time, and when that is.
fn worst_moment(search: &Search<'_>, left: &[f64]) -> (f64, f64) {
    let half = left.len() / 2;
    let width = ((MOMENT_S / search.trace.step_s()) as usize).max(4);
    let times = search.trace.variable(|m| m.time_s);
    let squares: Vec<f64> = (0..half).map(|i| 0.5 * (left[i].powi(2) + left[half + i].powi(2))).collect();
    let mean = |w: &[f64]| w.iter().sum::<f64>() / w.len() as f64;
    let worst = squares.windows(width).map(mean).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    worst.map_or((0.0, 0.0), |(start, value)| (value, times[search.channels.rows()[start]]))
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
