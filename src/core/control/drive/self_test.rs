//! What an armed robot shows of itself under small torques: their sign, then their scale.

use super::stage::StopReason;
use super::torque_scale::{TorqueScale, Verdict};
use super::torque_sign::TorqueSign;
use crate::model::RobotModel;
use crate::record::Readings;

/// Both tests, one after the other.
#[derive(Clone, Debug)]
pub(super) struct SelfTest {
    sign: TorqueSign,
    scale: TorqueScale,
}

/// What has come of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Finding {
    /// The robot must not be driven on.
    Stop(StopReason),
    /// It may be.
    Warning(&'static str),
}

impl SelfTest {
    pub(super) fn new(robot: &RobotModel, balancing: bool, torque_limit_nm: f64) -> Self {
        Self {
            sign: TorqueSign::new(robot, balancing, torque_limit_nm),
            scale: TorqueScale::new(robot, balancing, torque_limit_nm),
        }
    }

    /// Time since arming at which nothing is added any more to wheels in the air, s.
    pub(super) fn end_s(&self) -> f64 {
        self.scale.end_s()
    }

    /// What is added to both torques at a time since arming, N m.
    pub(super) fn nudge_nm(&self, time_s: f64) -> [f64; 2] {
        let of_scale = self.scale.nudge_nm(time_s);
        self.sign.nudge_nm(time_s).map(|nm| nm + of_scale)
    }

    /// Takes the readings of a tick, how old the motors' are, and the torques that acted since the last.
    pub(super) fn step(
        &mut self,
        time_s: f64,
        (readings, age_s): (&Readings, f64),
        acted_nm: [f64; 2],
    ) -> Option<Finding> {
        let reversed = self.sign.step(time_s, (readings, age_s), acted_nm).map(Finding::Stop);
        reversed.or_else(|| match self.scale.step(time_s, (readings, age_s), acted_nm)? {
            Verdict::Wrong(reason) => Some(Finding::Stop(reason)),
            Verdict::Unclear => Some(Finding::Warning(
                "the torque scale could not be verified by the self-test: check \
                 torque_constant_nm_a and current_steps_per_a in [link]",
            )),
            Verdict::Right => None,
        })
    }
}
