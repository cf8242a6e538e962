//! Standard output as one JSON object or as text, and messages on standard error.

use std::fmt::Display;
use std::io::{self, Write};

use flqr_core::message;
use serde::Serialize;

use super::finite;

/// Why a command ended without its result, or with a part of it. A message says what, where and how to fix it.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command line is wrong, or asks for help.
    Usage(clap::Error),
    /// It could not be done.
    Message(String),
    /// A file that the command reads cannot be used.
    Input(String),
    /// A file that the command writes cannot be written, or must not be.
    Output(String),
    /// A defect of flqr that it has noticed itself.
    Defect(String),
    /// It was done in part: the answer is printed already.
    Partial(String),
    /// Whoever read standard output has closed it; nothing is left to say.
    ReaderGone,
}

impl Failure {
    /// Wraps an error whose own text already says what, where and how to fix it.
    pub(crate) fn from_error(error: impl Display) -> Self {
        Self::Message(error.to_string())
    }

    /// The same of a file that cannot be used.
    pub(crate) fn from_input(error: impl Display) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ReaderGone,
            _ => Self::Partial(format!("cannot write the result: {error}: check where standard output goes")),
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

    /// Prints the answer of a command, which must be made of finite numbers; see [`Output::result`].
    pub(crate) fn answer<T: Serialize>(
        &self,
        value: &T,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        check_finite(value)?;
        self.result(value, text)
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

    /// Writes to `out` what [`Output::result`] prints. Control characters of names are escaped in text, as in JSON.
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
    /// Whether standard output is for scripts.
    pub(crate) fn is_json(&self) -> bool {
        self.json
    }
}

/// Refuses a result with numbers that are infinite or none.
pub(crate) fn check_finite(value: &impl Serialize) -> Result<(), Failure> {
    match finite::not_finite(value) {
        None => Ok(()),
        Some(name) => Err(Failure::Message(format!(
            "the result is out of the range of numbers ({name}): check the units of what was given, which is too large or \
             too small"
        ))),
    }
}

/// Prints one line on standard error. A closed standard error is no reason to fail.
pub(crate) fn complain(message: &str) {
    writeln!(io::stderr().lock(), "flqr: {}", message::shown(message)).unwrap_or(());
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
