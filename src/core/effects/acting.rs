//! All effects of a machine at once.

use super::effect::EffectLaw;
use super::kind::{Declared, Place};
use super::law::{Action, Law, MotionSample};
use super::machine::Machine;
use crate::model::Effect;
use crate::model::{AxisModel, Motor, RobotModel};

/// The laws of a robot's effects, with their memories.
#[derive(Clone, Debug)]
pub struct RobotLaws {
    motors: [Vec<EffectLaw>; 2],
    whole: Vec<EffectLaw>,
}

impl RobotLaws {
    /// The laws of effects on a machine; effects of sensors have none. On one wheel in the air are those inside the
    /// motors.
    pub fn new(machine: &Machine, effects: &[Effect]) -> Self {
        let laws = |wanted: &dyn Fn(&Effect) -> bool| {
            effects.iter().filter(|effect| wanted(effect)).map(|effect| effect.law(machine)).collect()
        };
        Self {
            motors: Motor::BOTH.map(|motor| laws(&|effect: &Effect| effect.is_in(motor))),
            whole: laws(&|effect: &Effect| {
                !effect.kind().per_motor() && effect.kind().place != Place::Sensor
            }),
        }
    }

    /// Returns whether there is none.
    pub fn is_empty(&self) -> bool {
        self.motors.iter().all(Vec::is_empty) && self.whole.is_empty()
    }

    /// Their action at a sample, seen from the left and from the right motor: inside each motor, and on the robot as a
    /// whole.
    pub fn act(&mut self, moments: &[MotionSample; 2]) -> ([Action; 2], Action) {
        let sum = |laws: &mut Vec<EffectLaw>, moment: &MotionSample| {
            laws.iter_mut().fold(Action::default(), |sum, law| sum.plus(1.0, &law.act(moment)))
        };
        let [left, right] = &mut self.motors;
        ([sum(left, &moments[0]), sum(right, &moments[1])], sum(&mut self.whole, &moments[0]))
    }

    /// Those inside one motor alone.
    pub fn into_motor(mut self, motor: Motor) -> Vec<EffectLaw> {
        std::mem::take(&mut self.motors[motor as usize])
    }
}

impl RobotModel {
    /// The robot with those effects in its declared numbers that these can hold, as errors of parameters and of
    /// sensors; the others stay.
    pub fn with_effects_declared(&self) -> Self {
        let mut robot = Self { effects: Vec::new(), ..self.clone() };
        for effect in &self.effects {
            if !effect.declare_in(Declared::Robot(&mut robot)) {
                robot.effects.push(effect.clone());
            }
        }
        robot
    }

    /// From asking for a torque to its acting, mean of both motors, s: the declared delay, and those of the effects,
    /// where a lag counts by its time constant.
    pub fn torque_delay_s(&self) -> f64 {
        let delay_s = |effect: &Effect| match effect.id() {
            "command_delay" => effect.get("delay_s").unwrap_or(0.0),
            "actuator_lag" => effect.get("time_constant_s").unwrap_or(0.0),
            _ => 0.0,
        };
        let of_motor =
            |motor| -> f64 { self.effects.iter().filter(|effect| effect.is_in(motor)).map(delay_s).sum() };
        self.actuation.delay_s + 0.5 * (of_motor(Motor::Left) + of_motor(Motor::Right))
    }
}

impl AxisModel {
    /// The axis with those effects in its declared numbers that these can hold; the others stay.
    pub fn with_effects_declared(&self) -> Self {
        let mut axis = Self::new(self.parameters);
        for effect in &self.effects {
            if !effect.declare_in(Declared::Axis(&mut axis)) {
                axis.effects.push(effect.clone());
            }
        }
        axis
    }
}
