//! The machine of a model: shown a log, so that what has a memory remembers, and let go at a row.

use super::record::{Record, Told};
use crate::effects::{EffectLaw, Law, Machine, MotionSample, RobotLaws};
use crate::friction::Stribeck;
use crate::model::{AxisParameters, Model, Motor, Rig, RobotModel, State};
use crate::simulate::{Actuator, Followed, Plant};

/// A machine that can be shown a log and be let go.
#[derive(Clone)]
pub(super) enum Moving {
    Robot { plant: Box<Plant>, actuators: [Actuator; 2], offsets: [f64; 2], radius_m: f64 },
    Axis { inertia: f64, gravity: f64, friction: Option<Stribeck>, laws: Vec<EffectLaw>, before: f64 },
}

impl Moving {
    pub(super) fn new(model: &Model, motor: Motor, robot_log: bool) -> Self {
        match &model.rig {
            Rig::Robot(robot) if robot_log => {
                let robot: RobotModel = robot.with_effects_declared();
                let sensors = &robot.sensors;
                Self::Robot {
                    actuators: [(); 2].map(|()| Actuator::new(&robot.limits, &robot.actuation)),
                    offsets: [sensors.imu_mount_angle_rad, sensors.gyro_bias_rad_s],
                    radius_m: robot.parameters.wheel_radius_m,
                    plant: Box::new(Plant::new(&robot, &State::default())),
                }
            }
            Rig::Robot(robot) => {
                let laws = RobotLaws::new(&Machine::wheel_in_air(robot), &robot.effects);
                Self::Axis {
                    inertia: robot.parameters.wheel_inertia_kg_m2,
                    gravity: 0.0,
                    friction: robot.friction[motor as usize],
                    laws: laws.into_motor(motor),
                    before: 0.0,
                }
            }
            Rig::Axis(axis) => {
                let machine = Machine::axis(axis);
                let (inertia, gravity, friction) = match axis.parameters {
                    AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction } => {
                        (inertia_kg_m2, gravity_torque_nm, friction)
                    }
                    AxisParameters::Linear { mass_kg, friction } => (mass_kg, 0.0, friction),
                };
                let laws = axis.effects.iter().map(|effect| effect.law(&machine)).collect();
                Self::Axis { inertia, gravity, friction, laws, before: 0.0 }
            }
        }
    }

    /// Lets what has a memory remember a row.
    pub(super) fn show(&mut self, record: &Record, row: usize) {
        let dt = record.dt_s;
        let after = (row + 1).min(record.time_s.len() - 1);
        let speed = |column: &[f64]| (column[after] - column[row]) / dt;
        match self {
            Self::Robot { plant, actuators, offsets, radius_m } => {
                let speeds = [0, 1].map(|motor: usize| speed(&record.angles[motor]));
                let torque_nm = [0, 1]
                    .map(|motor: usize| actuators[motor].step(record.efforts[motor][row], speeds[motor]));
                let Some((pitch, rate, _)) = &record.imu else { return };
                let told = Told {
                    angle: [0, 1].map(|motor: usize| record.angles[motor][row]),
                    speed: speeds,
                    pitch: pitch[row],
                    rate: rate[row],
                };
                plant.follow(&told.of_robot(*offsets, *radius_m), torque_nm, dt);
            }
            Self::Axis { laws, before, .. } => {
                let speed = speed(&record.angles[0]);
                let moment = MotionSample {
                    time_s: record.time_s[row],
                    dt_s: dt,
                    motor_angle_rad: record.angles[0][row],
                    motor_speed_rad_s: speed,
                    motor_accel_rad_s2: (speed - *before) / dt,
                    torque_nm: record.efforts[0][row],
                    ..MotionSample::default()
                };
                *before = speed;
                laws.iter_mut().for_each(|law| {
                    law.act(&moment);
                });
            }
        }
    }

    /// Variables as the log says them: pitch, x and motor angle, or the one of an axis.
    pub(super) fn variables(&self, told: &Told) -> Vec<f64> {
        match self {
            Moving::Robot { radius_m, .. } => {
                let mean = 0.5 * (told.angle[0] + told.angle[1]);
                vec![told.pitch, radius_m * (mean + told.pitch), mean]
            }
            Moving::Axis { .. } => vec![told.angle[0]],
        }
    }
}

impl Told {
    /// As the simulated robot takes it, readings' offsets off.
    pub(super) fn of_robot(&self, [mount, bias]: [f64; 2], radius_m: f64) -> Followed {
        let (pitch_rad, pitch_rate_rad_s) = (self.pitch - mount, self.rate - bias);
        let mean = |pair: [f64; 2]| 0.5 * (pair[0] + pair[1]);
        Followed {
            state: State {
                x_m: radius_m * (mean(self.angle) + pitch_rad),
                x_dot_m_s: radius_m * (mean(self.speed) + pitch_rate_rad_s),
                pitch_rad,
                pitch_rate_rad_s,
            },
            motor_angle_rad: self.angle,
            motor_speed_rad_s: self.speed,
        }
    }
}
