//! Means of a residual over a variable, with bands, for every page that shows one.

/// Width of the band about a mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Band {
    /// Twice the standard error of the mean, as if the rows were independent.
    #[default]
    Error,
    /// Interquartile range of the rows.
    Quartiles,
}

/// Mean of neighbouring rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// Mean of the variable.
    pub x: f64,
    /// Mean of the other values.
    pub mean: f64,
    /// Lower end of the band about the mean.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
}

/// Fewest rows in a bin.
const LEAST_ROWS: usize = 8;

/// Computes bins of equal numbers of rows, at most `most`, in rising order of the variable. Rows that are not finite are left
/// out; rows of the same value of the variable may stand in several bins.
pub fn binned(x: &[f64], y: &[f64], most: usize, band: Band) -> Vec<Bin> {
    let pairs = x.iter().zip(y).map(|(x, y)| [*x, *y]);
    let mut pairs: Vec<[f64; 2]> = pairs.filter(|pair| pair.iter().all(|value| value.is_finite())).collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let count = (pairs.len() / LEAST_ROWS).clamp(1, most.max(1));
    let ends = |index: usize| index * pairs.len() / count;
    let bins = (0..count).map(|index| &pairs[ends(index)..ends(index + 1)]);
    bins.filter(|rows| !rows.is_empty()).map(|rows| bin(rows, band)).collect()
}

fn bin(rows: &[[f64; 2]], band: Band) -> Bin {
    let count = rows.len() as f64;
    let mean = |of: usize| rows.iter().map(|row| row[of]).sum::<f64>() / count;
    let (x, mean_y) = (mean(0), mean(1));
    let [low, high] = match band {
        Band::Error => {
            let squares: f64 = rows.iter().map(|row| (row[1] - mean_y).powi(2)).sum();
            let reach = 2.0 * (squares / (count - 1.0).max(1.0) / count).sqrt();
            [mean_y - reach, mean_y + reach]
        }
        Band::Quartiles => {
            let mut values: Vec<f64> = rows.iter().map(|row| row[1]).collect();
            values.sort_by(f64::total_cmp);
            [0.25, 0.75].map(|share| values[(share * (count - 1.0)).round() as usize])
        }
    };
    Bin { x, mean: mean_y, low, high }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_bands_are_those_of_the_rows() {
        // Two values of the variable, at each of them 0, 1, … 8.
        let x: Vec<f64> = (0..18).map(|i| f64::from(i % 2)).collect();
        let y: Vec<f64> = (0..18).map(|i| f64::from(i / 2) + f64::from(i % 2) * 100.0).collect();
        let bins = binned(&x, &y, 2, Band::Quartiles);
        assert_eq!(bins[0], Bin { x: 0.0, mean: 4.0, low: 2.0, high: 6.0 });
        assert_eq!(bins[1], Bin { x: 1.0, mean: 104.0, low: 102.0, high: 106.0 });
        // Variance of 0 to 8 is 7.5.
        let error = binned(&x, &y, 2, Band::Error)[0];
        assert!((error.high - 4.0 - 2.0 * (7.5_f64 / 9.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_nothing_gives_nothing() {
        assert!(binned(&[], &[], 10, Band::Error).is_empty());
        assert!(binned(&[f64::NAN, 1.0], &[1.0, f64::INFINITY], 10, Band::Quartiles).is_empty());
        let one = binned(&[1.0, f64::NAN], &[2.0, 2.0], 10, Band::Error);
        assert_eq!(one, [Bin { x: 1.0, mean: 2.0, low: 2.0, high: 2.0 }]);
    }
}
