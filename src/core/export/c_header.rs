//! The controller as a C99 header: its numbers, and the control law as inline functions.

use std::fmt::Write;

use super::{Controller, FeedforwardNumbers, Motors};

pub(super) fn render(controller: &Controller) -> String {
    let mut text = String::new();
    write_header(controller, &mut text).expect("writing to a string cannot fail");
    text
}

fn write_header(controller: &Controller, text: &mut String) -> std::fmt::Result {
    writeln!(text, "/* Balance controller of \"{}\", written by flqr.", comment_safe(&controller.name))?;
    writeln!(
        text,
        "   torque = -gain * [x, x_dot, pitch, pitch_rate] + friction feedforward; SI units, rad. */"
    )?;
    writeln!(text, "#ifndef FLQR_CONTROLLER_H\n#define FLQR_CONTROLLER_H\n\n#include <math.h>\n")?;
    writeln!(text, "/* Rows: left, right motor. N m/m, N m s/m, N m/rad, N m s/rad. */")?;
    writeln!(text, "static const double flqr_gain[2][4] = {{")?;
    for row in [&controller.gain.left, &controller.gain.right] {
        writeln!(text, "    {{{}}},", list(row))?;
    }
    writeln!(text, "}};\n")?;
    if let Some(limit) = controller.torque_limit_nm {
        writeln!(text, "/* Largest torque of one motor, N m. */")?;
        writeln!(text, "static const double flqr_torque_limit_nm = {limit:?};\n")?;
    }
    if let Some(feedforward) = &controller.feedforward {
        write_feedforward(feedforward, text)?;
    }
    write_step(controller, text)?;
    writeln!(text, "\n#endif")
}

fn write_feedforward(
    feedforward: &Motors<Option<FeedforwardNumbers>>,
    text: &mut String,
) -> std::fmt::Result {
    writeln!(text, "/* Rows: left, right motor; a ratio of 0 switches a motor's feedforward off. */")?;
    writeln!(text, "static const struct {{\n    double ratio, smoothing_speed_rad_s;")?;
    writeln!(text, "    double coulomb_nm, static_nm, offset_nm, viscous_nm_s_rad;")?;
    writeln!(text, "    double stribeck_speed_rad_s, stribeck_exponent;\n}} flqr_friction[2] = {{")?;
    for motor in [&feedforward.left, &feedforward.right] {
        writeln!(text, "    {{{}}},", list(&feedforward_row(motor.as_ref())))?;
    }
    writeln!(text, "}};\n\n/* Friction feedforward of motor 0 (left) or 1 (right), N m. */")?;
    text.write_str(
        "static inline double flqr_feedforward_nm(int motor, double motor_speed_rad_s)
{
    const double speed_ratio = fabs(motor_speed_rad_s) / flqr_friction[motor].stribeck_speed_rad_s;
    const double fading = exp(-pow(speed_ratio, flqr_friction[motor].stribeck_exponent));
    const double level = flqr_friction[motor].coulomb_nm
        + (flqr_friction[motor].static_nm - flqr_friction[motor].coulomb_nm) * fading;
    const double direction = tanh(motor_speed_rad_s / flqr_friction[motor].smoothing_speed_rad_s);
    return flqr_friction[motor].ratio
        * (level * direction + flqr_friction[motor].viscous_nm_s_rad * motor_speed_rad_s
            + flqr_friction[motor].offset_nm);
}

",
    )
}

fn write_step(controller: &Controller, text: &mut String) -> std::fmt::Result {
    text.write_str(
        "/* state: x (m), x_dot (m/s), pitch (rad), pitch_rate (rad/s), as differences from the target;
   motor_speed_rad_s and torque_nm (N m): left, right. */
static inline void flqr_step(const double state[4], const double motor_speed_rad_s[2], double torque_nm[2])
{
    for (int motor = 0; motor < 2; ++motor) {
        double torque = 0.0;
        for (int i = 0; i < 4; ++i)
            torque -= flqr_gain[motor][i] * state[i];
",
    )?;
    match controller.feedforward {
        Some(_) => {
            writeln!(text, "        torque += flqr_feedforward_nm(motor, motor_speed_rad_s[motor]);")?;
        }
        None => writeln!(text, "        (void)motor_speed_rad_s;")?,
    }
    writeln!(text, "        if (!isfinite(torque)) /* a sensor that failed cannot drive the robot */")?;
    writeln!(text, "            torque = 0.0;")?;
    if controller.torque_limit_nm.is_some() {
        writeln!(text, "        torque = fmax(-flqr_torque_limit_nm, fmin(flqr_torque_limit_nm, torque));")?;
    }
    writeln!(text, "        torque_nm[motor] = torque;\n    }}\n}}")
}

fn feedforward_row(motor: Option<&FeedforwardNumbers>) -> [f64; 8] {
    let Some(FeedforwardNumbers { compensation, friction }) = motor else {
        return [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
    };
    [
        compensation.ratio,
        compensation.smoothing_speed_rad_s,
        friction.coulomb_nm,
        friction.static_nm,
        friction.offset_nm,
        friction.viscous_nm_s_rad,
        friction.stribeck_speed_rad_s,
        friction.stribeck_exponent,
    ]
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(", ")
}

/// A name cannot end the comment it stands in.
fn comment_safe(name: &str) -> String {
    name.replace("*/", "* /").replace(['\n', '\r'], " ")
}
