//! Inertia and friction of one axis from any motion.
//!
//! The model is linear in its main parameters (J inertia or mass, v speed):
//!
//! effort = J·v̇ + f_v·v + f(v)·sign(v) + f_p + G·sin(angle)
//!
//! with f(v) = f_c, or f_c + (f_s − f_c)·exp(−(|v|/v_s)^ξ) (Eq. 28) where the model has the Stribeck three or
//! they are requested. G is the load of a pendulum (rotary axes, angle 0 hanging down).
//!
//! # Procedure
//! The inverse dynamic identification of M. Gautier and A. Janot, as published with the EMPS benchmark, with
//! every number taken from the log's own rate and noise:
//! 1. Logs are split at gaps and put on uniform time. A gap is longer than one cut-off period and than three
//!    samples.
//! 2. The position passes a zero-phase Butterworth filter of order 4 at the cut-off and is differentiated by
//!    central differences. The cut-off is 100 Hz or a quarter of the sample rate, whichever is lower; it is
//!    lowered by up to 16 times until noise of the position makes at most 0.1 % of the acceleration's variance.
//! 3. Each column of the equation and the effort pass the same zero-phase Chebyshev filter (order 8, 0.8 of
//!    the rows' Nyquist frequency); one row for each cut-off period is kept, without 20 periods (at most 5 %)
//!    at each end.
//! 4. Rows within the filter's reach of a rest are left out, as sticking friction takes any value there. A
//!    rest is a speed near 0 for longer than the filter resolves; a passage through 0 is none.
//! 5. Least squares; where speed or exponent of the Stribeck curve are free, a search over these two with the
//!    others solved for at each point.
//! 6. 95 % intervals by leaving out one block of neighbouring rows after another, so that they hold under
//!    coloured residuals. They do not cover errors of the model itself or of the torque's scale.
//!
//! A parameter that the motion does not excite is fixed at the model's value, or left out without a model, and
//! a warning says so.

pub mod kinematics;
mod problem;
mod regression;
mod stribeck_search;

use std::ops::ControlFlow;

use serde::Serialize;

use crate::friction::StribeckParameters;
use crate::model::{AxisModel, AxisParameters};
use crate::record::{Log, LogError, LogKind};
use problem::Problem;

/// Which way an axis moves; it decides columns, units and names of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// A shaft: `motor_angle_rad`, `torque_nm`.
    Rotary,
    /// A carriage: `position_m`, `force_n`.
    Linear,
}

/// Place of a parameter in [`Axis::keys`].
pub(crate) mod place {
    pub(crate) const INERTIA: usize = 0;
    pub(crate) const VISCOUS: usize = 1;
    pub(crate) const COULOMB: usize = 2;
    pub(crate) const OFFSET: usize = 3;
    pub(crate) const STATIC: usize = 4;
    pub(crate) const GRAVITY: usize = 5;
    pub(crate) const STRIBECK_SPEED: usize = 6;
    pub(crate) const STRIBECK_EXPONENT: usize = 7;
    /// Parameters in which the model is linear; they come first.
    pub(crate) const LINEAR: usize = 6;
    pub(crate) const ALL: usize = 8;
}

impl Axis {
    /// Names of the parameters as in the model file. A linear axis has no gravity load.
    pub fn keys(self) -> [&'static str; 8] {
        match self {
            Self::Rotary => [
                "inertia_kg_m2",
                "viscous_nm_s_rad",
                "coulomb_nm",
                "offset_nm",
                "static_nm",
                "gravity_torque_nm",
                "stribeck_speed_rad_s",
                "stribeck_exponent",
            ],
            Self::Linear => [
                "mass_kg",
                "viscous_n_s_m",
                "coulomb_n",
                "offset_n",
                "static_n",
                "",
                "stribeck_speed_m_s",
                "stribeck_exponent",
            ],
        }
    }

    /// Unit of the effort.
    pub fn effort_unit(self) -> &'static str {
        match self {
            Self::Rotary => "N m",
            Self::Linear => "N",
        }
    }

    fn log_kind(self) -> LogKind {
        match self {
            Self::Rotary => LogKind::Bench,
            Self::Linear => LogKind::LinearAxis,
        }
    }

    /// Names of the columns of position and effort.
    fn columns(self) -> (&'static str, &'static str) {
        match self {
            Self::Rotary => ("motor_angle_rad", "torque_nm"),
            Self::Linear => ("position_m", "force_n"),
        }
    }
}

/// Model of the axis; parameters that are not estimated keep these values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownAxis {
    /// Inertia, kg m², or mass, kg.
    pub inertia: f64,
    /// Friction, for a linear axis in N, N s/m and m/s; none is no friction.
    pub friction: Option<StribeckParameters>,
    /// Load = this × sin(angle), N m; 0 on a linear axis.
    pub gravity_torque_nm: f64,
}

impl From<&AxisModel> for KnownAxis {
    fn from(model: &AxisModel) -> Self {
        let (inertia, gravity_torque_nm, friction) = match model.parameters {
            AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction } => {
                (inertia_kg_m2, gravity_torque_nm, friction)
            }
            AxisParameters::Linear { mass_kg, friction } => (mass_kg, 0.0, friction),
        };
        Self { inertia, friction: friction.map(|curve| *curve.parameters()), gravity_torque_nm }
    }
}

/// One parameter of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MotionParameter {
    /// Name as in the model file.
    pub key: &'static str,
    /// Value in the unit of the name.
    pub value: f64,
    /// 95 % interval; none for a held value, or where the log is too short for one.
    pub ci95: Option<[f64; 2]>,
    /// True if the value is the model's and not an estimate.
    pub held: bool,
}

/// Data of a fit from motion, row by row, log after log: to see where it does not.
///
/// All of it has passed the filters of the fit; rows near a rest are left out, as they were of the fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionSeries {
    /// Time in the log, s; where it runs back, the next log begins.
    pub time_s: Vec<f64>,
    /// Speed, rad/s or m/s.
    pub speed: Vec<f64>,
    /// Measured torque or force, N m or N.
    pub measured: Vec<f64>,
    /// Prediction of the fitted model; `rmse` is that of the differences.
    pub fitted: Vec<f64>,
}

/// Result of [`fit_motion`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionFit {
    /// Estimated and held parameters.
    pub parameters: Vec<MotionParameter>,
    /// Root mean square of what the filtered effort has beyond the model, in `rmse_unit`.
    pub rmse: f64,
    /// N m or N.
    pub rmse_unit: &'static str,
    /// ‖residual‖ / ‖effort‖ over the rows.
    pub relative_error: f64,
    /// Rows of the regression.
    pub rows: usize,
    /// The rows themselves.
    pub series: MotionSeries,
    /// Cut-off of the position filter for each log, Hz.
    pub cutoff_hz: Vec<f64>,
    /// Condition number of the scaled columns: near 1 independent, above 100 hard to distinguish.
    pub condition_number: f64,
    /// Warnings on the reliability of the values.
    pub warnings: Vec<String>,
}

impl MotionFit {
    /// A parameter by its name.
    pub fn parameter(&self, key: &str) -> Option<&MotionParameter> {
        self.parameters.iter().find(|parameter| parameter.key == key)
    }
}

/// Reason why a motion could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A log lacks a column.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No log was given.
    #[error("there is no log to fit: name at least one")]
    NoLog,
    /// A name that is not a parameter of this axis.
    #[error("`{name}` is not a parameter of this axis: estimate all or some of {allowed}")]
    UnknownParameter {
        /// The name.
        name: String,
        /// The names that are allowed.
        allowed: String,
    },
    /// Position that does not change.
    #[error("{file}: column `{column}` is constant: record the axis while it moves")]
    NoMotion {
        /// The log.
        file: String,
        /// Column of the position.
        column: &'static str,
    },
    /// Torque or force that does not change.
    #[error(
        "{file}: column `{column}` is constant and carries no information on mass and friction: record the actual torque or force"
    )]
    NoEffort {
        /// The log.
        file: String,
        /// Column of the torque or force.
        column: &'static str,
    },
    /// Too few rows are left.
    #[error(
        "{files}: {rows} rows in motion remain after filtering at {cutoff_hz:.3} Hz, but {needed} are needed: \
         record a longer motion or at a higher rate"
    )]
    TooShort {
        /// The logs.
        files: String,
        /// Rows that are left.
        rows: usize,
        /// Rows that are needed.
        needed: usize,
        /// Cut-off of the position filter, Hz.
        cutoff_hz: f64,
    },
    /// No parameter is excited.
    #[error(
        "{files}: none of the parameters to estimate affects this motion: record one with changing speed"
    )]
    NothingExcited {
        /// The logs.
        files: String,
    },
    /// Noise of the speed hides the slow motion that shows the Stribeck curve.
    #[error(
        "{files}: the position is too noisy to identify the Stribeck curve: record a faster motion or a finer position, \
         or estimate without static_nm, stribeck_speed_rad_s and stribeck_exponent"
    )]
    StribeckHidden {
        /// The logs.
        files: String,
    },
    /// The caller said stop.
    #[error("the fit was cancelled")]
    Cancelled,
}

/// Estimates inertia or mass and friction from one or more logs of the same axis.
///
/// `estimate` names parameters as in the model file; `all`, or nothing, stands for inertia or mass, viscous,
/// Coulomb and offset. The Stribeck three and the gravity load are free only when named. Without `known` the
/// four are always estimated, and naming one of the Stribeck three frees all three.
///
/// `watch` is told the fraction of the work that is done.
///
/// # Errors
/// See [`MotionError`].
pub fn fit_motion(
    logs: &[Log],
    axis: Axis,
    known: Option<&KnownAxis>,
    estimate: &[String],
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<MotionFit, MotionError> {
    let free = free_parameters(axis, known, estimate)?;
    Problem::new(logs, axis, known, free, watch)?.solve(watch)
}

/// Which parameters are estimated.
fn free_parameters(
    axis: Axis,
    known: Option<&KnownAxis>,
    estimate: &[String],
) -> Result<[bool; place::ALL], MotionError> {
    let keys = axis.keys();
    let mut free = [false; place::ALL];
    for name in estimate.iter().filter(|name| *name != "all") {
        let Some(index) = keys.iter().position(|key| key == name).filter(|_| !name.is_empty()) else {
            let allowed = keys.iter().filter(|key| !key.is_empty()).copied().collect::<Vec<_>>().join(", ");
            return Err(MotionError::UnknownParameter { name: name.clone(), allowed });
        };
        free[index] = true;
    }
    if known.is_none() || estimate.is_empty() || estimate.iter().any(|name| name == "all") {
        free[..=place::OFFSET].fill(true);
    }
    let stribeck = [place::STATIC, place::STRIBECK_SPEED, place::STRIBECK_EXPONENT];
    if known.is_none_or(|known| known.friction.is_none()) && stribeck.iter().any(|&index| free[index]) {
        stribeck.iter().for_each(|&index| free[index] = true);
    }
    Ok(free)
}

#[cfg(test)]
#[path = "motion/tests.rs"]
mod tests;
