//! Checks that every physical parameter passes once, at the border of the core.

use std::borrow::Cow;

/// A physical parameter whose value no robot can have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value} is out of range: it must be {allowed}")]
pub struct ParameterError {
    /// Key of the parameter as the model file spells it, unit included.
    pub name: &'static str,
    /// The refused value.
    pub value: f64,
    /// The values that are allowed, in words.
    pub allowed: Cow<'static, str>,
}

/// Refuses values that are not finite or not above zero.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), ParameterError> {
    check(name, value, value > 0.0, "a finite number above 0")
}

/// Refuses values that are not finite or below zero.
pub(crate) fn not_negative(name: &'static str, value: f64) -> Result<(), ParameterError> {
    check(name, value, value >= 0.0, "a finite number, 0 or above")
}

/// Refuses values that are not finite.
pub(crate) fn finite(name: &'static str, value: f64) -> Result<(), ParameterError> {
    check(name, value, true, "a finite number")
}

/// Refuses values outside of a closed range, described by `allowed`.
pub(crate) fn within(
    name: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    allowed: &'static str,
) -> Result<(), ParameterError> {
    check(name, value, range.contains(&value), allowed)
}

fn check(name: &'static str, value: f64, ok: bool, allowed: &'static str) -> Result<(), ParameterError> {
    if value.is_finite() && ok {
        Ok(())
    } else {
        Err(ParameterError { name, value, allowed: allowed.into() })
    }
}
