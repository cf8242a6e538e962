//! `flqr fit`: identifies friction and inertia from bench logs.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use flqr_core::identify::{self, Bounds, Estimate, FitOptions, FitReport, FrictionPair, Method};
use flqr_core::record::HealthFinding;
use serde::Serialize;

use super::input;
use super::logs::{Estimated, print_health};
use super::output::{Failure, Output, number};
use super::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Logs (CSV): constant speeds, staircases or friction pairs give the Stribeck curve; any other motion
    /// gives inertia or mass, viscous and Coulomb friction and offset
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// Model file (TOML) with the known parameters; without it, the columns determine the rig
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// PSO with local refinement, or PSO only
    #[arg(long, value_enum, default_value = "best")]
    method: MethodName,
    /// Search bounds: from the data, or from Table 3 of the paper as printed
    #[arg(long, value_enum, default_value = "data")]
    bounds: BoundsName,
    #[command(flatten)]
    estimated: Estimated,
}

#[derive(Clone, Copy, ValueEnum)]
enum MethodName {
    Best,
    Pso,
}

#[derive(Clone, Copy, ValueEnum)]
enum BoundsName {
    Data,
    Paper,
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Fitted<'a> {
    parameters: &'a BTreeMap<&'static str, Estimate>,
    rmse: Quantity,
    relative_error: f64,
    pairs: &'a [FrictionPair],
    iterations: usize,
    history: &'a [f64],
    data_health: &'a [HealthFinding],
    warnings: &'a [String],
}

#[derive(Serialize)]
struct Quantity {
    value: f64,
    unit: &'static str,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let model = arguments.model.as_deref().map(input::load_model).transpose()?;
    let estimated = &arguments.estimated;
    let logs = estimated.columns.read(&arguments.logs)?;
    let options = FitOptions {
        method: match arguments.method {
            MethodName::Best => Method::Best,
            MethodName::Pso => Method::Pso,
        },
        bounds: match arguments.bounds {
            BoundsName::Data => Bounds::Data,
            BoundsName::Paper => Bounds::Paper,
        },
        estimate: estimated.estimate.clone(),
        seed: estimated.seed,
    };
    let bar = Progress::new("fit");
    let report = identify::fit(&logs, model.as_ref(), estimated.motor.into(), &options, &mut |progress| {
        bar.set(progress.iteration as u64, progress.iterations as u64);
        ControlFlow::Continue(())
    })
    .map_err(Failure::from_error)?;
    drop(bar);
    let of_model = model.as_ref().map(input::warnings_of).unwrap_or_default();
    let keys = Fitted {
        parameters: &report.parameters,
        rmse: Quantity { value: report.rmse, unit: report.rmse_unit },
        relative_error: report.relative_error,
        pairs: &report.pairs,
        iterations: report.iterations,
        history: &report.history,
        data_health: &report.data_health,
        warnings: &[&report.warnings[..], &of_model].concat(),
    };
    output.answer(&keys, |out| print(out, &report))
}

fn print(out: &mut dyn Write, report: &FitReport) -> io::Result<()> {
    writeln!(out, "{:24}{:>14}   95 % interval", "parameter", "value")?;
    for (name, estimate) in &report.parameters {
        write!(out, "{name:24}{:>14}", number(estimate.value))?;
        match estimate.ci95 {
            Some([low, high]) => writeln!(out, "   {} to {}", number(low), number(high))?,
            None => writeln!(out, "   none")?,
        }
    }
    writeln!(
        out,
        "\nRMSE {} {}, relative error {:.2} %",
        number(report.rmse),
        report.rmse_unit,
        100.0 * report.relative_error
    )?;
    if !report.pairs.is_empty() {
        writeln!(out, "{} pairs, {} iterations", report.pairs.len(), report.iterations)?;
    }
    print_health(out, &report.data_health)?;
    report.warnings.iter().try_for_each(|warning| writeln!(out, "warning: {warning}"))
}
