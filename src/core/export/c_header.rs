//! The controller as a C99 header: its numbers, and the control law as inline functions.

use std::fmt::Write;

use crate::model::Effect;

use super::{Controller, FeedforwardNumbers, Motors, Scheduled};

pub(super) fn render(controller: &Controller) -> String {
    let mut text = String::new();
    write_header(controller, &mut text).expect("writing to a string cannot fail");
    text
}

fn write_header(controller: &Controller, text: &mut String) -> std::fmt::Result {
    writeln!(text, "/* Balance controller of \"{}\", written by flqr.", comment_safe(&controller.name))?;
    writeln!(text, "   torque = gain * (reference - [x, x_dot, pitch, pitch_rate]) -/+ yaw hold")?;
    writeln!(text, "            + friction feedforward; SI units, rad. */")?;
    if !controller.effects.is_empty() {
        let ids: Vec<&str> = controller.effects.iter().map(Effect::id).collect();
        writeln!(text, "/* Effects of the model without feedforward here: {}. */", ids.join(", "))?;
    }
    writeln!(text, "#ifndef FLQR_CONTROLLER_H\n#define FLQR_CONTROLLER_H\n\n#include <math.h>\n")?;
    writeln!(text, "/* Rows: left, right motor. N m/m, N m s/m, N m/rad, N m s/rad. */")?;
    writeln!(text, "typedef struct {{\n    double k[2][4];\n}} flqr_gains;\n")?;
    writeln!(text, "static const flqr_gains flqr_gain = {};\n", gain(&controller.gain, ""))?;
    if !controller.schedule.is_empty() {
        write_schedule(&controller.schedule, text)?;
    }
    let hold = &controller.yaw_hold;
    writeln!(
        text,
        "/* Torque of one motor for each rad and rad/s of yaw, opposite to the other motor's. */"
    )?;
    writeln!(text, "static const double flqr_yaw_stiffness_nm_rad = {:?};", hold.stiffness_nm_rad)?;
    writeln!(text, "static const double flqr_yaw_damping_nm_s_rad = {:?};\n", hold.damping_nm_s_rad)?;
    writeln!(text, "static const double flqr_wheel_radius_m = {:?};", controller.wheel_radius_m)?;
    writeln!(text, "static const double flqr_track_width_m = {:?};\n", controller.track_width_m)?;
    if let Some(limit) = controller.torque_limit_nm {
        writeln!(text, "/* Largest torque of one motor, N m. */")?;
        writeln!(text, "static const double flqr_torque_limit_nm = {limit:?};\n")?;
    }
    if let Some(feedforward) = &controller.feedforward {
        write_feedforward(feedforward, text)?;
    }
    text.write_str(TYPES)?;
    write_step(controller, text)?;
    writeln!(text, "\n#endif")
}

/// Inputs of the control law and their computation from sensor readings.
const TYPES: &str = "/* Pairs: left, right. Yaw: left positive. */
typedef struct {
    double motor_angle_rad[2], motor_speed_rad_s[2], pitch_rad, pitch_rate_rad_s;
} flqr_readings;

typedef struct {
    double state[4]; /* x (m), x_dot (m/s), pitch (rad), pitch_rate (rad/s) */
    double motor_speed_rad_s[2], yaw_rad, yaw_rate_rad_s;
} flqr_measurement;

/* Setpoint: all zero to stand at the start. */
typedef struct {
    double state[4], yaw_rad;
} flqr_reference;

static inline flqr_measurement flqr_measure(const flqr_readings *readings)
{
    const double *angle = readings->motor_angle_rad, *speed = readings->motor_speed_rad_s;
    flqr_measurement measurement;
    measurement.state[0] = flqr_wheel_radius_m * (0.5 * (angle[0] + angle[1]) + readings->pitch_rad);
    measurement.state[1] = flqr_wheel_radius_m * (0.5 * (speed[0] + speed[1]) + readings->pitch_rate_rad_s);
    measurement.state[2] = readings->pitch_rad;
    measurement.state[3] = readings->pitch_rate_rad_s;
    measurement.motor_speed_rad_s[0] = speed[0];
    measurement.motor_speed_rad_s[1] = speed[1];
    measurement.yaw_rad = flqr_wheel_radius_m * (angle[1] - angle[0]) / flqr_track_width_m;
    measurement.yaw_rate_rad_s = flqr_wheel_radius_m * (speed[1] - speed[0]) / flqr_track_width_m;
    return measurement;
}

";

/// A gain as an initialiser, its rows indented by `indent` and four spaces.
fn gain(gain: &Motors<[f64; 4]>, indent: &str) -> String {
    let [left, right] = [&gain.left, &gain.right].map(|row| list(row));
    format!("{{{{\n{indent}    {{{left}}},\n{indent}    {{{right}}},\n{indent}}}}}")
}

fn write_schedule(schedule: &[Scheduled], text: &mut String) -> std::fmt::Result {
    let nodes = schedule.len();
    let heights: Vec<f64> = schedule.iter().map(|node| node.leg_height_m).collect();
    writeln!(text, "/* Gains over leg height, m, lowest first. */")?;
    writeln!(text, "#define FLQR_HEIGHTS {nodes}")?;
    writeln!(text, "static const double flqr_leg_height_m[FLQR_HEIGHTS] = {{{}}};", list(&heights))?;
    writeln!(text, "static const flqr_gains flqr_gain_over_height[FLQR_HEIGHTS] = {{")?;
    for node in schedule {
        writeln!(text, "    {},", gain(&node.gain, "    "))?;
    }
    text.write_str(
        "};

/* Gain at a leg height, interpolated linearly in the table and clamped at its ends. */
static inline flqr_gains flqr_gain_at(double leg_height_m)
{
    int above = 1;
    while (above < FLQR_HEIGHTS - 1 && flqr_leg_height_m[above] < leg_height_m)
        ++above;
    const double lower = flqr_leg_height_m[above - 1], upper = flqr_leg_height_m[above];
    const double fraction = fmax(0.0, fmin(1.0, (leg_height_m - lower) / (upper - lower)));
    flqr_gains gain = flqr_gain_over_height[above - 1];
    for (int motor = 0; motor < 2; ++motor)
        for (int i = 0; i < 4; ++i)
            gain.k[motor][i] += fraction * (flqr_gain_over_height[above].k[motor][i] - gain.k[motor][i]);
    return gain;
}

",
    )
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
        "/* torque_nm (N m): left, right. gain: &flqr_gain, or the gain at another leg height. */
static inline void flqr_step(const flqr_gains *gain, const flqr_measurement *measurement,
    const flqr_reference *reference, double torque_nm[2])
{
    const double turning = flqr_yaw_stiffness_nm_rad * (reference->yaw_rad - measurement->yaw_rad)
        - flqr_yaw_damping_nm_s_rad * measurement->yaw_rate_rad_s;
    for (int motor = 0; motor < 2; ++motor) {
        double torque = motor == 0 ? -turning : turning;
        for (int i = 0; i < 4; ++i)
            torque += gain->k[motor][i] * (reference->state[i] - measurement->state[i]);
",
    )?;
    if controller.feedforward.is_some() {
        writeln!(
            text,
            "        torque += flqr_feedforward_nm(motor, measurement->motor_speed_rad_s[motor]);"
        )?;
    }
    writeln!(text, "        if (!isfinite(torque)) /* a failed sensor must not drive the robot */")?;
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
