//! Values that were probably given in another unit than their key says.

use std::ops::RangeInclusive;

/// A unit that is mistaken for the SI unit of a key: SI value = `factor` · value + `offset`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnitSlip {
    /// Name in the plural.
    name: &'static str,
    symbol: &'static str,
    factor: f64,
    offset: f64,
}

const fn scaled(name: &'static str, symbol: &'static str, factor: f64) -> UnitSlip {
    UnitSlip { name, symbol, factor, offset: 0.0 }
}

pub(crate) const DEGREES: UnitSlip = scaled("degrees", "°", std::f64::consts::PI / 180.0);
pub(crate) const DEGREES_PER_SECOND: UnitSlip =
    scaled("degrees per second", " °/s", std::f64::consts::PI / 180.0);
pub(crate) const RPM: UnitSlip = scaled("revolutions per minute", " rpm", std::f64::consts::PI / 30.0);
pub(crate) const MILLISECONDS: UnitSlip = scaled("milliseconds", " ms", 1e-3);
pub(crate) const MICROSECONDS: UnitSlip = scaled("microseconds", " µs", 1e-6);
pub(crate) const MILLIMETRES: UnitSlip = scaled("millimetres", " mm", 1e-3);
pub(crate) const CENTIMETRES: UnitSlip = scaled("centimetres", " cm", 1e-2);
pub(crate) const MILLIMETRES_PER_SECOND: UnitSlip = scaled("millimetres per second", " mm/s", 1e-3);
pub(crate) const KILOMETRES_PER_HOUR: UnitSlip = scaled("kilometres per hour", " km/h", 1.0 / 3.6);
pub(crate) const GRAMS: UnitSlip = scaled("grams", " g", 1e-3);
pub(crate) const KILOGRAM_SQUARE_CENTIMETRES: UnitSlip = scaled("kg cm²", " kg cm²", 1e-4);
pub(crate) const KILOGRAM_SQUARE_MILLIMETRES: UnitSlip = scaled("kg mm²", " kg mm²", 1e-6);
pub(crate) const GRAM_SQUARE_CENTIMETRES: UnitSlip = scaled("g cm²", " g cm²", 1e-7);
pub(crate) const MILLINEWTON_METRES: UnitSlip = scaled("millinewton metres", " mN m", 1e-3);
pub(crate) const STANDARD_GRAVITIES: UnitSlip = scaled("multiples of g", " g", 9.806_65);
pub(crate) const MILLIVOLTS: UnitSlip = scaled("millivolts", " mV", 1e-3);
pub(crate) const FAHRENHEIT: UnitSlip =
    UnitSlip { name: "degrees Fahrenheit", symbol: " °F", factor: 5.0 / 9.0, offset: -160.0 / 9.0 };
pub(crate) const KELVIN: UnitSlip = UnitSlip { name: "kelvin", symbol: " K", factor: 1.0, offset: -273.15 };

/// Says which of `slips` bring `value` into the `plausible` range of a key in `unit`, with the value that was then
/// meant: "30 looks like degrees: 30° is 0.524 rad".
pub(crate) fn hint(
    value: f64,
    unit: &str,
    plausible: &RangeInclusive<f64>,
    slips: &[UnitSlip],
) -> Option<String> {
    let meant = |slip: &UnitSlip| value * slip.factor + slip.offset;
    let fitting: Vec<&UnitSlip> = slips.iter().filter(|slip| plausible.contains(&meant(slip))).collect();
    if fitting.is_empty() {
        return None;
    }
    let value_text = digits(value);
    let names = fitting.iter().map(|slip| slip.name).collect::<Vec<_>>().join(" or ");
    let conversions: Vec<String> = fitting
        .iter()
        .map(|slip| format!("{value_text}{} is {} {unit}", slip.symbol, digits(meant(slip))))
        .collect();
    Some(format!("{value_text} looks like {names}: {}", conversions.join(", ")))
}

/// At most three significant digits, without trailing zeros and with an exponent only where it is shorter.
pub(crate) fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_named_if_the_value_is_plausible_in_it() {
        let hint = |value, unit, range, slips: &[UnitSlip]| hint(value, unit, &range, slips);
        assert_eq!(
            hint(30.0, "rad", 0.0..=1.57, &[DEGREES]).as_deref(),
            Some("30 looks like degrees: 30° is 0.524 rad")
        );
        assert_eq!(
            hint(20.0, "m", 0.01..=0.6, &[MILLIMETRES, CENTIMETRES]).as_deref(),
            Some("20 looks like millimetres or centimetres: 20 mm is 0.02 m, 20 cm is 0.2 m")
        );
        assert_eq!(
            hint(353.15, "°C", 0.0..=150.0, &[FAHRENHEIT, KELVIN]).as_deref(),
            Some("353 looks like kelvin: 353 K is 80 °C")
        );
        assert_eq!(hint(500.0, "rad", 0.0..=1.57, &[DEGREES]), None);
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (50.0, "50"),
            (std::f64::consts::FRAC_PI_6, "0.524"),
            (-0.05, "-0.05"),
            (1e30, "1e30"),
            (1234.0, "1230"),
            (0.0, "0"),
        ] {
            assert_eq!(digits(value), text);
        }
    }
}
