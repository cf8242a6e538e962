//! Whether the names that a search gives are wrong: something else explains what they do much better, or they explain
//! little of what is to be explained.

use crate::effects::Signal;
use crate::refine::verdict::Found;

use super::Left;
use super::floor::Floor;
use super::leftover::Variable;

/// Share of the gain of effects above which what is left shows that they are not the right ones.
const MISNAMED: f64 = 0.35;
/// Share of what is left that one variable explains, above which the names are wrong whatever they explain.
const NEARLY_ALL: f64 = 0.8;
/// How many times its floor an error may stay, and the share of what was above the floor that effects then have to explain.
const FAR_OVER_FLOOR: f64 = 1.4;
const LITTLE: f64 = 0.5;
/// The same for the speed, where all effects are functions of the speed.
const STILL_OVER_SPEED: f64 = 0.2;
/// How many times less a function of one variable leaves than effects that are not the right ones.
const BETTER: f64 = 2.5;

/// Whether a smooth function of one variable explains the residual so much better than the effects do that their names
/// are wrong.
pub(super) fn misnamed([before, after]: [&Left; 2], effects: &[Found]) -> bool {
    let [first_error, error] =
        [before, after].map(|left| left.fit.judged.error() / left.fit.blocks.rows() as f64);
    let explained = first_error - error;
    let best =
        before.structure.iter().filter(|found| found.shows()).map(|found| found.gain).fold(0.0, f64::max);
    let shown = || after.structure.iter().filter(|found| found.shows());
    let more = shown().map(|found| found.gain).fold(0.0, f64::max);
    let over_speed = shown().any(|found| found.variable == Variable::Speed && found.gain > STILL_OVER_SPEED);
    let of_speed = |found: &Found| found.effect.kind().trial.signal == Signal::Speed;
    if more > NEARLY_ALL || (over_speed && effects.iter().all(of_speed)) {
        return true;
    }
    let rest = error / first_error;
    (best > 0.3 && rest > BETTER * (1.0 - best)) || more * error > MISNAMED * explained
}

/// Whether effects leave most of what is above the noise floor; errors without and with them.
pub(super) fn little([before, after]: [f64; 2], floor: &Floor) -> bool {
    let explained = before * before - after * after;
    floor.measured
        && after > FAR_OVER_FLOOR * floor.variance.sqrt()
        && explained < LITTLE * (before * before - floor.variance)
}
