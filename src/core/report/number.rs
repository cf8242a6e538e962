//! Numbers as people read them: a true minus sign, a fixed number of decimals or digits.

/// With that many decimals. What rounds to zero has no sign; what is not finite is a dash.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|c| c == '0' || c == '.') => size.to_owned(),
        Some(size) => format!("−{size}"),
        None => text,
    }
}

/// With that many significant digits, in plain form where that is not longer than eleven digits.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return fixed(value, 0);
    }
    // The exponent after rounding: 0.0999 with two digits is 0.10.
    let power = exponent(value, digits);
    if !(-4..7).contains(&power) {
        return scientific(value, digits);
    }
    fixed(value, usize::try_from(digits as i32 - 1 - power).unwrap_or(0))
}

/// As 1.2·10⁻³ with at most that many significant digits, without trailing zeros.
pub fn scientific(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return fixed(value, 0);
    }
    let text = format!("{value:.*e}", digits.max(1) - 1);
    let (mantissa, power) = text.split_once('e').expect("exponent form has an exponent");
    let short =
        if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    let power = power.parse().expect("an exponent is a whole number");
    format!("{}·{}", short.replace('-', "−"), power_of_ten(power))
}

/// 10 to a power with raised digits.
pub fn power_of_ten(power: i32) -> String {
    match power {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => format!("10{}", power.to_string().chars().map(raised).collect::<String>()),
    }
}

fn exponent(value: f64, digits: usize) -> i32 {
    let text = format!("{value:.*e}", digits.max(1) - 1);
    text.split_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0)
}

fn raised(character: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    character.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, digits, text) in [
            (0.0338, 3, "0.0338"),
            (0.0999, 2, "0.10"),
            (-0.00049, 2, "−0.00049"),
            (12.345, 3, "12.3"),
            (259.6, 3, "260"),
            (2.5e-6, 2, "2.5·10⁻⁶"),
            (f64::NAN, 2, "–"),
            (0.0, 2, "0"),
        ] {
            assert_eq!(significant(value, digits), text);
        }
        assert_eq!(fixed(-0.0004, 2), "0.00");
        assert_eq!(fixed(-1.5, 1), "−1.5");
    }
}
