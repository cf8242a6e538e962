//! Results of a refinement.

use serde::Serialize;

use crate::effects::EffectKind;
use crate::model::{Effect, MachineKind, Model};
use crate::record::{HealthFinding, Severity};
use crate::report::Document;

use super::closed_loop::ClosedLoop;
use super::explorer::Explorer;
use super::next_experiment::NextExperiment;

/// Verdict of a refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The declared model explains the log as well as any effect of the library would.
    ModelAdequate,
    /// Effects were found; `unexplained` says whether structure remains.
    EffectsFound,
    /// The model lacks something that no effect of the library explains.
    UnexplainedResidual,
    /// The log is not suitable for identification; see `data_health`.
    DataUnfit,
}

/// A number with its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// In `unit`.
    pub value: f64,
    /// As text.
    pub unit: &'static str,
    /// 95 % interval, by blocks of the rows; `None` if not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
}

impl Quantity {
    /// A number without an interval.
    pub fn new(value: f64, unit: &'static str) -> Self {
        Self { value, unit, ci95: None }
    }
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

/// Error of a short prediction of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Predicted signal, named as a log column.
    pub variable: &'static str,
    /// Length of the prediction, s.
    pub horizon_s: f64,
    /// Root mean square of the error at its end.
    pub rmse: Quantity,
    /// Root mean square of the motion itself over that time.
    pub motion: Quantity,
    /// Error due to measurement noise at the start and the end.
    pub noise_floor: Quantity,
    /// True if the error exceeds the amplified noise: an unstable machine amplifies measurement noise at the
    /// start beyond the motion.
    pub informative: bool,
}

/// Errors of a model on a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean square of the equation error.
    pub rmse: Channels,
    /// Noise floor of the residual: from its own spectrum, of what is left where it is known, so that it is no lower
    /// with worse rows. `residual` has that of the declared model on all rows, `refine` that of the refined one.
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
    /// Name of the test.
    pub name: String,
    /// The statistic.
    pub value: f64,
    /// Above it, the residual has structure.
    pub threshold: f64,
    /// True if it has.
    pub structure: bool,
}

/// Result of [`super::residual`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Residual {
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
    /// Dependence of the residual on variables.
    pub tests: Vec<Test>,
    /// Problems of the logs.
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
    /// Reduction of the error on held-out rows, in percent of the error without it.
    pub error_drop_percent: f64,
    /// 95 % interval of the reduction, from blocks of the held-out rows; `None` if not computed.
    pub error_drop_ci95: Option<[f64; 2]>,
    /// Effects that this log cannot distinguish from it.
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
        if let Some(ci95) = self.error_drop_ci95 {
            map.serialize_entry("error_drop_ci95", &ci95)?;
        }
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
    /// Variables it depends on, the strongest first: `motor_angle_rad`, `motor_speed_rad_s`, `time_s` and so on.
    pub depends_on: Vec<String>,
    /// Fraction of the whitened residual's power explained by each of them, in the same order.
    pub fractions: Vec<f64>,
    /// Description; empty without remaining structure.
    pub description: String,
}

/// Outcome of a candidate.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It is in the refined model.
    Added,
    /// It explains the log as well as an added effect and cannot be distinguished from it.
    Ambiguous(&'static EffectKind),
    /// Explained by the effects that were added.
    Explained,
    /// Its contribution is too small.
    TooSmall,
    /// Its size is not significantly different from 0.
    NotSignificant,
    /// The log does not excite it: declared parameters within their tolerances explain nearly the same.
    NotTestable,
}

impl Outcome {
    /// Returns its name for scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Ambiguous(_) => "ambiguous",
            Self::Explained => "explained",
            Self::TooSmall => "too_small",
            Self::NotSignificant => "not_significant",
            Self::NotTestable => "not_testable",
        }
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Added => f.write_str("added"),
            Self::Ambiguous(kind) => write!(f, "cannot be distinguished from {}", kind.id),
            Self::Explained => f.write_str("explained by the effects that were added"),
            Self::TooSmall => f.write_str("effect too small"),
            Self::NotSignificant => f.write_str("not significant"),
            Self::NotTestable => f.write_str("not excited by this log"),
        }
    }
}

/// Candidate effect with its score.
#[derive(Clone, Debug, PartialEq)]
pub struct ScoredCandidate {
    /// The effect.
    pub kind: &'static EffectKind,
    /// Description of its shape, such as `order 14` or `5.0 ms`; may be empty.
    pub detail: String,
    /// Error reduction on left-out blocks with this effect alone, in percent.
    pub gain_percent: f64,
    /// Standard errors of its size above 0, by the jackknife over blocks.
    pub z: f64,
    /// Outcome.
    pub outcome: Outcome,
}

impl ScoredCandidate {
    /// Shape parameters in words: as many as are given, of a kind that comes as a series over and over.
    pub(super) fn detail_of(kind: &EffectKind, shape: &[f64], machine: MachineKind) -> String {
        let one = |(value, unit): (&f64, &str)| match unit {
            "1/turn" => format!("order {value:.0}"),
            "s" if *value < 0.1 => format!("{:.1} ms", 1e3 * value),
            unit => format!("{value:.3} {unit}"),
        };
        let units: Vec<&str> = kind.shapes().map(|parameter| parameter.unit(machine)).collect();
        shape.iter().zip(units.iter().copied().cycle()).map(one).collect::<Vec<_>>().join(", ")
    }
}

impl Serialize for ScoredCandidate {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("id", self.kind.id)?;
        map.serialize_entry("detail", &self.detail)?;
        map.serialize_entry("gain_percent", &self.gain_percent)?;
        // A size estimated from a single instant has no standard error.
        if self.z.is_finite() {
            map.serialize_entry("z", &self.z)?;
        }
        map.serialize_entry("outcome", self.outcome.name())?;
        if let Outcome::Ambiguous(kind) = self.outcome {
            map.serialize_entry("ambiguous_with", kind.id)?;
        }
        map.end()
    }
}

/// Transfer check of a declared effect on new logs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Transfer {
    /// Its id.
    pub id: &'static str,
    /// By how much the error on held-out rows is lower with it, the declared numbers estimated anew with it and
    /// without, in percent of the error without it.
    pub error_drop_percent: f64,
    /// 95 % interval of that, by blocks of the held-out rows; `None` if there are too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_drop_ci95: Option<[f64; 2]>,
    /// Encoder offset of each log, estimated from the effect, rad; fitted logs first.
    pub encoder_offsets_rad: Vec<f64>,
}

/// Declared parameter that was estimated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Corrected {
    /// Key as in the model file.
    pub key: &'static str,
    /// As declared.
    pub declared: f64,
    /// As estimated.
    pub value: f64,
    /// 95 % interval, from the bound inward if the number is at one; `None` if the log does not determine the number.
    pub ci95: Option<[f64; 2]>,
    /// By how much the declared number may be off; `None` if it is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Whether the log alone determines the number to better than half of its tolerance.
    pub determined: bool,
    /// Whether the estimate is at the end of the tolerance, which makes the tolerance or the model doubtful.
    pub at_bound: bool,
}

/// Result of [`super::refine`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refinement {
    /// The answer.
    pub verdict: Verdict,
    /// Missing effects, in order of significance.
    pub effects: Vec<Found>,
    /// Errors of the declared model on the held-out rows, its parameters estimated within their tolerances.
    pub before: Errors,
    /// Errors with the effects.
    pub after: Errors,
    /// Remaining structure.
    pub unexplained: Unexplained,
    /// Candidates, best first.
    pub candidates: Vec<ScoredCandidate>,
    /// The refined model as the plant under the controllers of before and after, and what becomes of each effect;
    /// without runs for an axis and a robot without weights, `None` if nothing was found.
    pub closed_loop: Option<ClosedLoop>,
    /// Next experiment, where it would tell more.
    pub next_experiment: Option<NextExperiment>,
    /// Problems of the logs.
    pub data_health: Vec<HealthFinding>,
    /// Effects that the model declares already.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub transfer: Vec<Transfer>,
    /// Declared parameters estimated from this log.
    pub parameters: Vec<Corrected>,
    /// The model with all of it.
    #[serde(skip)]
    pub model: Model,
    /// The residual row by row.
    #[serde(skip)]
    pub explorer: Explorer,
    /// Tables and figures.
    #[serde(skip)]
    pub document: Document,
}

impl Refinement {
    /// Creates the result for unsuitable logs: the next step is the remedy of the most severe finding.
    pub(super) fn unfit(model: &Model, data_health: Vec<HealthFinding>) -> Self {
        let worst = data_health.iter().find(|finding| finding.severity == Severity::Error);
        Self {
            verdict: Verdict::DataUnfit,
            effects: Vec::new(),
            before: Errors::default(),
            after: Errors::default(),
            unexplained: Unexplained::default(),
            candidates: Vec::new(),
            closed_loop: None,
            next_experiment: worst
                .or(data_health.first())
                .map(|finding| NextExperiment::in_words(finding.remedy.clone())),
            data_health,
            transfer: Vec::new(),
            parameters: Vec::new(),
            model: model.clone(),
            explorer: Explorer::default(),
            document: Document::default(),
        }
    }
}
