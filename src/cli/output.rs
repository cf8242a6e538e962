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

    /// Prints a result, or one of many: `value` on a line of its own with `--json`, else what `text` writes.
    pub(crate) fn result<T: Serialize>(
        &self,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let mut out = io::BufWriter::new(io::stdout().lock());
        self.write(&mut out, value, text)?;
        Ok(out.flush()?)
    }

    /// Writes to `out` what [`Output::result`] prints.
    pub(crate) fn write<T: Serialize>(
        &self,
        out: &mut dyn Write,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        if !self.json {
            return text(out);
        }
        serde_json::to_writer(&mut *out, value).map_err(io::Error::from)?;
        writeln!(out)
    }
}

impl Output {
    /// Whether standard output is for scripts.
    pub(crate) fn is_json(&self) -> bool {
        self.json
    }
}

/// Prints one line on standard error. A closed standard error is no reason to fail.
pub(crate) fn complain(message: &str) {
    writeln!(io::stderr().lock(), "flqr: {message}").unwrap_or(());
}

/// A number with seven significant digits, in plain or exponent form whichever fits.
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
