//! Section 4.3: Figures 6 and 7.

use super::pages::Pages;
use super::phrases::{listed, sig};
use super::table::{Digits, Table};
use super::trials::Tracked;
use crate::model::RobotModel;
use crate::report::{Axis, Chart, Limit, Mark, Panel, Series};
use crate::simulate::SpeedGains;

/// A pair of gains without and with compensation.
pub(super) type Pair = [Tracked; 2];
const MOTORS: [(&str, usize); 2] = [("left", 6), ("right", 7)];
const WAYS: [&str; 2] = ["without compensation", "with compensation"];

pub(super) fn write(robot: &RobotModel, pairs: &[Pair], target_rad_s: f64, pages: &mut Pages) {
    pages.section("Speed tracking (section 4.3)");
    pages.paragraph(format!(
        "Wheels off the ground, torque mode, PI controller with a target of {} rad/s, without and with friction feedforward. \
         The paper shows curves without numbers and states that the response is faster with compensation.",
        sig(target_rad_s)
    ));
    for (motor, (name, figure)) in MOTORS.into_iter().enumerate() {
        pages.table(table(pairs, motor, name, figure));
        pages.chart(chart(pairs, motor, name, figure, target_rad_s));
    }
    finding(pairs, pages);
    pages.paragraph(crossovers(robot, pairs));
    for pair in pairs {
        for (tracked, way) in pair.iter().zip(WAYS) {
            for warning in &tracked.warnings {
                pages.warning(format!("{}, {way}: {warning}.", gains(pair)));
            }
        }
    }
}

/// Bandwidth of each gain pair, and its phase loss by the delay.
fn crossovers(robot: &RobotModel, pairs: &[Pair]) -> String {
    let (inertia, delay) = (robot.parameters.wheel_inertia_kg_m2, robot.actuation.delay_s);
    let told = pairs.iter().map(|pair| {
        let [kp, ki] = pair[0].gains;
        let speed_gains = SpeedGains { kp, ki };
        let rest = speed_gains.phase_margin_rad(inertia, delay);
        format!(
            "{} has a crossover at {} rad/s and a phase margin of {}",
            gains(pair),
            sig(speed_gains.crossover_rad_s(inertia)),
            if rest > 0.0 { format!("{} rad", sig(rest)) } else { "none".to_owned() },
        )
    });
    let told: Vec<_> = told.collect();
    format!(
        "A wheel in the air is essentially an inertia of {} kg m² with {} s of delay and half a sample of hold: {}. \
         The paper gives neither inertia nor delay.",
        sig(inertia),
        sig(delay),
        told.join("; ")
    )
}

fn gains(pair: &Pair) -> String {
    format!("kp = {}, ki = {}", sig(pair[0].gains[0]), sig(pair[0].gains[1]))
}

fn table(pairs: &[Pair], motor: usize, name: &str, figure: usize) -> Table {
    let title = format!("Figure {figure}: {name} motor");
    let columns = [("rise time", "s"), ("overshoot", "rad/s"), ("steady error", "rad/s"), ("swing", "rad/s")];
    let mut table = Table::new(format!("figure_{figure}"), title, &columns)
        .digits(Digits::Fixed(3))
        .note(
            "Rise time: from 10 % to 90 % of the target; empty if 90 % is never reached. Swing: peak-to-peak measured speed \
             over the last second. The paper gives no numbers.",
        );
    for pair in pairs {
        for (tracked, way) in pair.iter().zip(WAYS) {
            let response = &tracked.response[motor];
            let ours = [
                response.rise_time_s,
                Some(response.overshoot_rad_s),
                Some(response.steady_error_rad_s),
                Some(tracked.ripple_rad_s[motor]),
            ];
            table.push(format!("{}, {way}", gains(pair)), [], ours);
        }
    }
    table
}

fn chart(pairs: &[Pair], motor: usize, name: &str, figure: usize, target_rad_s: f64) -> Chart {
    let end_s = shown_s(pairs);
    let panel = |pair: &Pair| {
        let series = pair.iter().zip(WAYS).map(|(tracked, way)| {
            let shown = tracked.speed[motor].iter().filter(|point| point[0] <= end_s);
            Series::new(way, Mark::Line, shown.copied())
        });
        let target = Limit { name: "target".to_owned(), y: target_rad_s };
        let y = Axis::new(format!("Motor speed, {}", gains(pair)), "rad/s");
        Panel { limits: vec![target], ..Panel::new(y, series.collect()) }
    };
    Chart {
        title: format!("Figure {figure}: speed of the {name} motor"),
        description: "Measured speed after a step of the target, for the paper's three gain pairs."
            .to_owned(),
        x: Axis { range: Some([0.0, end_s]), ..Axis::new("Time", "s") },
        panels: pairs.iter().map(panel).collect(),
    }
}

/// Twice the longest rise in whole seconds: what there is to see is in there.
fn shown_s(pairs: &[Pair]) -> f64 {
    let runs = pairs.iter().flatten();
    let longest = runs.clone().flat_map(|run| run.response).filter_map(|response| response.rise_time_s);
    let end = runs.flat_map(|run| run.speed[0].last()).map(|point| point[0]).fold(0.0, f64::max);
    libm::ceil(2.0 * longest.fold(0.5, f64::max)).min(libm::ceil(end))
}

/// Longer than any rise that ends.
fn rise(tracked: &Tracked, motor: usize) -> f64 {
    tracked.response[motor].rise_time_s.unwrap_or(f64::INFINITY)
}

fn finding(pairs: &[Pair], pages: &mut Pages) {
    let seconds = |time: f64| if time.is_finite() { format!("{} s", sig(time)) } else { "never".to_owned() };
    let mut slower = 0;
    let mut told = Vec::new();
    for pair in pairs {
        for (motor, (name, _)) in MOTORS.into_iter().enumerate() {
            let [without, with] = [0, 1].map(|way: usize| rise(&pair[way], motor));
            slower += usize::from(!(with.is_finite() && with <= without));
            told.push(format!("{} for {} ({}, {name})", seconds(with), seconds(without), gains(pair)));
        }
    }
    pages.finding(
        "figures_6_7_rise",
        "The rise time from 10 to 90 % of the target is never longer with compensation than without",
        slower == 0,
        format!("Rise times with compensation (without): {}.", listed(&told)),
    );
}
