//! The refined model as the plant: what the controller of before and the one made from the refined model do with it.

use serde::Serialize;

use crate::effects::EffectKind;

/// Runs of the simulated robot with the refined model as the plant: the controller of before and the one made from the
/// refined model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClosedLoop {
    /// One for each scenario.
    pub scenarios: Vec<LoopPair>,
    /// What becomes of each effect in the controller.
    pub feedforward: Vec<Fed>,
}

/// One scenario under both controllers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoopPair {
    /// Name as of `flqr simulate --scenario`.
    pub scenario: String,
    /// Under the controller of the declared model.
    pub before: LoopRun,
    /// Under that of the refined model.
    pub after: LoopRun,
}

/// How a run went, from the truth of the simulation once it has stood up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopRun {
    /// Displacement, m; about its target where it drives.
    pub x_m: Spread,
    /// Speed, m/s.
    pub x_dot_m_s: Spread,
    /// Pitch, rad.
    pub pitch_rad: Spread,
    /// A periodic motion that keeps itself up; none where the robot comes to rest, or only noise moves it.
    pub limit_cycle: Option<LimitCycle>,
    /// Whether it fell.
    pub fell: bool,
}

/// How far a quantity wanders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
    /// Largest less smallest value.
    pub peak_to_peak: f64,
}

/// A periodic motion of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LimitCycle {
    /// Half of the peak to peak of x at its frequency, m.
    pub amplitude_m: f64,
    /// Its frequency, Hz.
    pub frequency_hz: f64,
}

/// What becomes of an effect in the controller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fed {
    /// Id of the effect.
    #[serde(serialize_with = "id")]
    pub effect: &'static EffectKind,
    /// Whether the controller cancels it.
    pub used: bool,
    /// Why, or why not.
    pub reason: String,
}

fn id<S: serde::Serializer>(kind: &&'static EffectKind, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(kind.id)
}
