//! The effects of the model on the robot in motion.

use super::{Phase, Plant};
use crate::effects::{Action, Machine, MotionSample, RobotLaws};
use crate::model::RobotModel;

/// Laws with what they have to remember of the motion.
#[derive(Clone, Debug)]
pub(super) struct Effects {
    laws: RobotLaws,
    time_s: f64,
    /// Speeds before the last substep: motors, rad/s, the robot's, m/s, and pitch rate, rad/s; none before the first.
    before: Option<Speeds>,
}

#[derive(Clone, Copy, Debug)]
struct Speeds {
    motor: [f64; 2],
    forward: f64,
    pitch: f64,
}

impl Effects {
    /// The laws of a robot's effects; none without any.
    pub(super) fn new(robot: &RobotModel) -> Option<Box<Self>> {
        let laws = RobotLaws::new(&Machine::robot(robot), &robot.effects);
        (!laws.is_empty()).then(|| Box::new(Self { laws, time_s: 0.0, before: None }))
    }

    /// Action over the next substep: as of its middle, to which the motion is carried on with the accelerations
    /// of the last one.
    pub(super) fn act(&mut self, plant: &Plant, torque_nm: [f64; 2], step: f64) -> ([Action; 2], Action) {
        let pose = plant.pose();
        let now = Speeds {
            motor: plant.motor_speed_rad_s(),
            forward: pose.state.x_dot_m_s,
            pitch: pose.state.pitch_rate_rad_s,
        };
        let before = self.before.replace(now).unwrap_or(now);
        let rate = |now: f64, before: f64| (now - before) / step;
        let half = 0.5 * step;
        let middle = |value: f64, speed: f64| value + half * speed;
        let x_accel_m_s2 = rate(now.forward, before.forward);
        let pitch_accel_rad_s2 = rate(now.pitch, before.pitch);
        let whole = MotionSample {
            time_s: self.time_s + half,
            dt_s: step,
            torque_sum_nm: torque_nm[0] + torque_nm[1],
            x_m: middle(pose.state.x_m, now.forward),
            x_dot_m_s: middle(now.forward, x_accel_m_s2),
            x_accel_m_s2,
            pitch_rad: middle(pose.state.pitch_rad, now.pitch),
            pitch_rate_rad_s: middle(now.pitch, pitch_accel_rad_s2),
            pitch_accel_rad_s2,
            ..MotionSample::default()
        };
        let moments = [0, 1].map(|i: usize| {
            let held = plant.phases[i] == Phase::Stuck;
            let acceleration = if held { 0.0 } else { rate(now.motor[i], before.motor[i]) };
            MotionSample {
                motor_angle_rad: middle(plant.motor_angle_rad()[i], now.motor[i]),
                motor_speed_rad_s: middle(now.motor[i], acceleration),
                motor_accel_rad_s2: acceleration,
                torque_nm: torque_nm[i],
                ..whole
            }
        });
        self.time_s += step;
        self.laws.act(&moments)
    }
}
