//! Motors that are switched on or off, until both have said that they are.

use std::time::Duration;

use crate::link::{MotorEvent, MotorOrder};
use crate::model::Motor;

/// Time between two orders of the same kind.
const REPEAT: Duration = Duration::from_millis(5);
/// Longest time for which motors roll out without torque before they are switched off.
const ROLL_OUT: Duration = Duration::from_secs(1);

/// One order, repeated until acknowledged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Switching {
    order: MotorOrder,
    since: Duration,
    next: Duration,
    /// Until when the order waits for motors that roll out without torque.
    waits_until: Duration,
    acknowledged: [bool; 2],
}

impl Switching {
    pub(super) fn on(now: Duration) -> Self {
        Self::new(MotorOrder::On, now)
    }

    pub(super) fn off(now: Duration) -> Self {
        Self::new(MotorOrder::Off, now)
    }

    /// Motors off once they have rolled out.
    pub(super) fn off_after_roll_out(now: Duration) -> Self {
        Self { waits_until: now + ROLL_OUT, ..Self::off(now) }
    }

    fn new(order: MotorOrder, now: Duration) -> Self {
        Self { order, since: now, next: now, waits_until: now, acknowledged: [false; 2] }
    }

    /// The motors need not roll out any longer.
    pub(super) fn has_rolled_out(&mut self) {
        (self.waits_until, self.next) = (self.since, self.since);
    }

    /// Whether the motors roll out.
    pub(super) fn waits(&self, now: Duration) -> bool {
        now < self.waits_until
    }

    /// Takes what the motors have said since the order was first given; health that says so will do as well.
    pub(super) fn hear(&mut self, events: &[MotorEvent]) {
        let wanted = self.order == MotorOrder::On;
        for event in events {
            let (motor, time, done) = match *event {
                MotorEvent::Switched { motor, time, on } => (motor, time, on == wanted),
                MotorEvent::Health(motor, health) => (motor, health.time, health.on == Some(wanted)),
                _ => continue,
            };
            self.acknowledged[motor as usize] |= done && time >= self.since;
        }
    }

    /// The order, where it is time to give it (again).
    pub(super) fn due(&mut self, now: Duration) -> Option<MotorOrder> {
        if self.is_done() || now < self.next {
            return None;
        }
        self.next = now + REPEAT;
        Some(self.order)
    }

    /// Whether both motors have said so.
    pub(super) fn is_done(&self) -> bool {
        self.acknowledged == [true; 2]
    }

    /// A motor that has not answered.
    pub(super) fn missing(&self) -> Option<Motor> {
        Motor::BOTH.into_iter().find(|&motor| !self.acknowledged[motor as usize])
    }

    /// When the order was first given.
    pub(super) fn since(&self) -> Duration {
        self.since
    }
}
