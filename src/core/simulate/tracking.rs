//! Step response of the motor speed (Figures 6, 7).

use serde::Serialize;

use crate::excitation::Step;
use crate::record::BenchSample;

/// Length of the end of a run over which the steady error is averaged, s; a tenth of shorter runs.
const STEADY_S: f64 = 1.0;

/// Numbers of one step response, from the measured speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepResponse {
    /// From the first time at 10 % of the step to the first time at 90 %, s, between samples along a straight
    /// line; `None` if the speed never gets there.
    pub rise_time_s: Option<f64>,
    /// Farthest measured speed beyond the target, rad/s; sensor noise included.
    pub overshoot_rad_s: f64,
    /// Mean of target − speed over the last second (the last tenth of shorter runs), rad/s.
    pub steady_error_rad_s: f64,
}

impl StepResponse {
    /// The response of a motor (0 left, 1 right) in samples that are not empty.
    pub(super) fn of(samples: &[BenchSample], motor: usize, step: &Step) -> Self {
        let height = step.after - step.before;
        // From 0 to 1, whichever way the step goes.
        let risen = |sample: &BenchSample| (sample.motor_speed_rad_s[motor] - step.before) / height;
        let after = &samples[samples.partition_point(|sample| sample.time_s < step.start_s)..];
        let reaches = |share: f64| {
            let index = after.iter().position(|sample| risen(sample) >= share)?;
            let Some(before) = index.checked_sub(1).map(|index| &after[index]) else {
                return Some(after[index].time_s);
            };
            let (low, high) = (risen(before), risen(&after[index]));
            let between = (share - low) / (high - low);
            Some(before.time_s + between * (after[index].time_s - before.time_s))
        };
        let rise_time_s = reaches(0.1).zip(reaches(0.9)).map(|(start, end)| end - start);
        let farthest = after.iter().map(risen).fold(0.0, f64::max);
        let end_s = after.last().map_or(0.0, |sample| sample.time_s);
        let window = STEADY_S.min(0.1 * end_s);
        let steady = &after[after.partition_point(|sample| sample.time_s < end_s - window)..];
        let errors = steady.iter().map(|sample| step.after - sample.motor_speed_rad_s[motor]);
        Self {
            rise_time_s,
            overshoot_rad_s: (farthest - 1.0).max(0.0) * height.abs(),
            steady_error_rad_s: errors.sum::<f64>() / steady.len().max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 (1 − e^(−t/τ)) has a rise time of τ ln 9; backward it is the same.
    #[test]
    fn exponential_approach_has_its_textbook_numbers() {
        let tau = 0.2;
        for (sign, overshoot) in [(1.0, 0.0), (-1.0, 0.7)] {
            let step = Step { start_s: 0.0, before: 0.0, after: sign * 10.0 };
            let samples: Vec<BenchSample> = (0..5000)
                .map(|tick| {
                    let time_s = f64::from(tick) * 1e-3;
                    let bump = if tick == 3000 { overshoot } else { 0.0 };
                    let speed = sign * (10.0 * (1.0 - f64::exp(-time_s / tau)) + bump);
                    let pair = [0.0, speed];
                    BenchSample {
                        time_s,
                        motor_angle_rad: pair,
                        motor_speed_rad_s: pair,
                        torque_nm: pair,
                        target_speed_rad_s: sign * 10.0,
                    }
                })
                .collect();
            let found = StepResponse::of(&samples, 1, &step);
            assert!((found.rise_time_s.unwrap() / (tau * 9.0_f64.ln()) - 1.0).abs() < 1e-4);
            assert!(
                (found.overshoot_rad_s - overshoot).abs() < 1e-4 && found.steady_error_rad_s.abs() < 1e-6
            );
            let still = StepResponse::of(&samples, 0, &step);
            assert_eq!((still.rise_time_s, still.overshoot_rad_s), (None, 0.0));
            assert!((still.steady_error_rad_s - sign * 10.0).abs() < 1e-12);
        }
    }
}
