//! What the motors are requested once armed.

use super::exchange::DriveError;
use super::handover::Handover;
use super::stage::Excitation;
use crate::control::{
    BalanceController, Measurement, Reference, SpeedGains, SpeedPi, SpeedProgram, SpeedRun,
};
use crate::excitation::{BALANCE_MULTISINE_NM, Multisine, SpeedSweep, multisines};
use crate::model::RobotModel;

/// Time for which the robot balances before torques are put on top, s.
const SETTLE_S: f64 = 3.0;

/// The program of a drive.
#[derive(Clone, Debug)]
pub(super) enum Program {
    /// On the ground.
    Balance { controller: Box<Handover>, added: Option<[Multisine; 2]>, torque_limit_nm: f64 },
    /// Wheels in the air, s in all; as it starts, and when sampled.
    Air { fresh: Box<SpeedRun>, running: Box<SpeedRun>, seconds: f64 },
}

impl Program {
    pub(super) fn new(
        robot: &RobotModel,
        controller: BalanceController,
        excitation: Excitation,
        torque_limit_nm: f64,
    ) -> Result<Self, DriveError> {
        let inertia = robot.parameters.wheel_inertia_kg_m2;
        let balance =
            |added| Self::Balance { controller: Box::new(Handover::new(controller)), added, torque_limit_nm };
        match excitation {
            Excitation::Balance => Ok(balance(None)),
            Excitation::BalanceMultisine => Ok(balance(Some(multisines(BALANCE_MULTISINE_NM)))),
            Excitation::SpeedSweep { seconds } => {
                let least = SpeedSweep::least_seconds();
                let sweep = SpeedSweep::new(seconds).ok_or(DriveError::SweepTooShort { seconds, least })?;
                let seconds = sweep.duration_s();
                let program = SpeedProgram::Sweep(sweep);
                Ok(Self::air(program, SpeedGains::firm(inertia), torque_limit_nm, seconds))
            }
            Excitation::Multisine { seconds } => {
                let program = SpeedProgram::multisine(inertia, &robot.friction);
                Ok(Self::air(program, SpeedGains::loose(inertia), torque_limit_nm, seconds))
            }
        }
    }

    fn air(program: SpeedProgram, gains: SpeedGains, torque_limit_nm: f64, seconds: f64) -> Self {
        let control = SpeedPi {
            proportional_nm_s_rad: gains.kp,
            integral_nm_rad: gains.ki,
            feedforward: None,
            torque_limit_nm,
        };
        let run = Box::new(SpeedRun::new([control; 2], program));
        Self::Air { fresh: run.clone(), running: run, seconds }
    }

    /// Begins anew.
    pub(super) fn start(&mut self) {
        match self {
            Self::Balance { controller, .. } => controller.finish(),
            Self::Air { fresh, running, .. } => running.clone_from(fresh),
        }
    }

    pub(super) fn balances(&self) -> bool {
        matches!(self, Self::Balance { .. })
    }

    /// Whether it has come to its end.
    pub(super) fn is_done(&self, time_s: f64) -> bool {
        matches!(self, Self::Air { seconds, .. } if time_s >= *seconds)
    }

    /// Speed that wheels in the air are to have, rad/s.
    pub(super) fn target_rad_s(&self, time_s: f64) -> Option<f64> {
        if let Self::Air { running, .. } = self { Some(running.target_rad_s(time_s)) } else { None }
    }

    /// Torques at a time since arming, N m, within the limit.
    pub(super) fn step(&mut self, time_s: f64, measurement: &Measurement, reference: &Reference) -> [f64; 2] {
        match self {
            Self::Air { running, .. } => running.step(time_s, measurement.motor_speed_rad_s),
            Self::Balance { controller, added, torque_limit_nm } => {
                let mut torque = controller.step(measurement, reference);
                if let Some(motors) = added
                    && time_s >= SETTLE_S
                {
                    for (torque, multisine) in torque.iter_mut().zip(motors) {
                        *torque += multisine.at(time_s - SETTLE_S);
                    }
                }
                torque.map(|nm| nm.clamp(-*torque_limit_nm, *torque_limit_nm))
            }
        }
    }
}
