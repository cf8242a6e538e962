//! The report's pictures: the residual over what it depends on, and over the orders of the motor angle.

use std::f64::consts::TAU;

use crate::report::{Axis, Chart, Limit, Mark, Panel, Series, capitalised};

use super::explorer::{Explorer, Variable};
use super::verdict::Refinement;

/// Bins of a picture over a variable, and the fewest rows in one.
const BINS: usize = 48;
const LEAST_IN_BIN: usize = 6;
/// Half the width of the band about a mean, in standard errors.
const BAND: f64 = 1.96;

/// The residual in time, on the held-out rows.
pub(super) fn in_time(explorer: &Explorer) -> Option<Chart> {
    let time = explorer.variable("time_s")?;
    let rows = |residual: &[f64]| -> Vec<[f64; 2]> {
        held(explorer, &time.values).into_iter().zip(held(explorer, residual)).map(|(t, v)| [t, v]).collect()
    };
    let mut panel = Panel::new(
        residual_axis(explorer),
        vec![
            Series::new("before", Mark::Scatter, rows(&explorer.before)),
            Series::new("after", Mark::Scatter, rows(&explorer.after)),
        ],
    );
    panel.limits = noise(explorer);
    Some(Chart {
        title: "Residual in time, on held-out rows".to_owned(),
        description: "Measured minus modelled, before and after.".to_owned(),
        x: Axis::new("Time", "s"),
        panels: vec![panel],
    })
}

fn noise(explorer: &Explorer) -> Vec<Limit> {
    let name = "noise floor of the residual, one standard deviation";
    [1.0, -1.0].map(|sign| Limit { name: name.to_owned(), y: sign * explorer.noise_floor }).into()
}

fn residual_axis(explorer: &Explorer) -> Axis {
    Axis::new(capitalised(&format!("{} residual", explorer.channel)), explorer.unit)
}

fn held(explorer: &Explorer, values: &[f64]) -> Vec<f64> {
    values.iter().zip(&explorer.held_out).filter(|(_, held)| **held).map(|(value, _)| *value).collect()
}

/// The residual over a variable, as means in bins with bands of 95 %.
pub(super) fn over(explorer: &Explorer, variable: &Variable) -> Chart {
    let in_a_turn = variable.name.contains("angle");
    let values: Vec<f64> = held(explorer, &variable.values)
        .into_iter()
        .map(|value| if in_a_turn { value.rem_euclid(TAU) } else { value })
        .collect();
    let mut series = Vec::new();
    for (name, residual) in [("before", &explorer.before), ("after", &explorer.after)] {
        let bins = binned(&values, &held(explorer, residual));
        let outline = bins.iter().map(|b| [b.at, b.mean + b.half]);
        let back = bins.iter().rev().map(|b| [b.at, b.mean - b.half]);
        series.push(Series::new(name, Mark::Area, outline.chain(back)));
        let mark = if name == "before" { Mark::Dashed } else { Mark::Line };
        series.push(Series::new(name, mark, bins.iter().map(|b| [b.at, b.mean])));
    }
    Chart {
        title: format!("Residual over {}", in_words(variable)),
        description: "Mean residual in bins of equal numbers of held-out rows, with 95 % bands.".to_owned(),
        x: Axis::new(capitalised(in_words(variable).trim_start_matches("the ")), variable.unit),
        panels: vec![Panel::new(residual_axis(explorer), series)],
    }
}

fn in_words(variable: &Variable) -> String {
    let name = match variable.name {
        "time_s" => "time",
        "motor_angle_rad" => "angle within a turn",
        "motor_speed_rad_s" => "motor speed",
        "torque_nm" => "the torque",
        "force_n" => "the force",
        "x_m" => "the place",
        "x_dot_m_s" => "robot speed",
        "pitch_rad" => "the pitch",
        "pitch_rate_rad_s" => "pitch rate",
        "position_m" => "the position",
        "velocity_m_s" => "the speed",
        other => other,
    };
    name.to_owned()
}

struct Bin {
    at: f64,
    mean: f64,
    half: f64,
}

/// Means of `values` in bins of `over` with the same number of rows.
fn binned(over: &[f64], values: &[f64]) -> Vec<Bin> {
    let mut pairs: Vec<[f64; 2]> = over.iter().zip(values).map(|(x, y)| [*x, *y]).collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let size = pairs.len().div_ceil(BINS).max(LEAST_IN_BIN);
    let bin = |rows: &[[f64; 2]]| {
        let count = rows.len() as f64;
        let mean = |place: usize| rows.iter().map(|row| row[place]).sum::<f64>() / count;
        let (at, mean) = (mean(0), mean(1));
        let variance = rows.iter().map(|row| (row[1] - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Bin { at, mean, half: BAND * (variance / count).sqrt() }
    };
    pairs.chunks(size).filter(|rows| rows.len() >= LEAST_IN_BIN.min(pairs.len())).map(bin).collect()
}

/// Amplitudes over the orders of the motor angle; `None` if no order stands out.
pub(super) fn orders(explorer: &Explorer) -> Option<Chart> {
    if explorer.orders.len() < 4 {
        return None;
    }
    let stems = |place: usize| {
        explorer
            .orders
            .iter()
            .flat_map(move |order| [[order[0], 0.0], [order[0], order[place]], [order[0], f64::NAN]])
    };
    let shifted = |points: Vec<[f64; 2]>| points.into_iter().map(|[x, y]| [x + 0.3, y]);
    Some(Chart {
        title: "Orders of the motor angle".to_owned(),
        description: "Amplitude of the residual at each harmonic of a turn, before and after.".to_owned(),
        x: Axis::new("Order", "1/turn"),
        panels: vec![Panel::new(
            Axis::new("Amplitude", explorer.unit),
            vec![
                Series::new("before", Mark::Line, stems(1)),
                Series::new("after", Mark::Line, shifted(stems(2).collect())),
            ],
        )],
    })
}

/// The variable that an effect of the library is a function of.
pub(super) fn variable_of<'a>(id: &str, explorer: &'a Explorer) -> Option<&'a Variable> {
    let names: &[&str] = match id {
        "cogging" | "torque_ripple" | "position_dependent_friction" | "wheel_eccentricity" => {
            &["motor_angle_rad", "position_m"]
        }
        "tether_spring" | "terrain" => &["x_m"],
        "aero_drag" | "rolling_resistance" => &["x_dot_m_s"],
        "pitch_offset" | "mass_error" | "com_height_error" => &["pitch_rad"],
        "thermal_friction" | "external_push" | "ground_slope" | "gyro_bias" => &["time_s"],
        "command_delay"
        | "actuator_lag"
        | "torque_gain"
        | "torque_saturation"
        | "torque_deadzone"
        | "backlash"
        | "load_dependent_friction" => &["torque_nm", "force_n"],
        "imu_delay" | "body_inertia_error" | "slosh" | "structural_mode" => {
            &["pitch_rate_rad_s", "motor_speed_rad_s"]
        }
        "inertia_error" => &["motor_acceleration_rad_s2", "acceleration_m_s2", "motor_speed_rad_s"],
        _ => &["motor_speed_rad_s", "velocity_m_s"],
    };
    names.iter().find_map(|name| explorer.variable(name))
}

/// A picture for each variable that an effect that was found, or what is left, depends on.
pub(super) fn evidence(found: &Refinement) -> Vec<Chart> {
    let explorer = &found.explorer;
    let mut variables: Vec<&Variable> =
        found.effects.iter().filter_map(|effect| variable_of(effect.effect.id(), explorer)).collect();
    variables.extend(found.unexplained.depends_on.iter().filter_map(|name| explorer.variable(name)));
    if variables.is_empty() {
        variables
            .extend(["motor_speed_rad_s", "velocity_m_s"].iter().find_map(|name| explorer.variable(name)));
    }
    let mut shown: Vec<&str> = Vec::new();
    let mut charts = Vec::new();
    for variable in variables {
        if variable.name != "time_s" && !shown.contains(&variable.name) {
            shown.push(variable.name);
            charts.push(over(explorer, variable));
        }
    }
    let by_angle = found.effects.iter().any(|effect| effect.effect.kind().by_angle())
        || shown.contains(&"motor_angle_rad");
    if by_angle {
        charts.extend(orders(explorer));
    }
    charts
}
