//! Section 4.2: Tables 1 to 4, Figures 4 and 5.

use super::pages::Pages;
use super::paper;
use super::phrases::{percent, sig};
use super::table::{Digits, Table};
use super::trials::Identified;
use crate::friction::{Stribeck, StribeckParameters};
use crate::identify::{Bounds, FitReport, PsoSettings, SearchBox};
use crate::model::RobotModel;
use crate::report::{Axis, Chart, Mark, Panel, Scale, Series};

/// Tolerance of the fitted curve at the measured speeds.
const CURVE_TOLERANCE: f64 = 0.02;
/// Fraction of the fastest speed that is shown once more, because the curve bends there.
const SLOW: f64 = 0.06;
const MOTORS: [&str; 2] = ["left", "right"];
/// Rows of Tables 3 and 4 with the model file's keys.
const NAMES: [(&str, &str); 6] = [
    ("f_c, N m", "coulomb_nm"),
    ("f_s, N m", "static_nm"),
    ("f_v, N m s/rad", "viscous_nm_s_rad"),
    ("v_s, rad/s", "stribeck_speed_rad_s"),
    ("ξ", "stribeck_exponent"),
    ("f_p, N m", "offset_nm"),
];

pub(super) fn write(robot: &RobotModel, motors: &[Identified; 2], pages: &mut Pages) {
    pages.section("Friction identification (section 4.2)");
    pages.paragraph(
        "Each motor of the simulated bench runs at a sequence of constant speeds, with sensor noise and quantization; \
         each speed gives eight pairs of speed and torque (section 3.1). The six parameters of Eq. 28 are fitted to them by PSO (Algorithm 1 with Table 2), followed by local refinement.",
    );
    pages.table(motor_table(robot));
    pages.table(swarm_table());
    pages.contradiction(5, stop_rule(motors));
    bounds(motors, pages);
    pages.table(parameter_table(motors));
    pages.table(interval_table(motors));
    pages.table(error_table(motors));
    curve_finding(motors, pages);
    pages.contradiction(7, correlation(motors));
    pages.contradiction(2, error_unit(motors));
    pages.contradiction(9, pair_count(motors));
    pages.chart(error_chart(motors));
    let fastest = motors.iter().flat_map(|motor| &motor.fit.pairs).map(|pair| pair.speed_rad_s.abs());
    let fastest = fastest.fold(0.0, f64::max);
    pages.chart(curve_chart(motors, "Figure 5: fitted friction", fastest));
    pages.chart(curve_chart(motors, "Figure 5 at slow speeds", SLOW * fastest));
}

fn motor_table(robot: &RobotModel) -> Table {
    let columns = [("rated torque", "N m"), ("rated speed", "rpm"), ("power", "W")];
    let rpm = |speed: f64| speed * 60.0 / std::f64::consts::TAU;
    let (torque, speed) = (robot.limits.torque_nm, robot.limits.rated_speed_rad_s);
    let mut table = Table::new(
        "table_1",
        "Table 1: in-wheel motors; simulation: limits of the model",
        &columns,
    )
    .digits(Digits::Short)
    .note(
        "The product of the paper's torque and speed is the rated mechanical power; the joint motors are not \
             used for balancing.",
    );
    let power = torque.zip(speed).map(|(torque, speed)| torque * speed);
    table.push("in-wheel motor", paper::TABLE_1.map(Some), [torque, speed.map(rpm), power]);
    table
}

fn swarm_table() -> Table {
    let ours = PsoSettings::default();
    let rows = [
        ("particles M", ours.particles as f64),
        ("learning factor c₁", ours.learn_cognitive),
        ("learning factor c₂", ours.learn_social),
        ("inertia at the start ω_s", ours.inertia_start),
        ("inertia at the end ω_e", ours.inertia_end),
        ("constraint factor α", ours.constraint_factor),
        ("velocity limit", ours.velocity_limit),
        ("iterations T", ours.iterations as f64),
    ];
    let mut table =
        Table::new("table_2", "Table 2: PSO settings", &[("value", "")]).digits(Digits::Short).note(
            "The velocity limit is printed without a unit; here it is a fraction of each parameter's range.",
        );
    for ((name, value), paper) in rows.into_iter().zip(paper::TABLE_2) {
        table.push(name, [Some(paper)], [Some(value)]);
    }
    table
}

/// f_c, f_s, f_v, v_s, ξ, f_p from the order of a search box.
fn in_table_order(values: [f64; 6]) -> [f64; 6] {
    let [coulomb, stiction, speed, exponent, viscous, offset] = values;
    [coulomb, stiction, viscous, speed, exponent, offset]
}

fn bounds(motors: &[Identified; 2], pages: &mut Pages) {
    let ours = SearchBox::from_pairs(&motors[0].fit.pairs);
    let [lower, upper] = [ours.lower, ours.upper].map(in_table_order);
    let title = "Table 3: search bounds; simulation: bounds from the data of the left motor";
    let mut table = Table::new("table_3", title, &[("lower", ""), ("upper", "")]).digits(Digits::Short);
    for (row, (name, _)) in NAMES.into_iter().enumerate() {
        table.push(name, paper::TABLE_3[row].map(Some), [Some(lower[row]), Some(upper[row])]);
    }
    pages.table(table);
    let least = paper::TABLE_3[2][0];
    let found = paper::TABLE_4.map(|motor| motor.viscous_nm_s_rad);
    let excluded = found.iter().filter(|&&value| value < least).count();
    let errors: Vec<_> = motors
        .iter()
        .zip(MOTORS)
        .map(|(motor, name)| {
            format!(
                "{} N m ({name}) compared with {} N m with bounds from the data",
                sig(motor.as_printed.rmse),
                sig(motor.fit.rmse)
            )
        })
        .collect();
    pages.contradiction(
        1,
        format!(
            "Table 3's lower bound of f_v, {}, excludes {excluded} of the 2 values that Table 4 prints, {} and {}. Within \
             Table 3 as printed, the RMS error of PSO is {}; the optimum within it is {} N m (left) and {} N m (right). Here, the lower bound of f_v is {}.",
            sig(least),
            sig(found[0]),
            sig(found[1]),
            errors.join(" and "),
            sig(motors[0].least_as_printed_nm),
            sig(motors[1].least_as_printed_nm),
            sig(lower[2]),
        ),
    );
    let read = SearchBox::paper();
    let [read_speed, read_exponent] = [read.lower[2], read.lower[3]];
    pages.contradiction(
        6,
        format!(
            "The lower bounds v_s = {} and ξ = {} are within Table 3, but make Eq. 28 singular (0/0) or f_s ineffective. \
             Where Table 3 is used as printed, they are replaced by {} and {}; the bounds from the data begin at {} rad/s and {}.",
            sig(paper::TABLE_3[3][0]),
            sig(paper::TABLE_3[4][0]),
            sig(read_speed),
            sig(read_exponent),
            sig(lower[3]),
            sig(lower[4]),
        ),
    );
}

fn stop_rule(motors: &[Identified; 2]) -> String {
    let count = motors[0].fit.iterations;
    format!(
        "The search is to stop when the fitness is below a threshold in two consecutive iterations, but fitness is one \
         over the error (Eq. 40), so larger is better; here the error is compared with the threshold. The paper \
         gives no threshold; here it is {}, so that all {count} iterations run.",
        sig(PsoSettings::default().error_threshold)
    )
}

fn values(curve: &StribeckParameters) -> [f64; 6] {
    [
        curve.coulomb_nm,
        curve.static_nm,
        curve.viscous_nm_s_rad,
        curve.stribeck_speed_rad_s,
        curve.stribeck_exponent,
        curve.offset_nm,
    ]
}

fn parameter_table(motors: &[Identified; 2]) -> Table {
    let title = "Table 4: identified parameters; simulation: bench with the friction of the model";
    let mut table = Table::new("table_4", title, &[("left", ""), ("right", "")]);
    for (row, (name, key)) in NAMES.into_iter().enumerate() {
        let ours = motors.iter().map(|motor| motor.fit.parameters.get(key).map(|estimate| estimate.value));
        table.push(name, paper::TABLE_4.iter().map(|curve| Some(values(curve)[row])), ours);
    }
    table
}

fn interval_table(motors: &[Identified; 2]) -> Table {
    let columns = [("left, from", ""), ("left, to", ""), ("right, from", ""), ("right, to", "")];
    let mut table =
        Table::new("table_4_intervals", "95 % intervals of the simulation's parameters", &columns);
    for (name, key) in NAMES {
        let interval = |motor: &Identified| motor.fit.parameters.get(key).and_then(|estimate| estimate.ci95);
        let ends = motors.iter().flat_map(|motor| {
            let interval = interval(motor);
            [interval.map(|ends| ends[0]), interval.map(|ends| ends[1])]
        });
        table.push(name, [], ends);
    }
    table
}

/// Largest |fitted − true| / |true| over the speeds of the pairs.
fn worst_relative_error(motor: &Identified) -> f64 {
    let Some(fitted) = fitted_curve(&motor.fit) else { return f64::NAN };
    let error = |speed: f64| {
        let truth = motor.curve.torque_nm(speed);
        (fitted.torque_nm(speed) - truth).abs() / truth.abs()
    };
    motor.fit.pairs.iter().map(|pair| error(pair.speed_rad_s)).fold(0.0, f64::max)
}

fn fitted_curve(fit: &FitReport) -> Option<Stribeck> {
    fit.stribeck().and_then(|parameters| Stribeck::new(parameters).ok())
}

fn error_table(motors: &[Identified; 2]) -> Table {
    let columns =
        [("pairs", ""), ("slowest", "rad/s"), ("fastest", "rad/s"), ("error", "N m"), ("curve error", "%")];
    let mut table =
        Table::new("section_4_2", "Section 4.2: the data and how well the curve fits them", &columns).note(
            "Error: RMS over the pairs (Eq. 32); in the paper, a standard deviation without a unit. Curve \
         error: largest relative difference between the fitted and the true curve at the measured speeds.",
        );
    for ((motor, name), error) in motors.iter().zip(MOTORS).zip(paper::ERROR) {
        let speeds = || motor.fit.pairs.iter().map(|pair| pair.speed_rad_s.abs());
        let ours = [
            motor.fit.pairs.len() as f64,
            speeds().fold(f64::INFINITY, f64::min),
            speeds().fold(0.0, f64::max),
            motor.fit.rmse,
            100.0 * worst_relative_error(motor),
        ];
        let paper = [Some(paper::PAIRS), None, Some(paper::FASTEST_RAD_S), Some(error)];
        table.push(name, paper, ours.map(Some));
    }
    table
}

fn curve_finding(motors: &[Identified; 2], pages: &mut Pages) {
    let worst = [0, 1].map(|motor| worst_relative_error(&motors[motor]));
    pages.finding(
        "table_4_curve",
        format!(
            "The fitted curve is within {} of the true one at every measured speed",
            percent(CURVE_TOLERANCE)
        ),
        worst.iter().all(|error| *error <= CURVE_TOLERANCE),
        format!(
            "The worst is {} on the left motor and {} on the right.",
            percent(worst[0]),
            percent(worst[1])
        ),
    );
    for (motor, name) in motors.iter().zip(MOTORS).filter(|(motor, _)| !motor.fit.warnings.is_empty()) {
        pages.note(format!("{name} motor: {}.", motor.fit.warnings.join("; ")));
    }
}

fn correlation(motors: &[Identified; 2]) -> String {
    let fading = |curve: &StribeckParameters| {
        let ratio = paper::FASTEST_RAD_S / curve.stribeck_speed_rad_s;
        libm::exp(-libm::pow(ratio, curve.stribeck_exponent))
    };
    let [left, right] = paper::TABLE_4.map(|curve| fading(&curve));
    let furthest = motors.iter().zip(MOTORS).filter_map(|(motor, name)| {
        let relative =
            NAMES.into_iter().zip(values(motor.curve.parameters())).filter_map(|((label, key), truth)| {
                let found = motor.fit.parameters.get(key)?.value;
                Some((label, (found / truth - 1.0).abs()))
            });
        let (label, off) = relative.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let label = label.split(',').next().unwrap_or(label);
        Some(format!("{label} of the {name} motor has an error of {}", percent(off)))
    });
    let furthest: Vec<_> = furthest.collect();
    format!(
        "With the exponents of Table 4 the transition from static to sliding friction is not complete at {} rad/s: {} \
         (left) and {} (right) of it remain. So f_c, f_s, v_s and ξ trade off against each other and different sets fit \
         equally well: here {}, while the curve error is at most {} and {}. A fit should be assessed by its curve.",
        sig(paper::FASTEST_RAD_S),
        percent(left),
        percent(right),
        furthest.join(" and "),
        percent(worst_relative_error(&motors[0])),
        percent(worst_relative_error(&motors[1])),
    )
}

/// Largest torque of a curve at the speeds of the paper, N m.
fn largest_torque(curve: &StribeckParameters) -> f64 {
    let Ok(curve) = Stribeck::new(*curve) else { return f64::NAN };
    let speeds = (0..=1000).map(|i| 0.1 * f64::from(i));
    let inside = speeds.filter(|speed| *speed > 0.0 && *speed <= paper::FASTEST_RAD_S);
    inside.flat_map(|speed| [speed, -speed]).map(|speed| curve.torque_nm(speed).abs()).fold(0.0, f64::max)
}

fn error_unit(motors: &[Identified; 2]) -> String {
    let largest = paper::TABLE_4.iter().map(largest_torque).fold(0.0, f64::max);
    let ratio = paper::ERROR.map(|error| error / largest);
    let verdict = if ratio.iter().all(|ratio| *ratio > 1.0) {
        format!(
            "{} and {} times that: in N m it would be the error of a failed fit",
            sig(ratio[0]),
            sig(ratio[1])
        )
    } else {
        format!("{} and {} of that", percent(ratio[0]), percent(ratio[1]))
    };
    format!(
        "The standard deviations of the error, {} and {}, have no unit. From 0.1 to {} rad/s the friction of Table 4 is at \
         most {} N m, and they are {verdict}. In the simulation they are {} and {} N m; PSO within Table 3 as printed gives \
         {} and {} N m.",
        sig(paper::ERROR[0]),
        sig(paper::ERROR[1]),
        sig(paper::FASTEST_RAD_S),
        sig(largest),
        sig(motors[0].fit.rmse),
        sig(motors[1].fit.rmse),
        sig(motors[0].as_printed.rmse),
        sig(motors[1].as_printed.rmse),
    )
}

fn pair_count(motors: &[Identified; 2]) -> String {
    format!(
        "{} pairs at {} segments for each constant speed would be {} speeds, not a whole number; here {} pairs come from {} \
         speeds.",
        paper::PAIRS,
        paper::SEGMENTS,
        paper::PAIRS / paper::SEGMENTS,
        motors[0].fit.pairs.len(),
        motors[0].fit.pairs.len() as f64 / paper::SEGMENTS,
    )
}

fn error_chart(motors: &[Identified; 2]) -> Chart {
    let history = |fit: &FitReport| {
        fit.history.iter().enumerate().map(|(i, error)| [(i + 1) as f64, *error]).collect::<Vec<_>>()
    };
    let runs = [(Bounds::Data, "bounds from the data"), (Bounds::Paper, "Table 3 as printed")];
    let series = runs.into_iter().flat_map(|(bounds, words)| {
        motors.iter().zip(MOTORS).map(move |(motor, name)| {
            let (fit, mark) = match bounds {
                Bounds::Data => (&motor.fit, Mark::Step),
                Bounds::Paper => (&motor.as_printed, Mark::Dashed),
            };
            Series::new(format!("{name}, {words}"), mark, history(fit))
        })
    });
    Chart {
        title: "Figure 4: PSO error over the iterations".to_owned(),
        description: "RMS error of the best particle, before local refinement.".to_owned(),
        x: Axis::new("Iteration", ""),
        panels: vec![Panel::new(Axis { scale: Scale::Log, ..Axis::new("Error", "N m") }, series.collect())],
    }
}

/// The curves up to a speed.
fn curve_chart(motors: &[Identified; 2], title: &str, fastest: f64) -> Chart {
    let panel = |(motor, name): (&Identified, &str)| {
        let pairs = motor.fit.pairs.iter().filter(|pair| pair.speed_rad_s.abs() <= fastest);
        let curve = |curve: Stribeck| {
            (-500..=500).map(move |i| fastest * f64::from(i) / 500.0).map(move |speed| {
                // Nothing joins the two directions: at standstill there is no single value.
                [speed, if speed == 0.0 { f64::NAN } else { curve.torque_nm(speed) }]
            })
        };
        let mut series = vec![
            Series::new("pairs", Mark::Scatter, pairs.map(|pair| [pair.speed_rad_s, pair.torque_nm])),
            Series::new("true curve", Mark::Line, curve(motor.curve)),
        ];
        series.extend(
            fitted_curve(&motor.fit).map(|fitted| Series::new("fitted curve", Mark::Dashed, curve(fitted))),
        );
        Panel::new(Axis::new(format!("Friction torque, {name} motor"), "N m"), series)
    };
    Chart {
        title: title.to_owned(),
        description: "Pairs of the simulated bench, its true friction, and the fitted curve.".to_owned(),
        x: Axis::new("Motor speed", "rad/s"),
        panels: motors.iter().zip(MOTORS).map(panel).collect(),
    }
}
