//! Controllers handed over between two ticks without a bump.

use crate::control::{BalanceController, Measurement, Reference};

/// Ticks over which new gains fade in: 0.2 s, long compared with the slew of a motor and short compared with the time
/// in which a robot drives off.
pub(super) const HANDOVER_TICKS: u32 = 200;

/// The controller in charge, and how far it has taken over.
///
/// Both controllers see the same measurement; the fraction of the new one grows from 0 to 1 along a straight line.
/// Unlike a difference that is kept and faded out, the mean of both answers a push during the handover. A controller
/// that comes meanwhile waits for its end; of several the last one counts.
#[derive(Clone, Debug)]
pub(super) struct Handover {
    current: BalanceController,
    /// The controller before, and the ticks since it began to hand over.
    before: Option<(BalanceController, u32)>,
    waiting: Option<BalanceController>,
}

impl Handover {
    pub(super) fn new(controller: BalanceController) -> Self {
        Self { current: controller, before: None, waiting: None }
    }

    /// Gives a new controller the parts that hold from connection to disconnection: torque limit, yaw hold and
    /// odometry.
    pub(super) fn complete(&self, new: BalanceController) -> BalanceController {
        let BalanceController { torque_limit_nm, yaw_hold, odometry, .. } = self.current;
        BalanceController { torque_limit_nm, yaw_hold, odometry, ..new.without_rotor_angle() }
    }

    /// Another controller from the next tick on.
    pub(super) fn hand_over(&mut self, controller: BalanceController) {
        if self.before.is_some() {
            self.waiting = Some(controller);
        } else {
            self.before = Some((std::mem::replace(&mut self.current, controller), 0));
        }
    }

    /// The last controller that was given, at once, for motors that are off.
    pub(super) fn finish(&mut self) {
        if let Some(last) = self.waiting.take() {
            self.current = last;
        }
        self.before = None;
    }

    /// Torques of one tick, N m.
    pub(super) fn step(&mut self, measurement: &Measurement, reference: &Reference) -> [f64; 2] {
        let new = self.current.step(measurement, reference);
        let Some((before, ticks)) = &mut self.before else { return new };
        let share = f64::from(*ticks) / f64::from(HANDOVER_TICKS);
        let old = before.step(measurement, reference);
        *ticks += 1;
        if *ticks > HANDOVER_TICKS {
            self.before = None;
            if let Some(next) = self.waiting.take() {
                self.hand_over(next);
            }
        }
        [0, 1].map(|motor: usize| old[motor] + share * (new[motor] - old[motor]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::ControllerKind;
    use crate::model::State;
    use crate::model_file::presets;
    use nalgebra::Matrix2x4;

    /// The torque at a pitch of 0.1 rad goes in a straight line from the old gain's to the new one's, within 0.2 s.
    #[test]
    fn new_gains_fade_in_over_a_fifth_of_a_second() {
        let robot = presets::paper().robot().unwrap().clone();
        let made = |pitch_gain| {
            let gain = Matrix2x4::from_fn(|_, column| if column == 2 { pitch_gain } else { 0.0 });
            BalanceController::new(ControllerKind::Lqr, &robot, gain).unwrap()
        };
        let state = State { pitch_rad: 0.1, ..State::default() };
        let measurement = Measurement { state, ..Measurement::default() };
        let mut handover = Handover::new(made(-5.0));
        handover.hand_over(made(-9.0));
        for tick in 0..400 {
            let [torque, _] = handover.step(&measurement, &Reference::default());
            let expected = 0.5 + 0.4 * (f64::from(tick) / 200.0).min(1.0);
            assert!((torque - expected).abs() < 1e-12, "{torque} for {expected} at {tick} ms");
        }
    }
}
