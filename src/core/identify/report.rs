//! Result of a fit and its reliability.

use std::collections::BTreeMap;

use serde::Serialize;

use super::FrictionPair;
use super::motion::MotionSeries;
use super::parameters::KEYS;
use crate::friction::StribeckParameters;
use crate::record::HealthFinding;

/// A parameter with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Unit in the parameter's key.
    pub value: f64,
    /// 95 % interval; `None` if the method gives none or the parameter was not fitted.
    pub ci95: Option<[f64; 2]>,
}

/// Reason why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// All iterations were done, of the swarm alone or of the polish short of the optimum.
    MaxIterations,
    /// The error stayed below the threshold.
    ErrorThreshold,
    /// The optimum was reached.
    Converged,
}

/// Result of [`super::fit`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitReport {
    /// Keys as in the model file.
    pub parameters: BTreeMap<&'static str, Estimate>,
    /// Root of the mean of squared errors (Eq. 32), unit in `rmse_unit`.
    pub rmse: f64,
    /// `N m` or `N`.
    pub rmse_unit: &'static str,
    /// ‖residual‖ / ‖torque or force‖, without unit.
    pub relative_error: f64,
    /// The pairs of section 3.1; empty for fits from motion.
    pub pairs: Vec<FrictionPair>,
    /// Measured against fitted; none of a fit of pairs.
    pub series: Option<MotionSeries>,
    /// Iterations of the swarm; 0 for fits from motion, which have none.
    pub iterations: usize,
    /// Best error after each of the `iterations`, unit as `rmse`.
    pub history: Vec<f64>,
    /// Problems of the logs.
    pub data_health: Vec<HealthFinding>,
    /// Warnings on the reliability of the parameters.
    pub warnings: Vec<String>,
    /// Reason why the search ended.
    pub stop: StopReason,
}

impl FitReport {
    /// The Stribeck curve, where all six parameters were fitted.
    pub fn stribeck(&self) -> Option<StribeckParameters> {
        let mut point = [0.0; 6];
        for (value, key) in point.iter_mut().zip(KEYS) {
            *value = self.parameters.get(key)?.value;
        }
        Some(super::parameters::named(&point))
    }
}
