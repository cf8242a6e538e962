//! `flqr export`: exports the controller for firmware or scripts.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use flqr_core::control::{BalanceController, ControllerKind, GainSchedule};
use flqr_core::export::{Controller, Format};
use flqr_core::model::Effect;
use serde::Serialize;

use super::output::{Failure, Output, complain};
use super::{gains, input};

/// Number of leg heights in the exported table.
const SCHEDULED_HEIGHTS: usize = 11;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) with a [robot] and an [lqr] table
    model: PathBuf,
    /// Format, written to standard output
    #[arg(long, value_enum)]
    to: Form,
}

#[derive(Clone, Copy, ValueEnum)]
enum Form {
    CHeader,
    Json,
    Yaml,
    Csv,
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Exported<'a> {
    controller: &'a Controller,
    text: String,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (name, robot) = input::load_robot(&arguments.model)?;
    let design = gains::design(&arguments.model, &robot)?;
    let kind = match robot.friction {
        [None, None] => ControllerKind::Lqr,
        _ => ControllerKind::Flqr,
    };
    let controller = BalanceController::new(kind, &robot, design.gain).map_err(Failure::from_error)?;
    let schedule = robot
        .legs
        .as_ref()
        .map(|_| GainSchedule::design(&robot, SCHEDULED_HEIGHTS))
        .transpose()
        .map_err(|error| Failure::Message(format!("{}: {error}", arguments.model.display())))?;
    let controller = Controller::new(&name, &controller, schedule.as_ref());
    let format = match arguments.to {
        Form::CHeader => Format::CHeader,
        Form::Json => Format::Json,
        Form::Yaml => Format::Yaml,
        Form::Csv => Format::Csv,
    };
    let text = controller.render(format);
    if format == Format::CHeader && !controller.effects.is_empty() {
        let ids: Vec<&str> = controller.effects.iter().map(Effect::id).collect();
        complain(&format!(
            "the C header contains friction feedforward only, without {}: export json, yaml or csv for all effects",
            ids.join(", ")
        ));
    }
    output.answer(&Exported { controller: &controller, text: text.clone() }, |out| {
        out.write_all(text.as_bytes())
    })
}
