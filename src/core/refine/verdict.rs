//! What closing the loop found.

use serde::Serialize;

use crate::effects::{Effect, EffectKind, MachineKind};
use crate::model_file::Model;
use crate::record::{HealthFinding, Severity};
use crate::report::Document;

use super::closed_loop::ClosedLoop;
use super::explorer::Explorer;
use super::next_experiment::NextExperiment;

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
    /// 95 % interval, by blocks of the rows; none where there was no asking for it.
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

/// How far a model's motion runs away from the log's over a short time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// What is predicted, named as a log's column.
    pub variable: &'static str,
    /// Length of the prediction, s.
    pub horizon_s: f64,
    /// Root mean square of the error at its end.
    pub rmse: Quantity,
    /// Root mean square of the motion itself over that time.
    pub motion: Quantity,
    /// What noise of the readings at the start and at the end makes of it.
    pub noise_floor: Quantity,
    /// Whether the error tells anything: a machine that is unstable by itself grows noise of the readings at the start
    /// beyond the motion.
    pub told: bool,
}

/// How far a model is from a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean square of the equation error.
    pub rmse: Channels,
    /// Noise floor of the residual: from its own spectrum, of what is left where it is known, so that it is no lower with
    /// worse rows. `residual` has that of the declared model on all rows, `refine` that of the refined one.
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
    /// 95 % interval of that, by blocks of the held-out rows; none where it was not worked out.
    pub error_drop_ci95: Option<[f64; 2]>,
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
    /// What it depends on, the strongest first: `motor_angle_rad`, `motor_speed_rad_s`, `time_s` and so on.
    pub depends_on: Vec<String>,
    /// Share of the whitened residual's power that each of them explains, in their order.
    pub shares: Vec<f64>,
    /// In words; empty where nothing is left.
    pub description: String,
}

/// What became of something that was tried.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// It is in the refined model.
    Added,
    /// It does as well as what was added, and this log cannot tell them apart.
    NotToldFrom(&'static EffectKind),
    /// Nothing is left for it beside what was added.
    Explained,
    /// It explains something, and too little for a name.
    TooSmall,
    /// Its size is not surely other than 0.
    NotSure,
    /// The log does not excite it: declared numbers within their tolerances say nearly all that it would.
    NotTestable,
}

impl Fate {
    /// One word for scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::NotToldFrom(_) => "not_told_from",
            Self::Explained => "explained",
            Self::TooSmall => "too_small",
            Self::NotSure => "not_sure",
            Self::NotTestable => "not_testable",
        }
    }
}

impl std::fmt::Display for Fate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Added => f.write_str("added"),
            Self::NotToldFrom(kind) => write!(f, "not told from {}", kind.id),
            Self::Explained => f.write_str("nothing left for it beside what was added"),
            Self::TooSmall => f.write_str("explains too little"),
            Self::NotSure => f.write_str("its size is not sure"),
            Self::NotTestable => f.write_str("this log does not excite it"),
        }
    }
}

/// One thing that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The effect.
    pub kind: &'static EffectKind,
    /// Its shape in words, as `order 14` or `5.0 ms`; may be empty.
    pub detail: String,
    /// By how much the error on left-out blocks is lower with it alone beside the declared model, in percent.
    pub gain_percent: f64,
    /// Standard errors of its size above 0, by the jackknife over blocks.
    pub z: f64,
    /// What became of it.
    pub fate: Fate,
}

impl Tried {
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

impl Serialize for Tried {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("id", self.kind.id)?;
        map.serialize_entry("detail", &self.detail)?;
        map.serialize_entry("gain_percent", &self.gain_percent)?;
        // A size that a single moment shows has no standard error.
        if self.z.is_finite() {
            map.serialize_entry("z", &self.z)?;
        }
        map.serialize_entry("fate", self.fate.name())?;
        if let Fate::NotToldFrom(kind) = self.fate {
            map.serialize_entry("not_told_from", kind.id)?;
        }
        map.end()
    }
}

/// An effect that the model declares already, on these logs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Carried {
    /// Its id.
    pub id: &'static str,
    /// By how much the error on held-out rows is lower with it, the declared numbers estimated anew with it and without,
    /// in percent of the error without it.
    pub error_drop_percent: f64,
    /// 95 % interval of that, by blocks of the held-out rows; none where these are too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_drop_ci95: Option<[f64; 2]>,
    /// Where each log's angle counts from, by the effect, rad; fitted logs first.
    pub zeros_rad: Vec<f64>,
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
    /// What was tried, best first.
    pub candidates: Vec<Tried>,
    /// The refined model as the plant under the controllers of before and after, and what becomes of each effect; without
    /// runs for an axis and a robot without weights, none where nothing was found.
    pub closed_loop: Option<ClosedLoop>,
    /// What to record next, where it would tell more.
    pub next_experiment: Option<NextExperiment>,
    /// What is wrong with the logs.
    pub data_health: Vec<HealthFinding>,
    /// Effects that the model declares already.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub carried: Vec<Carried>,
    /// Declared numbers as this log has them.
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
    /// The answer where the logs cannot tell: what to do about the gravest finding is the next thing to do.
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
                .map(|finding| NextExperiment::in_words(finding.mend.clone())),
            data_health,
            carried: Vec::new(),
            parameters: Vec::new(),
            model: model.clone(),
            explorer: Explorer::default(),
            document: Document::default(),
        }
    }
}
