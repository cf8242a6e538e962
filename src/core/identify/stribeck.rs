//! The six parameters from pairs: swarm, polish, intervals, warnings.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use super::identifiability::{distinct_speeds, fit_warnings, pair_warnings};
use super::intervals::confidence;
use super::parameters::{KEYS, Point, VISCOUS, named};
use super::polish::{Fit, polish};
use super::samples::Samples;
use super::{
    Bounds, Estimate, FitError, FitOptions, FitProgress, FitReport, FrictionPair, Method, Pso, PsoSettings,
    SearchBox, StopReason,
};
use crate::friction::StribeckParameters;

/// Six parameters need six speeds.
const NEEDED_SPEEDS: usize = 6;
/// No motor is faster, rad/s, or has more friction, N m.
const LARGEST: f64 = 1e6;

/// Fits Eq. 28 to pairs; `source` names them in messages.
///
/// # Errors
/// Pairs that are not finite or beyond 1e6 rad/s or N m, fewer than six distinct speeds, equal torques, or a `watch` that breaks.
///
/// ```
/// # use flqr_core::friction::{Stribeck, StribeckParameters};
/// # use flqr_core::identify::FrictionPair;
/// # let truth = StribeckParameters {
/// #     coulomb_nm: 0.2, static_nm: 0.3, viscous_nm_s_rad: 0.01, stribeck_speed_rad_s: 1.0, stribeck_exponent: 1.0, offset_nm: 0.0,
/// # };
/// # let curve = Stribeck::new(truth)?;
/// # let speeds = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0].into_iter().flat_map(|speed| [speed, -speed]);
/// let pairs: Vec<FrictionPair> = speeds
///     .map(|speed_rad_s| FrictionPair { speed_rad_s, torque_nm: curve.torque_nm(speed_rad_s) })
///     .collect();
/// use flqr_core::identify::{FitOptions, fit_pairs};
///
/// let options = FitOptions::default();
/// let fit = fit_pairs(&pairs, "pairs.csv", &options, &mut |_| std::ops::ControlFlow::Continue(()))?;
/// assert!((fit.parameters["coulomb_nm"].value - 0.2).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit_pairs(
    pairs: &[FrictionPair],
    source: &str,
    options: &FitOptions,
    watch: &mut dyn FnMut(&FitProgress) -> ControlFlow<()>,
) -> Result<FitReport, FitError> {
    check(pairs, source)?;
    let range = match options.bounds {
        Bounds::Data => SearchBox::from_pairs(pairs),
        Bounds::Paper => SearchBox::paper(),
    };
    let samples = Samples::new(pairs);
    let mut swarm = Pso::new(pairs, range, PsoSettings::default(), options.seed);
    let history = run(&mut swarm, watch)?;
    let point = *swarm.best_point();
    let swarm_fit = Fit { point, sum: samples.sum_of_squares(&point), converged: false };
    let mut warnings = pair_warnings(pairs, &range);
    let (fit, intervals) = match options.method {
        Method::Pso => {
            warnings.push(
                "PSO alone gives no confidence intervals, because its result is not an optimum: use the method `best`"
                    .to_owned(),
            );
            warnings.extend(fit_warnings(&swarm_fit.point, &range, options.bounds, None));
            (swarm_fit, [None; 6])
        }
        Method::Best => {
            let fit = polish(&samples, &range, Some(&swarm_fit.point));
            let confidence = confidence(&samples, &range, &fit);
            warnings.extend(fit_warnings(&fit.point, &range, options.bounds, Some(&confidence)));
            (fit, confidence.intervals)
        }
    };
    let stop = match options.method {
        Method::Best if fit.converged => StopReason::Converged,
        Method::Pso if swarm.reached_threshold() => StopReason::ErrorThreshold,
        Method::Best | Method::Pso => StopReason::MaxIterations,
    };
    if options.method == Method::Best && !fit.converged {
        warnings.push(
            "the local refinement reached its step limit before the optimum: the data barely distinguish the curves around \
             it, record more speeds"
                .to_owned(),
        );
    }
    warnings.extend(failed_bounds(&samples, pairs, &fit, options.bounds));
    let torque_square: f64 = pairs.iter().map(|p| p.torque_nm * p.torque_nm).sum();
    Ok(FitReport {
        parameters: estimates(&fit.point, &intervals),
        rmse: samples.rmse(fit.sum),
        rmse_unit: "N m",
        relative_error: (fit.sum / torque_square).sqrt(),
        pairs: pairs.to_vec(),
        series: None,
        iterations: history.len(),
        history,
        data_health: Vec::new(),
        warnings,
        stop,
    })
}

/// The optimum of Eq. 28 over pairs within a box, without the swarm: a coarse grid over v_s and ξ, then variable
/// projection. Returns the parameters and the RMSE in N m; none where there are no pairs.
///
/// ```
/// # use flqr_core::friction::{Stribeck, StribeckParameters};
/// # use flqr_core::identify::FrictionPair;
/// # let truth = StribeckParameters {
/// #     coulomb_nm: 0.2, static_nm: 0.3, viscous_nm_s_rad: 0.01, stribeck_speed_rad_s: 1.0, stribeck_exponent: 1.0, offset_nm: 0.0,
/// # };
/// # let curve = Stribeck::new(truth)?;
/// # let speeds = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0].into_iter().flat_map(|speed| [speed, -speed]);
/// let pairs: Vec<FrictionPair> = speeds
///     .map(|speed_rad_s| FrictionPair { speed_rad_s, torque_nm: curve.torque_nm(speed_rad_s) })
///     .collect();
/// use flqr_core::identify::{SearchBox, polish_pairs};
///
/// let (parameters, error_nm) = polish_pairs(&pairs, &SearchBox::from_pairs(&pairs)).ok_or("no pairs")?;
/// assert!((parameters.static_nm - 0.3).abs() < 1e-3 && error_nm < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn polish_pairs(pairs: &[FrictionPair], range: &SearchBox) -> Option<(StribeckParameters, f64)> {
    let samples = Samples::new(pairs);
    (samples.len() > 0).then(|| {
        let fit = polish(&samples, range, None);
        (named(&fit.point), samples.rmse(fit.sum))
    })
}

fn run(
    swarm: &mut Pso,
    watch: &mut dyn FnMut(&FitProgress) -> ControlFlow<()>,
) -> Result<Vec<f64>, FitError> {
    let iterations = PsoSettings::default().iterations;
    let mut history = Vec::with_capacity(iterations);
    for step in swarm {
        history.push(step.best_error_nm);
        let progress = FitProgress {
            iteration: step.iteration,
            iterations,
            best_error: step.best_error_nm,
            best: Some(step.best),
        };
        if watch(&progress).is_break() {
            return Err(FitError::Cancelled { iteration: step.iteration, iterations });
        }
    }
    Ok(history)
}

fn check(pairs: &[FrictionPair], source: &str) -> Result<(), FitError> {
    let file = source.to_owned();
    for (i, pair) in pairs.iter().enumerate() {
        for (column, value) in [("speed_rad_s", pair.speed_rad_s), ("torque_nm", pair.torque_nm)] {
            if !value.is_finite() {
                return Err(FitError::NotFinite { file, row: i + 1, column, value });
            }
            if value.abs() > LARGEST {
                return Err(FitError::Impossible { file, row: i + 1, column, value, limit: LARGEST });
            }
        }
    }
    let needed = NEEDED_SPEEDS;
    match distinct_speeds(pairs.iter().map(|p| p.speed_rad_s)) {
        0 => return Err(FitError::TooFewSpeeds { file, found: 0, needed }),
        1 => {
            let speed_rad_s = pairs.iter().map(|p| p.speed_rad_s).sum::<f64>() / pairs.len() as f64;
            return Err(FitError::OneSpeed { file, pairs: pairs.len(), speed_rad_s, needed });
        }
        found if found < needed => return Err(FitError::TooFewSpeeds { file, found, needed }),
        _ => {}
    }
    let value = pairs[0].torque_nm;
    if pairs.iter().all(|p| p.torque_nm == value) {
        return Err(FitError::ConstantTorque { file, value });
    }
    Ok(())
}

/// The paper's bounds compared with those of the data, where they cost accuracy.
fn failed_bounds(samples: &Samples, pairs: &[FrictionPair], fit: &Fit, bounds: Bounds) -> Option<String> {
    if bounds == Bounds::Data {
        return None;
    }
    let free = polish(samples, &SearchBox::from_pairs(pairs), None);
    let (paper, data) = (samples.rmse(fit.sum), samples.rmse(free.sum));
    (paper > 1.01 * data).then(|| {
        format!(
            "the error is {paper:.2e} N m with the paper's bounds and {data:.2e} N m with bounds from the data: Table 3 \
             excludes the optimum, whose `viscous_nm_s_rad` is {:.2e}",
            free.point[VISCOUS]
        )
    })
}

fn estimates(point: &Point, intervals: &[Option<[f64; 2]>; 6]) -> BTreeMap<&'static str, Estimate> {
    (0..6).map(|d| (KEYS[d], Estimate { value: point[d], ci95: intervals[d] })).collect()
}
