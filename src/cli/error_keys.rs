//! Errors for scripts: one JSON object on standard output.

use std::env;
use std::io::{self, Write};
use std::path::Path;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use flqr_core::message;
use serde::Serialize;

/// Timeout for a reader of standard output that reads nothing.
const PATIENCE: Duration = Duration::from_millis(300);
/// Verbs that the remedy in a message starts with.
const ADVICE: [&str; 63] = [
    "add",
    "change",
    "map",
    "power",
    "reconnect",
    "skip",
    "check",
    "choose",
    "close",
    "connect",
    "convert",
    "copy",
    "correct",
    "drive",
    "end",
    "estimate",
    "export",
    "fit",
    "free",
    "give",
    "hold",
    "install",
    "keep",
    "leave",
    "look",
    "lower",
    "make",
    "measure",
    "move",
    "name",
    "open",
    "plug",
    "press",
    "put",
    "raise",
    "read",
    "record",
    "reduce",
    "refine",
    "remove",
    "rename",
    "repeat",
    "report",
    "run",
    "save",
    "scale",
    "select",
    "set",
    "shorten",
    "sort",
    "split",
    "start",
    "stop",
    "switch",
    "try",
    "turn",
    "type",
    "unplug",
    "use",
    "wait",
    "widen",
    "write",
    "simulate",
];

/// Returns whether errors are requested as JSON; the command line need not be valid.
pub(super) fn wanted() -> bool {
    env::args_os().skip(1).take_while(|argument| argument != "--").any(|argument| argument == "--json")
}

/// The object that is printed.
#[derive(Serialize)]
struct Line<'a> {
    error: &'a ErrorKeys,
}

/// Contents of an error object; unknown values are null.
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct ErrorKeys {
    /// `usage`, `input_file`, `output_file`, `failed` or `defect`.
    code: &'static str,
    /// What is wrong, where and how to fix it, as on standard error.
    message: String,
    /// File that the error is about, as named on the command line.
    file: Option<String>,
    /// Line of that file, from 1.
    line: Option<u64>,
    /// Column of that line, in bytes from 1.
    column: Option<u64>,
    /// The part of the message that says how to fix it.
    remedy: Option<String>,
}

impl ErrorKeys {
    /// Creates the error of a message, which starts with the name of its file if it concerns one.
    pub(super) fn new(code: &'static str, message: &str) -> Self {
        let arguments = env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned());
        Self::of(code, message, &arguments.collect::<Vec<_>>())
    }

    fn of(code: &'static str, message: &str, arguments: &[String]) -> Self {
        let file = file_of(message, arguments);
        let behind_file = &message[file.map_or(0, str::len)..];
        let (line, column) = place(behind_file);
        let code = if code == "failed" && file.is_some() { "input_file" } else { code };
        Self {
            code,
            message: message::shown(message),
            file: file.map(str::to_owned),
            line,
            column,
            remedy: remedy(behind_file).map(message::shown),
        }
    }

    /// Creates a usage error from the text of the argument parser.
    pub(super) fn usage(text: &str) -> Self {
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let what = lines.next().unwrap_or_default();
        let rest: Vec<_> = lines.collect();
        let tip = rest.iter().find_map(|line| line.strip_prefix("tip: "));
        let usage = || rest.iter().find(|line| line.starts_with("Usage: ")).copied();
        // What is required and missing stands in lines of its own.
        let listed =
            rest.iter().take_while(|_| what.ends_with(':')).take_while(|line| !line.starts_with("Usage: "));
        let what = listed.fold(what.to_owned(), |what, line| format!("{what} {line}"));
        let what = what.strip_prefix("error: ").unwrap_or(&what);
        Self { remedy: tip.or_else(usage).map(message::shown), ..Self::of("usage", what, &[]) }
    }

    /// Prints the object on a separate line. Gives up after a timeout if nobody reads standard output.
    pub(super) fn print(&self) {
        let Ok(mut line) = serde_json::to_vec(&Line { error: self }) else { return };
        line.push(b'\n');
        let (sender, printed) = channel();
        let print = move || {
            let mut out = io::stdout().lock();
            // Whoever has closed standard output has the exit code, and the message is on standard error.
            out.write_all(&line).and_then(|()| out.flush()).unwrap_or(());
            sender.send(()).unwrap_or(());
        };
        if thread::Builder::new().spawn(print).is_ok() {
            printed.recv_timeout(PATIENCE).unwrap_or(());
        }
    }
}

/// Returns the file on the command line that a message starts with.
fn file_of<'a>(message: &'a str, arguments: &[String]) -> Option<&'a str> {
    let values = arguments.iter().flat_map(|argument| {
        let value = argument.split_once('=').filter(|_| argument.starts_with('-')).map(|(_, value)| value);
        let source = argument.split_once(':').map(|(_, file)| file);
        [Some(argument.as_str()), value, source].into_iter().flatten()
    });
    let names = values.filter(|name| !name.is_empty() && message.starts_with(name));
    let followed = names.filter(|name| match message[name.len()..].bytes().next() {
        Some(b':') => true,
        Some(b' ') => Path::new(name).exists(),
        _ => false,
    });
    followed.max_by_key(|name| name.len()).map(|name| &message[..name.len()])
}

/// Returns line and column: after the name of the file, or spelled out.
fn place(behind_file: &str) -> (Option<u64>, Option<u64>) {
    let mut parts = behind_file.split(':').skip(1).map(|part| part.parse().ok());
    let behind = |word: &str| {
        let rest = behind_file.split_once(word)?.1;
        rest[..rest.bytes().take_while(u8::is_ascii_digit).count()].parse().ok()
    };
    match parts.next().flatten() {
        Some(line) => (Some(line), parts.next().flatten()),
        None => {
            let line = behind(" line ");
            (line, line.and_then(|_| behind(" column ")))
        }
    }
}

/// Returns the remedy at the end of a message.
fn remedy(message: &str) -> Option<&str> {
    let begins = |text: &str| {
        let text = ["if so, ", "then ", "so ", "or "]
            .iter()
            .fold(text, |text, word| text.strip_prefix(word).unwrap_or(text));
        let word = text.split(|character: char| !character.is_ascii_alphabetic()).next();
        word.is_some_and(|word| ADVICE.contains(&word))
    };
    let mut separators: Vec<usize> = [": ", "; ", ", "]
        .iter()
        .flat_map(|mark| message.match_indices(mark).map(|(at, _)| at + 2))
        .collect();
    separators.sort_unstable();
    separators.into_iter().map(|at| &message[at..]).find(|rest| begins(rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_its_file_its_place_and_its_remedy() {
        let arguments =
            ["refine", "my model.toml", "run.csv", "--report=a.html", "replay:b.csv"].map(str::to_owned);
        for (message, file, line, column, remedy) in [
            (
                "my model.toml:3:7: unknown key `x`: remove it",
                Some("my model.toml"),
                Some(3),
                Some(7),
                Some("remove it"),
            ),
            (
                "run.csv:12: two columns are named `a`, rename one of them",
                Some("run.csv"),
                Some(12),
                None,
                Some("rename one of them"),
            ),
            (
                "a.html: cannot write the report: denied: check the folder, its permissions and the space on the disk",
                Some("a.html"),
                None,
                None,
                Some("check the folder, its permissions and the space on the disk"),
            ),
            (
                "b.csv: expected value at line 1 column 8: give one JSON object",
                Some("b.csv"),
                Some(1),
                Some(8),
                Some("give one JSON object"),
            ),
            ("no log was given, name at least one", None, None, None, Some("name at least one")),
            ("the checks have passed", None, None, None, None),
        ] {
            let keys = ErrorKeys::of("failed", message, &arguments);
            let found = (keys.file.as_deref(), keys.line, keys.column, keys.remedy.as_deref());
            assert_eq!(found, (file, line, column, remedy), "{message}");
            assert_eq!(keys.code, if file.is_some() { "input_file" } else { "failed" });
        }
    }

    #[test]
    fn usage_errors_are_one_sentence_with_the_tip() {
        let text = "error: unexpected argument '--jso' found\n\n  tip: a similar argument exists: '--json'\n\nUsage: flqr";
        let keys = ErrorKeys::usage(text);
        assert_eq!((keys.code, &*keys.message), ("usage", "unexpected argument '--jso' found"));
        assert_eq!(keys.remedy.as_deref(), Some("a similar argument exists: '--json'"));
        let text = "error: the following required arguments were not provided:\n  <MODEL>\n\nUsage: flqr gains <MODEL>\n";
        let keys = ErrorKeys::usage(text);
        assert_eq!(keys.message, "the following required arguments were not provided: <MODEL>");
        assert_eq!(keys.remedy.as_deref(), Some("Usage: flqr gains <MODEL>"));
    }
}
