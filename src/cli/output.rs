//! Standard output as one JSON object or as text, and messages on standard error.

use std::fmt::Display;
use std::io::{self, Write};

use flqr_core::message;
use serde::Serialize;

use super::finite;

/// Reason why a command ended without its full result. A message says what is wrong, where, and how to fix it.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Usage error or request for help.
    Usage(clap::Error),
    /// The command failed.
    Message(String),
    /// An input file cannot be used.
    Input(String),
    /// An output file cannot be written, or must not be.
    Output(String),
    /// Internal error.
    Defect(String),
    /// Partial result, which has been printed.
    Partial(String),
    /// Standard output was closed by its reader.
    ReaderGone,
}

impl Failure {
    /// Wraps an error whose own text already says what, where and how to fix it.
    pub(crate) fn from_error(error: impl Display) -> Self {
        Self::Message(error.to_string())
    }

    /// Wraps the error of an input file that cannot be used.
    pub(crate) fn from_input(error: impl Display) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ReaderGone,
            _ => Self::Partial(format!(
                "cannot write the result: {error}: check the destination of standard output"
            )),
        }
    }
}

/// Output of a command's result.
pub(crate) struct Output {
    json: bool,
}

impl Output {
    pub(crate) fn new(json: bool) -> Self {
        Self { json }
    }

    /// Prints the result of a command after checking that its numbers are finite; see [`Output::result`].
    pub(crate) fn answer<T: Serialize>(
        &self,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        check_finite(value)?;
        self.result(value, text)
    }

    /// Prints `value` as one line with `--json`, otherwise the output of `text`.
    pub(crate) fn result<T: Serialize>(
        &self,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let mut out = io::BufWriter::new(io::stdout().lock());
        self.write(&mut out, value, text)?;
        Ok(out.flush()?)
    }

    /// Writes the output of [`Output::result`] to `out`. Control characters of names are escaped.
    pub(crate) fn write<T: Serialize>(
        &self,
        out: &mut dyn Write,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        if !self.json {
            let mut bytes = Vec::new();
            text(&mut bytes)?;
            return out.write_all(message::escaped_lines(&String::from_utf8_lossy(&bytes)).as_bytes());
        }
        serde_json::to_writer(&mut *out, value).map_err(io::Error::from)?;
        writeln!(out)
    }
}

impl Output {
    /// Returns whether the output is JSON.
    pub(crate) fn is_json(&self) -> bool {
        self.json
    }
}

/// Refuses a result with infinite or NaN numbers.
pub(crate) fn check_finite(value: &impl Serialize) -> Result<(), Failure> {
    match finite::not_finite(value) {
        None => Ok(()),
        Some(name) => Err(Failure::Message(format!(
            "the result is not a finite number ({name}): check the units of the inputs, which are too \
             large or too small"
        ))),
    }
}

/// Prints one line on standard error. A closed standard error is ignored.
pub(crate) fn complain(message: &str) {
    writeln!(io::stderr().lock(), "flqr: {}", message::shown(message)).unwrap_or(());
}

/// Formats a number with seven significant digits, in decimal or exponent notation.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.6e}");
    }
    let before_point = if size < 1.0 { 1 } else { size.log10() as usize + 1 };
    let zeros_behind_point = if size == 0.0 || size >= 1.0 { 0 } else { (-size.log10()) as usize };
    format!("{value:.*}", 7 + zeros_behind_point - before_point.min(7))
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn small_and_large_numbers_keep_their_digits() {
        for (value, text) in [
            (0.0, "0.000000"),
            (3e-7, "3.000000e-7"),
            (-0.00049, "-0.000490000"),
            (0.0338, "0.0338000"),
            (95.116_856, "95.11686"),
            (-1.5e9, "-1.500000e9"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
