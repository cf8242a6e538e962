//! Measurement errors of the IMU. They exert no force: an estimator reads the log otherwise instead.

use super::kind::{Declared, EffectKind, Feedforward, Form, Grid, Parameter, Place, Step, Trial};
use crate::model::MachineKind;

const ROBOT: &[MachineKind] = &[MachineKind::Robot];

/// A gyro that turns at standstill.
pub(super) static GYRO_BIAS: EffectKind = EffectKind {
    id: "gyro_bias",
    summary: "pitch rate reading of the gyro at standstill",
    place: Place::Sensor,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("rate_rad_s", [-1.0, 1.0], "bias of the pitch rate")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |_, _| Vec::new(),
    separated_by: "a log of the robot at standstill",
    feedforward: Feedforward::Never(
        "it is a measurement error, not a torque: subtract it from the measurement",
    ),
    declare: |effect, model| {
        let Declared::Robot(robot) = model else { return false };
        robot.sensors.gyro_bias_rad_s += effect.parameters()[0].1;
        true
    },
};

/// An IMU whose filter or bus is slow.
pub(super) static IMU_DELAY: EffectKind = EffectKind {
    id: "imu_delay",
    summary: "fixed delay of the readings of pitch and pitch rate",
    place: Place::Sensor,
    machines: ROBOT,
    parameters: &[Parameter::shape("delay_s", [0.0, 0.5], "delay of the measurement")
        .sized()
        .searched(Grid::Values(&[1.5e-3, 3e-3, 5e-3, 8e-3, 12e-3, 18e-3]), Step::Factor(1.2))],
    wave: None,
    trial: Trial { forms: &[Form::Late], ..Trial::PLAIN },
    make_terms: |_, _| Vec::new(),
    separated_by: "rocking the body with the wheels blocked: the motors then turn opposite to the body",
    feedforward: Feedforward::Never(
        "it is a measurement error, not a torque: extrapolate the measurement to the present",
    ),
    declare: |effect, model| {
        let Declared::Robot(robot) = model else { return false };
        robot.sensors.imu_latency_s += effect.parameters()[0].1;
        robot.sensors.validate().is_ok()
    },
};
