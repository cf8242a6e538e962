//! A robot that balances by itself: what a listener hears.

use crate::control::{BalanceController, Measurement, Reference};
use crate::link::{Frame, MotorOrder, Wheels};
use crate::model::{LinkSettings, State};
use crate::record::Readings;

/// Ticks from one query of the motors' health to the next.
const HEALTH_TICKS: u64 = 100;
/// Pitch within which it begins to balance, rad.
const UPRIGHT_RAD: f64 = 0.02;

/// The robot's own controller, on its own bus.
#[derive(Debug)]
pub(super) struct OnBoard {
    controller: BalanceController,
    wheels: Wheels,
    tilt_rad: f64,
    /// Measurements since the last tick: one tick on the wire, as for any other controller on the bus.
    known: Measurement,
    /// Position setpoint, if it balances.
    target: Option<Reference>,
}

impl OnBoard {
    pub(super) fn new(controller: BalanceController, wiring: &LinkSettings, tilt_rad: f64) -> Self {
        let (wheels, known) = (Wheels::new(wiring), Measurement::default());
        Self { controller, wheels, tilt_rad, known, target: None }
    }

    /// Returns the frames sent at a tick.
    pub(super) fn frames(&mut self, tick: u64, readings: &Readings, held: bool) -> Vec<Frame> {
        let mut orders = Vec::new();
        if tick.is_multiple_of(HEALTH_TICKS) {
            orders.push(MotorOrder::ReadHealth);
        }
        orders.push(self.order(held));
        self.known = self.controller.odometry.measurement(readings);
        orders.iter().flat_map(|order| self.wheels.frames(order)).collect()
    }

    fn order(&mut self, held: bool) -> MotorOrder {
        let pitch_rad = self.known.state.pitch_rad;
        match self.target {
            Some(target) if pitch_rad.abs() <= self.tilt_rad => {
                MotorOrder::Torque(self.controller.step(&self.known, &target))
            }
            Some(_) => {
                self.target = None;
                MotorOrder::Off
            }
            None if held && pitch_rad.abs() < UPRIGHT_RAD => {
                let state = State { x_m: self.known.state.x_m, ..State::default() };
                self.target = Some(Reference { state, yaw_rad: self.known.yaw_rad });
                MotorOrder::On
            }
            None => MotorOrder::ReadState,
        }
    }
}
