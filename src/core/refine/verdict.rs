//! What closing the loop found.

use serde::Serialize;

use crate::effects::{Effect, EffectKind};
use crate::model_file::Model;
use crate::record::HealthFinding;
use crate::report::Document;

/// The answer in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The declared model explains the log as well as any effect of the library would.
    ModelAdequate,
    /// Effects were found; `unexplained` says whether structure remains.
    EffectsFound,
    /// The model lacks something that no effect of the library explains.
    UnexplainedResidual,
    /// The log cannot answer; `data_health` says why.
    DataUnfit,
}

/// A number with its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// In `unit`.
    pub value: f64,
    /// As text.
    pub unit: &'static str,
}

/// One value for each channel, the main one first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channels(pub Vec<(&'static str, Quantity)>);

impl Channels {
    /// Of the main channel.
    pub fn main(&self) -> f64 {
        self.0.first().map_or(f64::NAN, |(_, quantity)| quantity.value)
    }
}

impl Serialize for Channels {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, quantity)| (name, quantity)))
    }
}

/// How far a model's motion runs away from the log's over a short time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Length of the prediction, s.
    pub horizon_s: f64,
    /// Root mean square of the error at its end.
    pub rmse: Quantity,
    /// Root mean square of the motion itself over that time.
    pub motion: Quantity,
}

/// How far a model is from a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean square of the equation error.
    pub rmse: Channels,
    /// What noise of the sensors alone makes of it.
    pub noise_floor: Channels,
    /// `rmse` by the root mean square of the torque or force itself.
    pub nrmse: Channels,
    /// Short predictions from the log's own states, where the machine has them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub prediction: Vec<Prediction>,
}

/// A diagnostic of a residual.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Test {
    /// What was tested.
    pub name: String,
    /// The statistic.
    pub value: f64,
    /// Above it, the residual has structure.
    pub threshold: f64,
    /// Whether it has.
    pub structure: bool,
}

/// Result of [`super::residual`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Residual {
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
    /// What the residual depends on.
    pub tests: Vec<Test>,
    /// What is wrong with the logs.
    pub data_health: Vec<HealthFinding>,
}

/// A parameter of an effect with its interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sized {
    /// In `unit`.
    pub value: f64,
    /// 95 % interval; none for whole numbers and where the log is too short for one.
    pub ci95: Option<[f64; 2]>,
    /// As text.
    pub unit: &'static str,
}

/// An effect that the log shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// With its parameters.
    pub effect: Effect,
    /// 95 % intervals of the parameters in their order.
    pub ci95: Vec<Option<[f64; 2]>>,
    /// Units of the parameters in their order.
    pub units: Vec<&'static str>,
    /// By how much the error on held-out rows falls with it, in percent of the error without it.
    pub error_drop_percent: f64,
    /// Others that this log cannot tell from it.
    pub ambiguous_with: Vec<&'static EffectKind>,
}

impl Serialize for Found {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("id", self.effect.id())?;
        if let Some(motor) = self.effect.motor() {
            map.serialize_entry("motor", &motor.to_string())?;
        }
        map.serialize_entry("parameters", &Parameters(self))?;
        map.serialize_entry("error_drop_percent", &self.error_drop_percent)?;
        let others: Vec<&str> = self.ambiguous_with.iter().map(|kind| kind.id).collect();
        map.serialize_entry("ambiguous_with", &others)?;
        map.end()
    }
}

struct Parameters<'a>(&'a Found);

impl Serialize for Parameters<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Found { effect, ci95, units, .. } = self.0;
        let sized = effect.parameters().iter().zip(ci95).zip(units);
        serializer.collect_map(
            sized.map(|(((key, value), ci95), unit)| (key, Sized { value: *value, ci95: *ci95, unit })),
        )
    }
}

/// Structure that no effect explains.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Unexplained {
    /// What it depends on, the strongest first: `motor_angle_rad`, `motor_speed_rad_s`, `time_s` and so on.
    pub depends_on: Vec<String>,
    /// Share of the whitened residual's power that each of them explains, in their order.
    pub shares: Vec<f64>,
    /// In words; empty where nothing is left.
    pub description: String,
}

/// A declared number that was estimated along.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Corrected {
    /// Key as in the model file.
    pub key: &'static str,
    /// As declared.
    pub declared: f64,
    /// As estimated.
    pub value: f64,
    /// 95 % interval; none where the log is too short for one.
    pub ci95: Option<[f64; 2]>,
}

/// Result of [`super::refine`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refinement {
    /// The answer.
    pub verdict: Verdict,
    /// What the model lacks, in order of evidence.
    pub effects: Vec<Found>,
    /// Errors of the declared model on the held-out rows, its parameters estimated within their tolerances.
    pub before: Errors,
    /// The same with the effects.
    pub after: Errors,
    /// What remains.
    pub unexplained: Unexplained,
    /// What to record next, where it would tell more.
    pub next_experiment: Option<String>,
    /// What is wrong with the logs.
    pub data_health: Vec<HealthFinding>,
    /// Declared numbers as this log has them.
    pub parameters: Vec<Corrected>,
    /// The model with all of it.
    #[serde(skip)]
    pub model: Model,
    /// Tables and figures.
    #[serde(skip)]
    pub document: Document,
}
