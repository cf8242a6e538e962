//! The exported C header computes the torques that the core's controller computes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::PathBuf;
use std::process::Command;

use flqr_core::control::{BalanceController, ControllerKind, Measurement};
use flqr_core::export::{Controller, Format};
use flqr_core::lqr;
use flqr_core::model_file::presets;

/// x, ẋ, pitch, pitch rate; left and right motor speed. The fourth asks for more than the motors' limit, and
/// the last two have a sensor that failed.
const STATES: [[f64; 6]; 6] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.05, -0.1, 0.02, 0.1, 0.004, -0.004],
    [-0.2, 0.3, -0.05, -0.4, -3.0, 20.0],
    [3.0, 1.0, 0.6, 0.0, 40.0, 40.0],
    [0.0, 0.0, f64::NAN, 0.0, 1.0, 1.0],
    [0.0, f64::INFINITY, 0.0, 0.0, 1.0, 1.0],
];

#[test]
fn c_header_agrees_with_the_controller() {
    if Command::new("cc").arg("--version").output().is_err() {
        println!("skipped: no C compiler here");
        return;
    }
    let model = presets::paper();
    let robot = model.robot().unwrap();
    let design = lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap();
    let controller = BalanceController::new(ControllerKind::Flqr, robot, design.gain).unwrap();
    let header = Controller::new(&model.name, &controller).render(Format::CHeader);
    let printed = compile_and_run(&header);
    for (state, line) in STATES.iter().zip(printed.lines()) {
        let &[x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s, left, right] = state;
        let state = flqr_core::robot::State { x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s };
        let expected = controller.step(&Measurement { state, motor_speed_rad_s: [left, right] });
        let found: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        for motor in 0..2 {
            assert!((found[motor] - expected[motor]).abs() <= 1e-14, "{found:?} for {expected:?}");
        }
    }
    assert_eq!(printed.lines().count(), STATES.len());
}

fn c_literal(number: f64) -> String {
    match number {
        f64::INFINITY => "INFINITY".to_owned(),
        number if number.is_nan() => "NAN".to_owned(),
        number => format!("{number:?}"),
    }
}

/// Prints both torques for each of the states.
fn compile_and_run(header: &str) -> String {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let rows: String =
        STATES.iter().map(|state| format!("{{{}}},", state.map(c_literal).join(","))).collect();
    let program = format!(
        "#include \"controller.h\"\n#include <stdio.h>\n\
         int main(void) {{\n\
         static const double states[][6] = {{{rows}}};\n\
         for (unsigned i = 0; i < sizeof states / sizeof states[0]; ++i) {{\n\
         double torque[2];\n\
         flqr_step(states[i], states[i] + 4, torque);\n\
         printf(\"%.17g %.17g\\n\", torque[0], torque[1]);\n\
         }}\nreturn 0;\n}}\n"
    );
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
