//! Optimal estimate of a random walk from readings with independent noise.

/// Variance of the noise of each reading, and of the step that a random walk takes between two of them, from their
/// differences: neighbouring ones share a reading, which makes their covariance the noise's alone.
pub(super) fn variances(readings: &[f64]) -> [f64; 2] {
    let steps: Vec<f64> = readings.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let count = steps.len().max(2) as f64;
    let mean = steps.iter().sum::<f64>() / count;
    let variance = steps.iter().map(|step| (step - mean).powi(2)).sum::<f64>() / count;
    let covariance =
        steps.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>() / (count - 1.0);
    let noise = (-covariance).clamp(0.0, 0.5 * variance);
    [noise, variance - 2.0 * noise]
}

/// A random walk with a steady drift behind noisy readings, by the smoother of Rauch, Tung and Striebel; the readings
/// themselves where they show no noise.
pub(super) fn random_walk(readings: &[f64]) -> Vec<f64> {
    let [noise, step] = variances(readings);
    let (Some(&first), Some(&last)) = (readings.first(), readings.last()) else { return Vec::new() };
    if noise <= 0.0 {
        return readings.to_vec();
    }
    let step = step.max(LEAST_STEP * noise);
    let drift = (last - first) / (readings.len() - 1).max(1) as f64;
    let (mut state, mut variance) = (first, noise);
    let mut filtered = vec![(state, variance)];
    for reading in &readings[1..] {
        let ahead = variance + step;
        let gain = ahead / (ahead + noise);
        state += drift;
        state += gain * (reading - state);
        variance = (1.0 - gain) * ahead;
        filtered.push((state, variance));
    }
    let mut smoothed = vec![state; readings.len()];
    for place in (0..readings.len() - 1).rev() {
        let (own, variance) = filtered[place];
        let share = variance / (variance + step);
        smoothed[place] = own + share * (smoothed[place + 1] - own - drift);
    }
    smoothed
}

/// Least step of the walk in units of the noise, so that no more than some hundred readings are averaged.
const LEAST_STEP: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn noise_is_averaged_away_and_the_walk_is_followed() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
        let (mut walk, mut readings, mut at) = (Vec::new(), Vec::new(), 0.0);
        for _ in 0..4000 {
            at += 0.02 * uniform() + 0.001;
            walk.push(at);
            readings.push(at + uniform());
        }
        let [noise, step] = variances(&readings);
        assert!((12.0 * noise - 1.0).abs() < 0.1 && step < 0.01, "{noise} {step}");
        let rms = |values: &[f64]| {
            let sum: f64 = values.iter().zip(&walk).map(|(a, b)| (a - b).powi(2)).sum();
            (sum / 4000.0).sqrt()
        };
        assert!(rms(&random_walk(&readings)) < 0.25 * rms(&readings));
        assert_eq!(random_walk(&walk[..3]).len(), 3);
    }
}
