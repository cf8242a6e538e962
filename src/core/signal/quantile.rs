//! The quantile that turns a spread into an interval.

/// Half-width of a two-sided 95 % interval in standard errors: the 97.5 % quantile of Student's t distribution.
///
/// With t = √ν tan θ the density is proportional to cos^(ν−1) θ, which is summed over (0, π/2); relative error below
/// 1e-5. From 1000 degrees of freedom on the first term of the Cornish–Fisher expansion is as good.
///
/// ```
/// use flqr_core::signal::quantile::student_t_975;
///
/// assert!((student_t_975(10) - 2.228).abs() < 1e-3);
/// ```
pub fn student_t_975(degrees_of_freedom: usize) -> f64 {
    const NORMAL: f64 = 1.959_963_984_540_054;
    const PARTS: usize = 4000;
    let freedom = degrees_of_freedom as f64;
    if degrees_of_freedom >= 1000 {
        return NORMAL + (NORMAL.powi(3) + NORMAL) / (4.0 * freedom);
    }
    let width = std::f64::consts::FRAC_PI_2 / PARTS as f64;
    let areas: Vec<f64> = (0..PARTS).map(|i| ((i as f64 + 0.5) * width).cos().powf(freedom - 1.0)).collect();
    let mut remaining = 0.95 * areas.iter().sum::<f64>();
    for (i, area) in areas.iter().enumerate() {
        if *area >= remaining {
            return freedom.sqrt() * ((i as f64 + remaining / area) * width).tan();
        }
        remaining -= area;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::student_t_975;

    /// Printed tables of the t distribution; the long ones from SciPy's `t.ppf(0.975, n)`.
    #[test]
    fn agrees_with_the_printed_table() {
        for (freedom, expected) in [
            (1, 12.706_204_736),
            (2, 4.302_652_730),
            (5, 2.570_581_836),
            (10, 2.228_138_852),
            (30, 2.042_272_456),
            (254, 1.969_347_644),
            (1000, 1.962_339_081),
            (100_000, 1.959_987_708),
        ] {
            let found = student_t_975(freedom);
            assert!((found / expected - 1.0).abs() < 1e-5, "{freedom}: {found}");
        }
    }
}
