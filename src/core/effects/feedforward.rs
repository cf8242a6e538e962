//! The torque that cancels the effects inside a motor.

use super::effect::EffectLaw;
use super::law::{Action, Law, MotionSample};
use super::machine::Machine;
use crate::friction::Compensation;
use crate::model::Effect;
use crate::model::Motor;

/// Most secants in which a torque is found that cancels what depends on itself. For effects in proportion to the torque
/// one is enough.
const SECANTS: usize = 6;
/// Error at which it is found, N m.
const FOUND_NM: f64 = 1e-12;

/// Feedforward of the effects inside both motors that can be known from what is measured now.
#[derive(Clone, Debug)]
pub struct EffectFeedforward {
    effects: Vec<Effect>,
    compensation: Compensation,
    motors: [Vec<EffectLaw>; 2],
}

impl PartialEq for EffectFeedforward {
    fn eq(&self, other: &Self) -> bool {
        self.effects == other.effects && self.compensation == other.compensation
    }
}

impl EffectFeedforward {
    /// The feedforward of those effects that are causal and not kept from it; `None` if no effect is. Of dry
    /// friction the compensation's share is fed forward, with its direction smoothed as that of the declared curve.
    pub fn new(machine: &Machine, effects: &[Effect], compensation: Compensation) -> Option<Self> {
        let causal = |effect: &&Effect| effect.is_fed_forward() && effect.kind().per_motor();
        let effects: Vec<Effect> = effects.iter().filter(causal).cloned().collect();
        let laws = |motor| {
            let own = effects.iter().filter(|effect| effect.is_in(motor));
            own.map(|effect| effect.law(machine)).collect()
        };
        let motors = Motor::BOTH.map(laws);
        (!effects.is_empty()).then_some(Self { effects, compensation, motors })
    }

    /// The effects that are fed forward.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// Returns it without the effects that depend on the rotor angle; `None` if none remain.
    pub fn without_rotor_angle(&self) -> Option<Self> {
        let left = |effect: &Effect| !effect.kind().by_angle();
        let [effects_left, all] = [self.effects.iter().filter(|e| left(e)).count(), self.effects.len()];
        if effects_left == all {
            return Some(self.clone());
        }
        let keep = |motor: Motor| {
            let own = self.effects.iter().filter(|effect| effect.is_in(motor));
            let kept = own.zip(&self.motors[motor as usize]).filter(|(effect, _)| left(effect));
            kept.map(|(_, law)| law.clone()).collect()
        };
        let effects = self.effects.iter().filter(|effect| left(effect)).cloned().collect();
        let motors = Motor::BOTH.map(keep);
        (effects_left > 0).then_some(Self { effects, compensation: self.compensation, motors })
    }

    /// The torque to ask of a motor so that `torque_nm` comes out of it, N m. Of the moment angle and speed of the
    /// motor are used.
    pub fn asked_nm(&self, motor: Motor, moment: &MotionSample, torque_nm: f64) -> f64 {
        let laws = &self.motors[motor as usize];
        if laws.is_empty() {
            return torque_nm;
        }
        let smoothed = libm::tanh(moment.motor_speed_rad_s / self.compensation.smoothing_speed_rad_s);
        let direction = self.compensation.ratio * smoothed;
        let excess = |asked: f64| {
            let moment = MotionSample { torque_nm: asked, ..*moment };
            let act = |law: &EffectLaw| law.at(&moment).expect("a causal effect has no memory");
            let sum = laws.iter().fold(Action::default(), |sum, law| sum.plus(1.0, &act(law)));
            asked + sum.on_motor_nm(direction) - torque_nm
        };
        let (mut before, mut excess_before) = (torque_nm, excess(torque_nm));
        let mut asked = torque_nm - excess_before;
        for _ in 0..SECANTS {
            let excess_now = excess(asked);
            // Not a number ends it too.
            if !(excess_now.abs() > FOUND_NM && excess_now != excess_before) {
                break;
            }
            let next = asked - excess_now * (asked - before) / (excess_now - excess_before);
            (before, excess_before, asked) = (asked, excess_now, next);
        }
        if asked.is_finite() { asked } else { torque_nm }
    }
}
