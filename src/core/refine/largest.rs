//! Null distribution of the largest of many gains.

use std::f64::consts::PI;

/// The value that a fraction `level` of largest values exceeds, by Gumbel's distribution with their mean and standard
/// deviation; its scale is at least `least_scale`. 0 of fewer than three values, in the unit of the values otherwise.
pub(super) fn exceeded_by(values: &[f64], level: f64, least_scale: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if values.len() < 3 {
        return 0.0;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let scale = ((6.0 * variance).sqrt() / PI).max(least_scale);
    mean - scale * (EULER + libm::log(-libm::log1p(-level)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_largest_values_is_gumbels() {
        // Quantiles of the standard Gumbel distribution, evenly in probability.
        let values: Vec<f64> = (0..4000).map(|i| -(-((f64::from(i) + 0.5) / 4000.0).ln()).ln()).collect();
        let expected = -(-(0.99_f64.ln())).ln();
        assert!((exceeded_by(&values, 0.01, 0.0) - expected).abs() < 0.05);
        assert!(exceeded_by(&values, 0.01, 3.0) > expected + 5.0, "a wider scale reaches further");
        assert_eq!(exceeded_by(&values[..2], 0.01, 0.0), 0.0);
    }
}
