//! The yaw hold of models that give none.

use crate::model::{Chassis, RobotParameters, YawHold};

/// Natural frequency of the turning body under the default hold, rad/s: a friction that differs by 0.02 N m
/// turns the paper's robot by 0.1°, and at twice this frequency, where the hold's gain passes 1, 4 ms of delay
/// and half a tick of hold cost 5° of phase.
const NATURAL_FREQUENCY_RAD_S: f64 = 10.0;
/// The heading comes back without swinging.
const DAMPING_RATIO: f64 = 1.0;

/// Gains that give the turning robot, I_ψ ψ̈ = (track/r) T under ∓T on left and right motor, a natural
/// frequency of 10 rad/s and critical damping; I_ψ = body + 2 (m + I/r²)(track/2)², wheels included.
pub fn default_yaw_hold(parameters: &RobotParameters, chassis: &Chassis) -> YawHold {
    let (radius, track) = (parameters.wheel_radius_m, chassis.track_width_m);
    let torque_per_acceleration = yaw_inertia_kg_m2(parameters, chassis) * radius / track;
    YawHold {
        stiffness_nm_rad: torque_per_acceleration * NATURAL_FREQUENCY_RAD_S * NATURAL_FREQUENCY_RAD_S,
        damping_nm_s_rad: torque_per_acceleration * 2.0 * DAMPING_RATIO * NATURAL_FREQUENCY_RAD_S,
    }
}

/// Inertia of the turning robot about the vertical, rolling wheels included, kg m².
pub fn yaw_inertia_kg_m2(parameters: &RobotParameters, chassis: &Chassis) -> f64 {
    let (radius, track) = (parameters.wheel_radius_m, chassis.track_width_m);
    let rolling_mass_kg = parameters.wheel_mass_kg + parameters.wheel_inertia_kg_m2 / (radius * radius);
    chassis.yaw_inertia_kg_m2 + 0.5 * rolling_mass_kg * track * track
}
