//! `flqr residual`: computes the residual of a model on logs.

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::Args;
use flqr_core::refine::{self, Errors, Options, Residual};

use super::input;
use super::logs::{Estimated, print_health};
use super::output::{Failure, Output, number};
use super::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML)
    model: PathBuf,
    /// Logs (CSV) of one kind: of the robot, or of one motor or axis
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    options: ResidualOptions,
}

/// Options common to `residual` and `refine`.
#[derive(Args)]
pub(crate) struct ResidualOptions {
    #[command(flatten)]
    pub(crate) estimated: Estimated,
    /// Range of absolute speeds of an axis or motor to use, rad/s or m/s; the filters use the whole log
    #[arg(long, value_name = "LOW..HIGH", value_parser = range)]
    speeds: Option<[f64; 2]>,
}

/// Parses two numbers as LOW..HIGH.
fn range(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once("..").map(|(low, high)| [low, high].map(|end| end.trim().parse::<f64>()));
    match ends {
        Some([Ok(low), Ok(high)]) => Ok([low, high]),
        _ => Err("give two numbers, such as 0..9".to_owned()),
    }
}

impl ResidualOptions {
    pub(crate) fn options(&self) -> Options {
        Options {
            motor: self.estimated.motor.into(),
            estimate: self.estimated.estimate.clone(),
            seed: self.estimated.seed,
            speeds: self.speeds,
            ..Options::default()
        }
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let model = input::load_model(&arguments.model)?;
    let logs = arguments.options.estimated.columns.read(&arguments.logs)?;
    let bar = Progress::new("residual");
    let found = refine::residual(&model, &logs, &arguments.options.options(), &mut |share| {
        bar.set_share(share);
        ControlFlow::Continue(())
    })
    .map_err(Failure::from_error)?;
    drop(bar);
    output.answer(&found, |out| print(out, &found))
}

fn print(out: &mut dyn Write, found: &Residual) -> io::Result<()> {
    print_errors(out, &[("", &found.errors)])?;
    for test in &found.tests {
        let verdict = if test.structure { "structure" } else { "none" };
        writeln!(out, "{:45}{:>14}   {verdict} (above {})", test.name, number(test.value), test.threshold)?;
    }
    print_health(out, &found.data_health)
}

/// One column of errors.
type Kind = fn(&Errors) -> &refine::Channels;

/// Prints one line per channel with one column per kind of error.
pub(crate) fn print_errors(out: &mut dyn Write, errors: &[(&str, &Errors)]) -> io::Result<()> {
    if errors.iter().any(|(title, _)| !title.is_empty()) {
        let titles: String = errors.iter().map(|(title, _)| format!("{title:>14}")).collect();
        writeln!(out, "{:45}{titles}", "held-out rows")?;
    }
    let kinds: [(&str, Kind); 3] = [
        ("residual", |errors| &errors.rmse),
        ("noise floor of the residual", |errors| &errors.noise_floor),
        ("relative to the torque or force", |errors| &errors.nrmse),
    ];
    for (title, kind) in kinds {
        let Some((_, first)) = errors.first() else { return Ok(()) };
        for (index, (channel, quantity)) in kind(first).0.iter().enumerate() {
            write!(out, "{:45}", format!("{title}, {channel}"))?;
            for (_, errors) in errors {
                write!(
                    out,
                    "{:>14}",
                    kind(errors).0.get(index).map_or(String::new(), |(_, q)| number(q.value))
                )?;
            }
            writeln!(out, " {}", if quantity.unit == "1" { "" } else { quantity.unit })?;
        }
    }
    print_predictions(out, errors)
}

/// Prints the errors of short predictions with the noise and the motion.
fn print_predictions(out: &mut dyn Write, errors: &[(&str, &Errors)]) -> io::Result<()> {
    let Some((_, first)) = errors.first() else { return Ok(()) };
    for (index, prediction) in first.prediction.iter().enumerate() {
        let what = format!("prediction {:.0} ms ahead, {}", 1e3 * prediction.horizon_s, prediction.variable);
        write!(out, "{what:45}")?;
        for (_, errors) in errors {
            let own = errors.prediction.get(index);
            let shown = own.map(|own| if own.informative { number(own.rmse.value) } else { "-".to_owned() });
            write!(out, "{:>14}", shown.unwrap_or_default())?;
        }
        let last = errors.last().and_then(|(_, last)| last.prediction.get(index)).unwrap_or(prediction);
        let (noise, motion) = (number(last.noise_floor.value), number(last.motion.value));
        let why =
            if last.informative { "" } else { ": amplified noise of the initial state exceeds the motion" };
        writeln!(out, " {} (noise {noise}, motion {motion}{why})", prediction.rmse.unit)?;
    }
    Ok(())
}
