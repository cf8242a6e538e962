//! `flqr reproduce`: reproduces the experiments of the paper.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::Args;
use flqr_core::model::Model;
use flqr_core::model_file::presets;
use flqr_core::parallel;
use flqr_core::reproduce::{self, DEFAULT_SEEDS, Settings};

use super::input;
use super::output::{Failure, Output, complain};
use super::output_file::{self, Force, OutputFile};
use super::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) with a [robot] and an [lqr] table; without it, the paper's robot
    model: Option<PathBuf>,
    /// Random seed of all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of random seeds of the balance experiments, starting at --seed; shows the random spread
    #[arg(long, value_name = "N", default_value_t = DEFAULT_SEEDS)]
    seeds: NonZeroUsize,
    /// Number of threads; does not affect the result [default: one per processor]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write the report with its figures as one HTML file
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let report = arguments.report.as_deref().map(|path| OutputFile::new(path, "report"));
    let inputs: Vec<_> = arguments.model.iter().map(PathBuf::as_path).collect();
    output_file::check(&inputs, report.as_slice(), arguments.force)?;
    let (model, text) = load(arguments)?;
    let settings = Settings {
        model_text: &text,
        seed: arguments.seed,
        seeds: arguments.seeds,
        threads: arguments.threads.unwrap_or_else(parallel::available),
    };
    let bar = Progress::new("the paper's experiments");
    let found = reproduce::reproduce(&model, &settings, &mut |share| {
        bar.set_share(share);
        ControlFlow::Continue(())
    });
    drop(bar);
    let found = found.map_err(|error| match &arguments.model {
        Some(path) => Failure::Message(format!("{}: {error}", path.display())),
        None => Failure::from_error(error),
    })?;
    match report {
        Some(file) => {
            file.write(|out| out.write_all(found.document.to_html().as_bytes()))?;
            complain(&format!("the report with its figures is in {}", file.path.display()));
        }
        None => complain("to see the figures, write the report with --report OUT.html"),
    }
    output.answer(&found, |out| out.write_all(found.document.to_text().as_bytes()))
}

/// Loads the model and the text of its file, whose comments give the sources of its numbers.
fn load(arguments: &Arguments) -> Result<(Model, String), Failure> {
    match &arguments.model {
        Some(path) => Ok((input::load_model(path)?, input::read_text(path)?)),
        None => {
            let [(_, text), ..] = presets::ALL;
            Ok((presets::paper(), text.to_owned()))
        }
    }
}
