//! Motors with their wheels in the air, put through a program under speed control.

use super::speed::{SpeedPi, SpeedPiState};
use crate::excitation::{Multisine, SpeedSweep, Step, multisines};
use crate::friction::Stribeck;
use crate::model::TICK_S;

/// Task of the motors.
#[derive(Clone, Debug, PartialEq)]
pub enum SpeedProgram {
    /// A step of the target speed.
    Step(Step),
    /// Constant speeds.
    Sweep(SpeedSweep),
    /// Torques on top of the speed control's.
    Torques([Multisine; 2]),
}

impl SpeedProgram {
    /// A multisine that moves a shaft: 40 rad/s² of its inertia, and more than the friction of either.
    pub fn multisine(inertia_kg_m2: f64, friction: &[Option<Stribeck>; 2]) -> Self {
        let level = |curve: &Option<Stribeck>| curve.map_or(0.0, |curve| curve.parameters().static_nm);
        let friction_nm = friction.iter().map(level).fold(0.0, f64::max);
        Self::Torques(multisines(40.0 * inertia_kg_m2 + 1.5 * friction_nm))
    }

    fn target_rad_s(&self, time_s: f64) -> f64 {
        match self {
            Self::Step(step) => step.at(time_s),
            Self::Sweep(sweep) => sweep.at(time_s),
            Self::Torques(_) => 0.0,
        }
    }

    fn added_nm(&self, motor: usize, time_s: f64) -> f64 {
        if let Self::Torques(motors) = self { motors[motor].at(time_s) } else { 0.0 }
    }
}

/// Both motors' speed control and its program.
#[derive(Clone, Debug)]
pub struct SpeedRun {
    control: [SpeedPi; 2],
    memory: [SpeedPiState; 2],
    program: SpeedProgram,
}

impl SpeedRun {
    /// From rest.
    pub fn new(control: [SpeedPi; 2], program: SpeedProgram) -> Self {
        Self { control, memory: [SpeedPiState::default(); 2], program }
    }

    /// Speed that both motors are to have at a time, rad/s.
    pub fn target_rad_s(&self, time_s: f64) -> f64 {
        self.program.target_rad_s(time_s)
    }

    /// Torques of one tick at a time since the start, N m, from the measured speeds.
    pub fn step(&mut self, time_s: f64, motor_speed_rad_s: [f64; 2]) -> [f64; 2] {
        let target = self.target_rad_s(time_s);
        std::array::from_fn(|motor| {
            let control = &self.control[motor];
            let asked = control.step(&mut self.memory[motor], target, motor_speed_rad_s[motor], TICK_S);
            let added = self.program.added_nm(motor, time_s);
            let limit = control.torque_limit_nm.max(0.0);
            if added == 0.0 { asked } else { (asked + added).clamp(-limit, limit) }
        })
    }
}
