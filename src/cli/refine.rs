//! `flqr refine`: finds the effects that a model lacks in measured data and adds them.

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::Args;
use flqr_core::refine::{self, ClosedLoop, Corrected, LoopRun, Options, Outcome, Refinement, Verdict};

use super::input;
use super::logs::print_health;
use super::output::{Failure, Output, check_finite, complain, number};
use super::output_file::{self, Force, OutputFile};
use super::progress::Progress;
use super::residual::{ResidualOptions, print_errors};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML)
    model: PathBuf,
    /// Logs (CSV) of one kind: of the robot, or of one motor or axis
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// Held-out log for validation, not used in the estimates; repeatable [default: the last third of each log]
    #[arg(long, value_name = "LOG")]
    heldout: Vec<PathBuf>,
    #[command(flatten)]
    options: ResidualOptions,
    #[command(flatten)]
    kept: Kept,
}

/// Outputs of a refinement.
#[derive(Args)]
pub(crate) struct Kept {
    /// Write the refined model (TOML)
    #[arg(long, value_name = "NEW.toml")]
    out: Option<PathBuf>,
    /// Write the report with its figures as one HTML file
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

impl Kept {
    fn model_file(&self) -> Option<OutputFile<'_>> {
        self.out.as_deref().map(|path| OutputFile::new(path, "model"))
    }

    fn report_file(&self) -> Option<OutputFile<'_>> {
        self.report.as_deref().map(|path| OutputFile::new(path, "report"))
    }

    /// Checks the outputs of a command that reads these files.
    pub(crate) fn check(&self, inputs: &[&Path]) -> Result<(), Failure> {
        let outputs: Vec<_> = self.model_file().into_iter().chain(self.report_file()).collect();
        output_file::check(inputs, &outputs, self.force)
    }

    /// Writes the outputs, then prints the result with `print`, also if there is no model to write.
    pub(crate) fn write(
        &self,
        found: &Refinement,
        print: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        check_finite(found)?;
        if let Some(file) = self.report_file() {
            file.write(|out| out.write_all(found.document.to_html().as_bytes()))?;
            complain(&format!("the report with its figures is in {}", file.path.display()));
        }
        let Some(file) = self.model_file() else { return print() };
        let path = file.path.display();
        if found.verdict != Verdict::DataUnfit {
            file.write_model(&found.model.to_toml())?;
            complain(&format!("the refined model is in {path}"));
            return print();
        }
        let earlier = match file.put_aside()? {
            Some(earlier) => format!(" (the previous file is now {})", earlier.display()),
            None => String::new(),
        };
        print()?;
        Err(Failure::Partial(format!(
            "{path}: no model is written{earlier}, because the logs are not suitable for identification: see data_health and record again"
        )))
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let inputs = [&arguments.model].into_iter().chain(&arguments.logs).chain(&arguments.heldout);
    arguments.kept.check(&inputs.map(PathBuf::as_path).collect::<Vec<_>>())?;
    let model = input::load_model(&arguments.model)?;
    let columns = &arguments.options.estimated.columns;
    let logs = columns.read(&arguments.logs)?;
    let held_out = columns.read(&arguments.heldout)?;
    let bar = Progress::new("refine");
    let file = arguments.kept.out.as_ref().map_or_else(String::new, |path| path.display().to_string());
    let options = Options { model_file: file, ..arguments.options.options() };
    let found = refine::refine(&model, &logs, &held_out, &options, &mut |share| {
        bar.set_share(share);
        ControlFlow::Continue(())
    })
    .map_err(Failure::from_error)?;
    drop(bar);
    arguments.kept.write(&found, || output.answer(&found, |out| print(out, &found)))
}

/// Maximum number of rejected candidates to print.
const MOST_LOST: usize = 8;

pub(crate) fn print(out: &mut dyn Write, found: &Refinement) -> io::Result<()> {
    let verdict = match found.verdict {
        Verdict::ModelAdequate => "model adequate: no effect of the library explains the log better",
        Verdict::EffectsFound => "effects found",
        Verdict::UnexplainedResidual => "unexplained residual: no effect of the library explains it",
        Verdict::DataUnfit => "log not suitable for identification",
    };
    writeln!(out, "{verdict}")?;
    for effect in &found.effects {
        write!(out, "\n{}, error reduction {:.1} %", effect.effect.id(), effect.error_drop_percent)?;
        print_ends(out, effect.error_drop_ci95)?;
        for (n, (key, value)) in effect.effect.parameters().iter().enumerate() {
            write!(out, "  {key:24}{:>14}", number(*value))?;
            match effect.ci95[n] {
                Some([low, high]) => write!(out, "   {} to {}", number(low), number(high))?,
                None => write!(out, "   ")?,
            }
            writeln!(out, " {}", if effect.units[n] == "1" { "" } else { effect.units[n] })?;
        }
        if !effect.ambiguous_with.is_empty() {
            let others: Vec<&str> = effect.ambiguous_with.iter().map(|kind| kind.id).collect();
            writeln!(out, "  cannot be distinguished from {} with this log", others.join(", "))?;
        }
    }
    for carried in &found.transfer {
        let drop = carried.error_drop_percent;
        write!(out, "\n{}, declared: reduces the error by {drop:.1} %", carried.id)?;
        print_ends(out, carried.error_drop_ci95)?;
    }
    let lost = found.candidates.iter().filter(|tried| tried.outcome != Outcome::Added);
    for (n, tried) in lost.take(MOST_LOST).enumerate() {
        if n == 0 {
            writeln!(out, "\n{:45}{:>14}", "candidates not added", "error reduction")?;
        }
        let name = format!("{} {}", tried.kind.id, tried.detail);
        writeln!(out, "{:45}{:>12.1} %   {}", name.trim(), tried.gain_percent, tried.outcome)?;
    }
    if !found.before.rmse.0.is_empty() {
        writeln!(out)?;
        print_errors(out, &[("before", &found.before), ("after", &found.after)])?;
    }
    if !found.unexplained.description.is_empty() {
        writeln!(out, "unexplained: {}", found.unexplained.description)?;
    }
    print_parameters(out, &found.parameters)?;
    if let Some(closed_loop) = &found.closed_loop {
        print_closed_loop(out, closed_loop)?;
    }
    if let Some(next) = &found.next_experiment {
        writeln!(out, "next experiment: {}", next.summary)?;
        if let Some(command) = &next.command {
            writeln!(out, "  {command}")?;
        }
    }
    print_health(out, &found.data_health)
}

/// Ends a line with the interval of a percentage, if there is one.
fn print_ends(out: &mut dyn Write, ci95: Option<[f64; 2]>) -> io::Result<()> {
    match ci95 {
        Some([low, high]) => writeln!(out, " ({low:.1} to {high:.1})"),
        None => writeln!(out),
    }
}

/// Prints declared parameters that the refined model changes, or that the log does not identify.
fn print_parameters(out: &mut dyn Write, parameters: &[Corrected]) -> io::Result<()> {
    for (n, own) in parameters.iter().enumerate() {
        if n == 0 {
            writeln!(
                out,
                "\n{:26}{:>14}{:>14}   95 % interval",
                "declared numbers", "declared", "re-estimated"
            )?;
        }
        let now = if own.value == own.declared { "kept".to_owned() } else { number(own.value) };
        write!(out, "  {:24}{:>14}{now:>14}", own.key, number(own.declared))?;
        match own.ci95 {
            Some([low, high]) => writeln!(out, "   {} to {}", number(low), number(high))?,
            None => writeln!(out)?,
        }
    }
    if parameters.is_empty() { Ok(()) } else { writeln!(out) }
}

/// Prints the simulation with both controllers and the use of each effect.
fn print_closed_loop(out: &mut dyn Write, closed_loop: &ClosedLoop) -> io::Result<()> {
    writeln!(out)?;
    if !closed_loop.scenarios.is_empty() {
        writeln!(out, "{:45}{:>14}{:>14}", "simulated, standard deviations", "before", "after")?;
    }
    for pair in &closed_loop.scenarios {
        let rows = [
            ("x", pair.before.x_m.std, pair.after.x_m.std, "m"),
            ("x_dot", pair.before.x_dot_m_s.std, pair.after.x_dot_m_s.std, "m/s"),
            ("pitch", pair.before.pitch_rad.std, pair.after.pitch_rad.std, "rad"),
        ];
        for (name, before, after, unit) in rows {
            let what = format!("{}, {name}", pair.scenario);
            writeln!(out, "{what:45}{:>14}{:>14} {unit}", number(before), number(after))?;
        }
        let cycle = |run: &LoopRun| match (run.fell, run.limit_cycle) {
            (true, _) => "fell".to_owned(),
            (_, Some(cycle)) => format!("{:.1} mm, {:.2} Hz", 1e3 * cycle.amplitude_m, cycle.frequency_hz),
            (_, None) => "none".to_owned(),
        };
        let what = format!("{}, limit cycle", pair.scenario);
        writeln!(out, "{what:40}{:>19}{:>19}", cycle(&pair.before), cycle(&pair.after))?;
    }
    for fed in &closed_loop.feedforward {
        let used = if fed.used { "used" } else { "not used" };
        writeln!(out, "{} in the controller: {used}: {}", fed.effect.id, fed.reason)?;
    }
    writeln!(out)
}
