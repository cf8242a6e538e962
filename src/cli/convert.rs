//! `flqr convert`: converts recordings for other programs.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufReader, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::Args;
use flqr_core::record::ColumnMap;
use flqr_core::record::mcap::{self, Conversion, ConvertError, Input};
use serde::Serialize;

use super::input;
use super::logs::Columns;
use super::output::{Failure, Output};
use super::output_file::{self, Force, OutputFile};
use super::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Files of one recording: robot log or bench logs (CSV), raw frames (candump); merged by time. For a single robot
    /// log, the frame file of the same name is included
    #[arg(required = true, num_args = 2.., value_names = ["IN", "OUT.mcap"])]
    files: Vec<PathBuf>,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    force: Force,
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Converted<'a> {
    out: &'a Path,
    #[serde(flatten)]
    conversion: &'a Conversion,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (out, files) = arguments.files.split_last().expect("clap asks for two files at least");
    check_output(out)?;
    let out = OutputFile::new(out, "MCAP file");
    let files = with_frames(files);
    output_file::check(&files.iter().map(PathBuf::as_path).collect::<Vec<_>>(), &[out], arguments.force)?;
    let map = arguments.columns.checked()?;
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    let mut bytes = 0;
    let mut inputs = Vec::new();
    for (path, source) in files.iter().zip(&names) {
        let (reader, size) = input::open(path)?;
        bytes += size;
        inputs.push(Input { source, topic: topic(path), reader });
    }
    let conversion = write(out, inputs, &map, bytes)?;
    let keys = Converted { out: out.path, conversion: &conversion };
    output.answer(&keys, |text| print(text, out.path, &conversion))
}

/// Refuses an output that is not named as an MCAP file, such as the last input of a command line without an output.
fn check_output(out: &Path) -> Result<(), Failure> {
    if out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap")) {
        return Ok(());
    }
    Err(Failure::Output(format!(
        "{}: the last file is the output and must be MCAP: end its name in .mcap",
        out.display()
    )))
}

/// Adds the raw frames of the same recording to a single robot log.
fn with_frames(files: &[PathBuf]) -> Vec<PathBuf> {
    let mut all = files.to_vec();
    if let [log] = files
        && log.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
    {
        all.extend(Some(log.with_extension("log")).filter(|frames| frames.is_file()));
    }
    all
}

/// Topic of columns that do not belong to a robot log.
fn topic(path: &Path) -> &'static str {
    let side = path.file_stem().and_then(|stem| Path::new(stem).extension()).and_then(OsStr::to_str);
    match side {
        Some("left") => "/bench/left",
        Some("right") => "/bench/right",
        _ => "/log",
    }
}

fn write(
    out: OutputFile,
    inputs: Vec<Input<BufReader<File>>>,
    map: &ColumnMap,
    bytes: u64,
) -> Result<Conversion, Failure> {
    let bar = Progress::new(format!("writing {}", out.path.display()));
    let mut done = None;
    let written = out.write(|sink| {
        let converted = mcap::convert(inputs, map, sink, &mut |read| {
            bar.set(read, bytes);
            ControlFlow::Continue(())
        });
        match converted {
            Ok(conversion) => done = Some(Ok(conversion)),
            Err(ConvertError::Write(error)) => return Err(error),
            Err(error) => {
                done = Some(Err(Failure::from_input(&error)));
                return Err(io::Error::other(error));
            }
        }
        Ok(())
    });
    match done {
        Some(Err(failure)) => Err(failure),
        Some(Ok(conversion)) => written.map(|()| conversion),
        None => Err(written.err().unwrap_or(Failure::ReaderGone)),
    }
}

fn print(text: &mut dyn Write, out: &Path, conversion: &Conversion) -> io::Result<()> {
    writeln!(text, "{}", out.display())?;
    for (topic, messages) in &conversion.topics {
        writeln!(text, "  {topic:24}{messages:>12} messages")?;
    }
    if conversion.dropped > 0 {
        writeln!(text, "{} damaged rows and frames were skipped:", conversion.dropped)?;
    } else if !conversion.problems.is_empty() {
        writeln!(text, "problems:")?;
    }
    conversion.problems.iter().try_for_each(|problem| writeln!(text, "  {problem}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bench_logs_of_a_recording_have_topics_of_their_own() {
        let names = ["a/run.left.csv", "run.right.csv", "run.csv", "left.csv", "run.2.csv"];
        let topics = names.map(|name| topic(Path::new(name)));
        assert_eq!(topics, ["/bench/left", "/bench/right", "/log", "/log", "/log"]);
    }
}
