//! Values that parsed and are refused, with the place of their key.

use crate::parameter::ParameterError;

/// A value that parsed and is refused.
pub(super) struct Refusal {
    /// Tables and key, outermost first.
    pub(super) path: Vec<&'static str>,
    pub(super) problem: String,
}

impl Refusal {
    pub(super) fn new(path: &[&'static str], problem: impl Into<String>) -> Self {
        Self { path: path.to_vec(), problem: problem.into() }
    }

    pub(super) fn parameter<'a>(table: &'a [&'static str]) -> impl Fn(ParameterError) -> Self + 'a {
        move |error| Self::new(&[table, &[error.name]].concat(), error.to_string())
    }
}
