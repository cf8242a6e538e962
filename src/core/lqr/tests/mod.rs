//! Tests of the room against independent answers.

mod care;
mod carex;
mod design;
mod margins;
mod placement;
mod running;

use nalgebra::DMatrix;

use super::double_double::DoubleDouble;
use super::real::Real;

/// ‖P − P_ref‖_F / ‖P_ref‖_F with a reference of more digits than a double.
fn relative_error(p: &DMatrix<f64>, reference: impl Fn(usize, usize) -> DoubleDouble) -> f64 {
    let (mut squares, mut norm) = (0.0, 0.0);
    for i in 0..p.nrows() {
        for j in 0..p.ncols() {
            let expected = reference(i, j);
            squares += (DoubleDouble::from(p[(i, j)]) - expected).to_f64().powi(2);
            norm += expected.to_f64().powi(2);
        }
    }
    (squares / norm).sqrt()
}

/// A decimal number to 32 digits.
fn decimal(text: &str) -> DoubleDouble {
    let (digits, exponent) = text.split_once('e').unwrap_or((text, "0"));
    let mut exponent: i32 = exponent.parse().unwrap();
    let mut value = DoubleDouble::ZERO;
    let mut fraction = false;
    for digit in digits.trim_start_matches('-').chars() {
        if digit == '.' {
            fraction = true;
            continue;
        }
        value = value * DoubleDouble::from(10.0) + DoubleDouble::from(f64::from(digit.to_digit(10).unwrap()));
        exponent -= i32::from(fraction);
    }
    let ten = (0..exponent.abs()).fold(DoubleDouble::ONE, |power, _| power * DoubleDouble::from(10.0));
    let size = if exponent < 0 { value / ten } else { value * ten };
    if digits.starts_with('-') { -size } else { size }
}
