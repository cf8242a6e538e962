//! What stands between a finding and its being offered: predictions must not get worse, and no declared number may be off
//! by a factor that no machine of this kind is.

use crate::effects::{EffectKind, Place, Role};
use crate::model::{MachineKind, Model, Motor};
use crate::record::{HealthFinding, Severity};

use super::verdict::{Found, Prediction, Refinement};
use super::without;

/// Ratio of the errors after and before, in the mean of what is informative, from which on predictions are worse.
const WORSE: f64 = 1.2;
/// Multiple of the noise floor that an error must have for its change to be the model's: an unstable machine makes more
/// of the start's noise than of the model's errors.
const INFORMATIVE: f64 = 3.0;
/// Effects whose state at the start of a prediction no log has.
const UNKNOWN_AT_START: [&str; 1] = ["presliding"];
/// Fractions of itself that a declared number may be off by, lower and higher, before the log is another machine's.
const OFF_BY: [f64; 2] = [-0.75, 4.0];

/// How much worse informative predictions are: the geometric mean of the ratios of their errors.
pub(super) fn worsening(before: &[Prediction], after: &[Prediction]) -> f64 {
    let same = |own: &&Prediction, other: &Prediction| {
        own.variable == other.variable && own.horizon_s == other.horizon_s
    };
    let ratio = |own: &Prediction| {
        let then = before.iter().find(|other| same(&own, other)).filter(|then| then.informative)?;
        let (now, before) = (own.rmse.value, then.rmse.value);
        (now.max(before) > INFORMATIVE * then.noise_floor.value).then(|| libm::log(now / before))
    };
    let ratios: Vec<f64> = after.iter().filter_map(ratio).collect();
    libm::exp(ratios.iter().sum::<f64>() / ratios.len().max(1) as f64)
}

/// The effect without which predictions are best, if predictions are worse with it than without it, and with all of them
/// worse than before: numbers that are estimated anew change them too.
pub(super) fn culprit(
    found: &Refinement,
    motor: Option<Motor>,
    predict: impl Fn(&Model) -> Vec<Prediction>,
) -> Option<&'static EffectKind> {
    let is_unknown = |effect: &Found| UNKNOWN_AT_START.contains(&effect.effect.id());
    if found.effects.is_empty() || found.effects.iter().any(is_unknown) {
        return None;
    }
    if worsening(&found.before.prediction, &found.after.prediction) < WORSE {
        return None;
    }
    let without = |effect: &Found| {
        let model = without(found.model.clone(), &effect.effect, motor);
        (worsening(&predict(&model), &found.after.prediction), effect.effect.kind())
    };
    let worst = found.effects.iter().map(without).max_by(|a, b| a.0.total_cmp(&b.0));
    worst.filter(|(worsening, _)| *worsening >= WORSE).map(|(_, kind)| kind)
}

/// An effect of which the log does not determine a size or time that cannot be 0: its interval holds 0.
pub(super) fn unsure(found: &Refinement) -> Option<&'static EffectKind> {
    let holds_zero = |effect: &&Found| {
        let parameters = effect.effect.kind().parameters.iter().cycle();
        parameters.zip(&effect.ci95).any(|(parameter, interval)| {
            let is_positive = parameter.role == Role::Shape
                && (parameter.sized || parameter.range(MachineKind::Rotary)[0] > 0.0);
            is_positive && interval.is_some_and(|[low, high]| low <= 0.0 && 0.0 <= high)
        })
    };
    found.effects.iter().find(holds_zero).map(|effect| effect.effect.kind())
}

/// The finding that an effect would make a declared number impossible.
pub(super) fn implausible(
    found: &Refinement,
    declared: impl Fn(&Found) -> Option<f64>,
) -> Option<HealthFinding> {
    let off = |effect: &Found| {
        let of_number = effect.effect.kind().place == Place::Parameter;
        let size = *effect.effect.values(Role::Amplitude).first()?;
        let fraction = size / declared(effect).filter(|_| of_number)?;
        let [low, high] = OFF_BY;
        (!(low..=high).contains(&fraction)).then_some((effect.effect.id(), fraction))
    };
    let (id, fraction) = found.effects.iter().find_map(off)?;
    Some(HealthFinding {
        severity: Severity::Error,
        column: String::new(),
        problem: format!(
            "{id} of {:+.0} % would be needed: the model is of another machine, or a column is not what its name says",
            100.0 * fraction
        ),
        remedy: "check the model file, the units and the timing of each column".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::verdict::Quantity;

    fn prediction(variable: &'static str, error: f64, noise_floor: f64) -> Prediction {
        let [rmse, motion, noise_floor] = [error, 10.0, noise_floor].map(|value| Quantity::new(value, "rad"));
        Prediction { variable, horizon_s: 0.2, rmse, motion, noise_floor, informative: true }
    }

    #[test]
    fn only_predictions_above_their_noise_count() {
        let before = [prediction("pitch_rad", 0.1, 0.01), prediction("x_m", 1.0, 1.0)];
        let after = [prediction("pitch_rad", 0.3, 0.01), prediction("x_m", 0.2, 1.0)];
        assert!((worsening(&before, &after) - 3.0).abs() < 1e-9);
        assert!((worsening(&after, &before) - 1.0 / 3.0).abs() < 1e-9);
        assert_eq!(worsening(&before[1..], &after[1..]), 1.0);
    }
}
