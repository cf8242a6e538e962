//! LQR and FLQR (Eqs. 13, 29).

use std::sync::Arc;

use nalgebra::{Matrix2x4, Vector2};

use super::odometry::{Measurement, Odometry};
use super::yaw::default_yaw_hold;
use crate::ParameterError;
use crate::effects::{EffectFeedforward, Machine, MotionSample};
use crate::friction::{Compensation, Feedforward};
use crate::model::{Motor, RobotModel, State, YawHold};

/// Compensation of models that give friction but no `[compensation]`: a little less than the whole curve,
/// so that a curve that was identified 10 % too high does not drive the robot by itself, and a direction
/// that turns over about one step of a motor speed read in 1 deg/s steps.
pub const DEFAULT_COMPENSATION: Compensation = Compensation { ratio: 0.9, smoothing_speed_rad_s: 0.02 };

/// Which controller is made from a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerKind {
    /// u = −K X.
    Lqr,
    /// u = −K X + τ_f(q̇), friction and known effects inside the motors fed forward per motor.
    Flqr,
}

/// X̃ (Eq. 26): where the robot is to be, and which way it is to head.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// State to track.
    pub state: State,
    /// Heading to keep, left positive, rad.
    pub yaw_rad: f64,
}

/// State feedback with yaw hold, optional friction feedforward and a torque limit.
#[derive(Clone, Debug, PartialEq)]
pub struct BalanceController {
    /// K, 2×4: rows left and right motor, columns N m/m, N m s/m, N m/rad, N m s/rad.
    pub gain: Matrix2x4<f64>,
    /// Friction feedforward of the left and the right motor; none in plain LQR and where a motor has no
    /// known friction.
    pub feedforward: [Option<Feedforward>; 2],
    /// Feedforward of the model's effects inside the motors; none in plain LQR and of models without any.
    pub effects: Option<Arc<EffectFeedforward>>,
    /// Largest torque of one motor, N m; infinite if unlimited.
    pub torque_limit_nm: f64,
    /// Heading control.
    pub yaw_hold: YawHold,
    /// Computation of a measurement from sensor readings.
    pub odometry: Odometry,
}

/// Reason why a controller cannot be created from a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControlError {
    /// FLQR without anything to feed forward.
    #[error(
        "flqr needs the friction of at least one motor: add [friction.left] and [friction.right], or use lqr"
    )]
    NoFriction,
    /// A gain that is infinite or not a number.
    #[error("gain of motor {motor}, state {state} is {value}: it must be a finite number")]
    Gain {
        /// `left` or `right`.
        motor: &'static str,
        /// `x`, `x_dot`, `pitch` or `pitch_rate`.
        state: &'static str,
        /// The refused gain.
        value: f64,
    },
    /// A parameter of the compensation that is out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

impl BalanceController {
    /// The controller of `kind` for a robot with the given gain; friction, compensation (or
    /// [`DEFAULT_COMPENSATION`]), yaw hold (or [`default_yaw_hold`]) and torque limit come from the model.
    pub fn new(kind: ControllerKind, robot: &RobotModel, gain: Matrix2x4<f64>) -> Result<Self, ControlError> {
        check_gain(&gain)?;
        let robot = &robot.with_effects_declared();
        let (feedforward, effects) = match kind {
            ControllerKind::Lqr => ([None; 2], None),
            ControllerKind::Flqr => feedforward(robot)?,
        };
        Ok(Self {
            gain,
            feedforward,
            effects,
            torque_limit_nm: robot.limits.torque_nm.unwrap_or(f64::INFINITY),
            yaw_hold: robot.yaw_hold.unwrap_or_else(|| default_yaw_hold(&robot.parameters, &robot.chassis)),
            odometry: Odometry::new(robot),
        })
    }

    /// Torques of the left and the right motor, N m: K (X̃ − X) (Eq. 26) plus the yaw hold, in equal and opposite
    /// shares, plus the feedforward at each motor's speed (Eq. 29) and what makes up for the effects inside the
    /// motor, within the limit; 0 where a measurement is not a number, so that a sensor that failed cannot drive the
    /// robot.
    ///
    /// The yaw hold follows the difference of the wheels alone, so that it is the same at any speed, and the
    /// balance their mean alone, so that neither disturbs the other.
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// # let linear = robot.parameters.linear_model();
    /// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
    /// # use flqr_core::control::{BalanceController, ControllerKind};
    /// use flqr_core::control::{Measurement, Reference};
    /// use flqr_core::model::State;
    ///
    /// let controller = BalanceController::new(ControllerKind::Lqr, robot, gain)?;
    /// let state = State { pitch_rad: 0.01, ..State::default() };
    /// let [left, right] = controller.step(&Measurement { state, ..Measurement::default() }, &Reference::default());
    /// assert!(left > 0.0 && left == right); // The wheels drive under the body, which tilts forward.
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn step(&self, measurement: &Measurement, reference: &Reference) -> [f64; 2] {
        let error = reference.state.to_vector() - measurement.state.to_vector();
        let feedback: Vector2<f64> = self.gain * error;
        let turning = self.yaw_hold.stiffness_nm_rad * (reference.yaw_rad - measurement.yaw_rad)
            - self.yaw_hold.damping_nm_s_rad * measurement.yaw_rate_rad_s;
        // A limit below zero or not a number switches the motors off.
        let limit = self.torque_limit_nm.max(0.0);
        std::array::from_fn(|motor| {
            let friction = self.feedforward[motor]
                .map_or(0.0, |feedforward| feedforward.torque_nm(measurement.motor_speed_rad_s[motor]));
            let torque = feedback[motor] + [-turning, turning][motor] + friction;
            let torque = self.with_effects(motor, measurement, torque);
            if torque.is_finite() { torque.clamp(-limit, limit) } else { 0.0 }
        })
    }
}

impl BalanceController {
    /// Returns whether it feeds effects forward that depend on the rotors' own angles.
    pub fn needs_rotor_angle(&self) -> bool {
        let effects = self.effects.iter().flat_map(|effects| effects.effects());
        effects.into_iter().any(|effect| effect.kind().by_angle())
    }

    /// Returns it without the effects that depend on the rotor angle, for motors whose angles are relative to
    /// elsewhere.
    pub fn without_rotor_angle(self) -> Self {
        let effects = self.effects.as_ref().and_then(|effects| effects.without_rotor_angle());
        Self { effects: effects.map(Arc::new), ..self }
    }

    /// Returns the command that gives a torque, N m.
    fn with_effects(&self, motor: usize, measurement: &Measurement, torque_nm: f64) -> f64 {
        let Some(effects) = &self.effects else { return torque_nm };
        let moment = MotionSample {
            motor_angle_rad: measurement.motor_angle_rad[motor],
            motor_speed_rad_s: measurement.motor_speed_rad_s[motor],
            ..MotionSample::default()
        };
        effects.asked_nm(Motor::BOTH[motor], &moment, torque_nm)
    }
}

fn check_gain(gain: &Matrix2x4<f64>) -> Result<(), ControlError> {
    for (row, motor) in ["left", "right"].into_iter().enumerate() {
        for (column, state) in ["x", "x_dot", "pitch", "pitch_rate"].into_iter().enumerate() {
            let value = gain[(row, column)];
            if !value.is_finite() {
                return Err(ControlError::Gain { motor, state, value });
            }
        }
    }
    Ok(())
}

/// Feedforward of friction and effects of both motors.
type Fed = ([Option<Feedforward>; 2], Option<Arc<EffectFeedforward>>);

fn feedforward(robot: &RobotModel) -> Result<Fed, ControlError> {
    let compensation = robot.compensation.unwrap_or(DEFAULT_COMPENSATION);
    compensation.validate()?;
    let effects = EffectFeedforward::new(&Machine::robot(robot), &robot.effects, compensation);
    if robot.friction.iter().all(Option::is_none) && effects.is_none() {
        return Err(ControlError::NoFriction);
    }
    let mut motors = [None; 2];
    for (motor, curve) in motors.iter_mut().zip(robot.friction) {
        *motor = curve.map(|curve| Feedforward::new(curve, compensation)).transpose()?;
    }
    Ok((motors, effects.map(Arc::new)))
}
