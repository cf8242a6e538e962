//! Window, opened without a command.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use flqr_core::device::{SerialAddress, Source};
use flqr_core::model_file::presets;
use flqr_gui::{Tab, WindowOptions};

use super::input;
use super::interrupt::{Duty, Interrupt};
use super::logs::Columns;
use super::output::{Failure, complain};
use super::output_file::{self, Force, OutputFile};

#[derive(Args, Default, PartialEq)]
pub(crate) struct Arguments {
    /// Model file to open in the window; without it, the paper's robot
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Log to open in the window
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(flatten)]
    columns: Columns,
    /// Tab to show first
    #[arg(long, value_parser = tab_parser())]
    tab: Option<Tab>,
    /// Robot to connect to at start, listen-only: can:can0, slcan:/dev/ttyACM0@1000000, emulated, replay:FILE
    #[arg(long, value_name = "SOURCE")]
    source: Option<Source>,
    /// IMU of a robot on CAN, such as serial:/dev/ttyUSB0@115200
    #[arg(long, value_name = "serial:DEV@BAUD")]
    imu: Option<SerialAddress>,
    /// Start with the simulated robot paused
    #[arg(long)]
    paused: bool,
    /// Session file to open (model, weights, layout and sources)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["model", "log", "source"])]
    session: Option<PathBuf>,
    /// Write the state of the window to this file as JSON, for scripts
    #[arg(long, value_name = "FILE")]
    state_out: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

/// Reads the name of a page.
fn tab_parser() -> impl TypedValueParser<Value = Tab> {
    let names = PossibleValuesParser::new(Tab::ALL.map(Tab::key));
    names.try_map(|name| Tab::from_key(&name).ok_or("unknown page"))
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let tour = arguments == Arguments::default();
    check_state_out(&arguments)?;
    let model = match &arguments.model {
        Some(path) => input::load_model(path)?,
        None => presets::paper(),
    };
    let first = if arguments.log.is_some() { Tab::Friction } else { Tab::default() };
    let tab = arguments.tab.unwrap_or(first);
    let usual = WindowOptions::new(model);
    let state_folder = flqr_gui::default_state_folder();
    let has_folders = state_folder.is_some() && usual.recent_file.is_some();
    let warning = (!has_folders).then(|| {
        let name = if cfg!(windows) { "LOCALAPPDATA and APPDATA" } else { "HOME" };
        format!(
            "the session and recent files will not be saved, because {name} is empty or not set: set it to a folder"
        )
    });
    if let Some(warning) = &warning {
        complain(&format!("warning: {warning}"));
    }
    let options = WindowOptions {
        model_path: arguments.model,
        log: arguments.log,
        column_map: arguments.columns.map,
        tab,
        source: arguments.source,
        imu: arguments.imu,
        paused: arguments.paused,
        state_out: arguments.state_out,
        session: arguments.session,
        state_folder,
        warning,
        tour,
        ..usual
    };
    Interrupt::watch(Duty::Window)?;
    flqr_gui::run(options).map_err(Failure::from_error)
}

/// Checks that the state is not written over an input, nor over a file that flqr did not write.
fn check_state_out(arguments: &Arguments) -> Result<(), Failure> {
    let replayed = match &arguments.source {
        Some(Source::Replay { file }) => Some(file),
        _ => None,
    };
    let inputs = [arguments.model.as_ref(), arguments.log.as_ref(), arguments.session.as_ref(), replayed];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    let output = arguments.state_out.as_deref().map(|path| OutputFile::new(path, "window state"));
    output_file::check(&inputs, output.as_slice(), arguments.force)
}
