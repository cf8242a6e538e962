//! What to record next.

use serde::Serialize;

use super::verdict::{Found, Unexplained};

/// A run that would tell more than the logs do.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NextExperiment {
    /// In words.
    pub summary: String,
    /// Ids of the effects that it tells from each other.
    pub separates: Vec<&'static str>,
    /// Scenario of the simulated robot; none where it is none.
    pub scenario: Option<String>,
    /// How far the residuals of those effects would be apart, in standard deviations of the noise; 0 where it was not
    /// worked out.
    pub separation: f64,
    /// A command that runs exactly it; none where no command can.
    pub command: Option<String>,
}

impl NextExperiment {
    /// An experiment in words.
    pub(super) fn in_words(summary: String) -> Self {
        Self { summary, ..Self::default() }
    }
}

/// What would tell inseparable effects apart, or what is left.
pub(super) fn in_words(effects: &[Found], left: &Unexplained) -> Option<NextExperiment> {
    if let Some(found) = effects.iter().find(|found| !found.ambiguous_with.is_empty()) {
        let others: Vec<&'static str> = found.ambiguous_with.iter().map(|kind| kind.id).collect();
        let summary = format!(
            "to tell {} from {}: {}",
            found.effect.id(),
            others.join(", "),
            found.effect.kind().separated_by
        );
        let separates = std::iter::once(found.effect.id()).chain(others).collect();
        return Some(NextExperiment { separates, ..NextExperiment::in_words(summary) });
    }
    if left.description.is_empty() {
        return None;
    }
    Some(NextExperiment::in_words(match left.depends_on.first().map(String::as_str) {
        Some("time_s") | None => {
            "the same run again, to see whether it comes back at the same time".to_owned()
        }
        Some(variable) => {
            format!("a run in which {variable} varies while all else is kept as even as can be")
        }
    }))
}
