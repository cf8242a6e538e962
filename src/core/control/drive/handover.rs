//! Controllers handed over between two ticks without a bump.

use crate::control::{BalanceController, Measurement, Reference};

/// Ticks over which the torque goes over from the old controller's to the new one's: 0.25 s, slow beside the slew of
/// a motor and fast beside the way of a robot.
pub(super) const HANDOVER_TICKS: u32 = 250;

/// The controller in charge, and how far it has taken over.
///
/// Both controllers see the same measurement; the share of the new one grows from 0 to 1 along a straight line.
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
