//! The exported C header computes the torques that the core's controller computes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "../src/core/tests/shared/skip.rs"]
mod skip;

use std::path::PathBuf;
use std::process::Command;

use flqr_core::control::{BalanceController, ControllerKind, GainSchedule, Reference};
use flqr_core::export::{Controller, Format};
use flqr_core::lqr;
use flqr_core::model::{Model, RobotModel, State};
use flqr_core::model_file::presets;
use flqr_core::record::Readings;

/// Left and right motor angle, left and right motor speed, pitch, pitch rate; x, ẋ, pitch, pitch rate and yaw to
/// track. The fourth asks for more than the motors' limit, and two have a sensor that failed.
const ROWS: [[f64; 11]; 7] = [
    [0.0; 11],
    [0.5, 0.4, 0.004, -0.004, 0.02, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-3.0, -3.5, -3.0, 20.0, -0.05, -0.4, 0.3, -0.2, 0.01, 0.1, 0.2],
    [30.0, 33.0, 40.0, 40.0, 0.6, 0.0, 1.0, 0.0, 0.0, 0.0, -0.5],
    [0.0, 0.0, 1.0, 1.0, f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, f64::INFINITY, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1e-3, 0.0, 0.0, 0.0, -0.001, 0.002, -0.01, 0.0, 0.0, 0.0, 0.001],
];

#[test]
fn c_header_agrees_with_the_controller() {
    if no_compiler() {
        skip::report_skipped("install a C compiler as cc");
        return;
    }
    let model = presets::paper();
    let controller = controller(model.robot().unwrap());
    let header = Controller::new(&model.name, &controller, None).render(Format::CHeader);
    let printed = compile_and_run("flat", &header, &main_of_rows());
    check_rows(&printed, &controller);
}

/// A robot on legs with a yaw hold of its own: the same law, and gains at heights of, between and beyond the
/// table's nodes.
#[test]
fn c_header_agrees_with_the_schedule() {
    if no_compiler() {
        skip::report_skipped("install a C compiler as cc");
        return;
    }
    let robot = legged();
    let schedule = GainSchedule::design(&robot, 5).unwrap();
    let controller = controller(&robot);
    let header = Controller::new("legs", &controller, Some(&schedule)).render(Format::CHeader);
    let printed = compile_and_run("legs", &header, &main_of_rows());
    check_rows(&printed, &controller);
    let heights = [0.1, 0.32, 0.333, 0.345, 0.37, 0.4199, 0.42, 1.0];
    let loops: String = heights
        .iter()
        .map(|height| {
            format!(
                "{{ const flqr_gains g = flqr_gain_at({height:?}); for (int i = 0; i < 8; ++i) printf(\"%.17g \", \
                 g.k[i / 4][i % 4]); printf(\"\\n\"); }}\n"
            )
        })
        .collect();
    let printed = compile_and_run("heights", &header, &loops);
    assert_eq!(printed.lines().count(), heights.len());
    for (height, line) in heights.into_iter().zip(printed.lines()) {
        let expected = schedule.at(height);
        for (index, found) in numbers(line).into_iter().enumerate() {
            let expected = expected[(index / 4, index % 4)];
            assert!((found - expected).abs() <= 1e-14 * expected.abs(), "{found} for {expected} at {height}");
        }
    }
}

fn no_compiler() -> bool {
    Command::new("cc").arg("--version").output().is_err()
}

fn controller(robot: &RobotModel) -> BalanceController {
    let design = lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap();
    BalanceController::new(ControllerKind::Flqr, robot, design.gain).unwrap()
}

fn legged() -> RobotModel {
    let text = "name = \"legs\"\n[robot]\nbody_mass_kg = 12.5\nwheel_mass_kg = 1.25\n\
         wheel_inertia_kg_m2 = 0.0025\nwheel_radius_m = 0.063\nleg_height_m = 0.35\n\
         com_height_m = { leg_height_m = [0.32, 0.42], com_height_m = [0.12, 0.19] }\n\
         body_inertia_kg_m2 = 0.1\n[friction.right]\ncoulomb_nm = 0.04\nstatic_nm = 0.06\n\
         viscous_nm_s_rad = 4e-4\nstribeck_speed_rad_s = 2.0\nstribeck_exponent = 0.3\noffset_nm = 0.001\n\
         [lqr]\nq_diagonal = [1.0, 0.01, 0.01, 0.001]\nr_diagonal = [1.25, 1.25]\n\
         [yaw_hold]\nstiffness_nm_rad = 3.0\ndamping_nm_s_rad = 0.4\n";
    Model::from_toml(text, "legs.toml").unwrap().robot().unwrap().clone()
}

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace().map(|number| number.parse().unwrap()).collect()
}

fn check_rows(printed: &str, controller: &BalanceController) {
    assert_eq!(printed.lines().count(), ROWS.len());
    for (&row, line) in ROWS.iter().zip(printed.lines()) {
        let [q_left, q_right, left, right, pitch_rad, pitch_rate_rad_s, x, x_dot, pitch, rate, yaw_rad] = row;
        let readings = Readings {
            motor_angle_rad: [q_left, q_right],
            motor_speed_rad_s: [left, right],
            pitch_rad,
            pitch_rate_rad_s,
        };
        let state = State { x_m: x, x_dot_m_s: x_dot, pitch_rad: pitch, pitch_rate_rad_s: rate };
        let measurement = controller.odometry.measurement(&readings);
        let expected = controller.step(&measurement, &Reference { state, yaw_rad });
        let found = numbers(line);
        for motor in 0..2 {
            assert!((found[motor] - expected[motor]).abs() <= 1e-13, "{found:?} for {expected:?}");
        }
    }
}

/// Prints both torques for each of the rows.
fn main_of_rows() -> String {
    let rows: String = ROWS.iter().map(|row| format!("{{{}}},", row.map(c_literal).join(","))).collect();
    format!(
        "static const double rows[][11] = {{{rows}}};\n\
         for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; ++i) {{\n\
         const double *r = rows[i];\n\
         const flqr_readings readings = {{{{r[0], r[1]}}, {{r[2], r[3]}}, r[4], r[5]}};\n\
         const flqr_measurement measurement = flqr_measure(&readings);\n\
         const flqr_reference reference = {{{{r[6], r[7], r[8], r[9]}}, r[10]}};\n\
         double torque[2];\n\
         flqr_step(&flqr_gain, &measurement, &reference, torque);\n\
         printf(\"%.17g %.17g\\n\", torque[0], torque[1]);\n\
         }}\n"
    )
}

fn c_literal(number: f64) -> String {
    match number {
        f64::INFINITY => "INFINITY".to_owned(),
        number if number.is_nan() => "NAN".to_owned(),
        number => format!("{number:?}"),
    }
}

/// What a program of the header and the body of `main` prints; `name` is its folder.
fn compile_and_run(name: &str, header: &str, main: &str) -> String {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let program =
        format!("#include \"controller.h\"\n#include <stdio.h>\nint main(void) {{\n{main}return 0;\n}}\n");
    std::fs::write(folder.join("controller.h"), header).unwrap();
    std::fs::write(folder.join("main.c"), program).unwrap();
    let built = Command::new("cc")
        .args([
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-O1",
            "-ffp-contract=off",
            "main.c",
            "-o",
            "controller",
            "-lm",
        ])
        .current_dir(&folder)
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    String::from_utf8(Command::new(folder.join("controller")).output().unwrap().stdout).unwrap()
}
