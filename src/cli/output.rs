//! Standard output as one JSON object or as text, and messages on standard error.

use std::fmt::Display;
use std::io::{self, Write};

use serde::Serialize;

/// Why a command ended without its result.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What could not be done, where, and the mend.
    Message(String),
    /// Whoever read standard output has closed it; nothing is left to say.
    ReaderGone,
}

impl Failure {
    /// Wraps an error whose own text already says what, where and the mend.
    pub(crate) fn from_error(error: impl Display) -> Self {
        Self::Message(error.to_string())
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ReaderGone,
            _ => Self::Message(format!("cannot write the result: {error}")),
        }
    }
}

/// Where a command's result goes.
pub(crate) struct Output {
    json: bool,
}

impl Output {
    pub(crate) fn new(json: bool) -> Self {
        Self { json }
    }

    /// Prints the result: `value` with `--json`, else what `text` writes.
    pub(crate) fn result<T: Serialize>(
        &self,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let mut out = io::BufWriter::new(io::stdout().lock());
        if self.json {
            serde_json::to_writer(&mut out, value).map_err(io::Error::from)?;
            writeln!(out)?;
        } else {
            text(&mut out)?;
        }
        Ok(out.flush()?)
    }
}

/// Prints one line on standard error. A closed standard error is no reason to fail.
pub(crate) fn complain(message: &str) {
    writeln!(io::stderr().lock(), "flqr: {message}").unwrap_or(());
}
