//! What the IMU says and is not so. No force comes from it: an estimator reads the log otherwise instead.

use super::kind::{Declared, EffectKind, Feedforward, Form, Grid, Parameter, Place, Step, Trial};
use super::machine::MachineKind;

const ROBOT: &[MachineKind] = &[MachineKind::Robot];

/// A gyro that turns at rest.
pub(super) static GYRO_BIAS: EffectKind = EffectKind {
    id: "gyro_bias",
    summary: "pitch rate that the gyro reads at rest",
    place: Place::Sensor,
    machines: ROBOT,
    parameters: &[Parameter::amplitude("rate_rad_s", [-1.0, 1.0], "what is added to the pitch rate")],
    wave: None,
    trial: Trial::PLAIN,
    make_terms: |_, _| Vec::new(),
    separated_by: "a log of the robot at rest",
    feedforward: Feedforward::Never("it is in the reading and no torque: take it off the reading"),
    declare: |effect, model| {
        let Declared::Robot(robot) = model else { return false };
        robot.sensors.gyro_bias_rad_s += effect.parameters()[0].1;
        true
    },
};

/// An IMU whose filter or bus is slow.
pub(super) static IMU_DELAY: EffectKind = EffectKind {
    id: "imu_delay",
    summary: "pitch and pitch rate are those of a fixed time ago",
    place: Place::Sensor,
    machines: ROBOT,
    parameters: &[Parameter::shape("delay_s", [0.0, 0.5], "age of a reading when it arrives")
        .sized()
        .tried(Grid::Values(&[1.5e-3, 3e-3, 5e-3, 8e-3, 12e-3, 18e-3]), Step::Factor(1.2))],
    wave: None,
    trial: Trial { forms: &[Form::Late], ..Trial::PLAIN },
    make_terms: |_, _| Vec::new(),
    separated_by: "the wheels chocked and the body rocked: then the motors turn as the body does, backward",
    feedforward: Feedforward::Never("it is in the reading and no torque: carry the reading on to now"),
    declare: |effect, model| {
        let Declared::Robot(robot) = model else { return false };
        robot.sensors.imu_latency_s += effect.parameters()[0].1;
        robot.sensors.validate().is_ok()
    },
};
