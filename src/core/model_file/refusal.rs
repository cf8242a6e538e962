//! Values that parsed and are refused, with the place of their key.

use std::borrow::Cow;

use crate::parameter::ParameterError;

/// A value that parsed and is refused.
pub(super) struct Refusal {
    /// Tables and key, outermost first; that of a list is followed by a number from 0.
    pub(super) path: Vec<Cow<'static, str>>,
    pub(super) problem: String,
}

impl Refusal {
    pub(super) fn new(path: &[&'static str], problem: impl Into<String>) -> Self {
        Self { path: path.iter().map(|&key| key.into()).collect(), problem: problem.into() }
    }

    pub(super) fn parameter<'a>(table: &'a [&'static str]) -> impl Fn(ParameterError) -> Self + 'a {
        move |error| Self::new(&[table, &[error.name]].concat(), error.to_string())
    }
}
