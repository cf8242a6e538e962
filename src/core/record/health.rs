//! What is wrong with a log, in plain sentences.

use serde::Serialize;

use super::Log;

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth knowing.
    Info,
    /// Results may suffer.
    Warning,
    /// The log does not answer the question.
    Error,
}

/// One finding about a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HealthFinding {
    /// How much it matters.
    pub severity: Severity,
    /// The column, or nothing where the whole log is meant.
    pub column: String,
    /// What is wrong.
    pub problem: String,
    /// What to do about it.
    pub mend: String,
}

/// What is wrong with a log, the gravest first.
pub fn data_health(log: &Log) -> Vec<HealthFinding> {
    let mut findings = Vec::new();
    if let Err(error) = log.kind() {
        findings.push(HealthFinding {
            severity: Severity::Error,
            column: String::new(),
            problem: error.to_string(),
            mend: "map the file's own columns".to_owned(),
        });
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    findings
}
