//! `flqr demo`: the whole loop without hardware or files.

use std::io::{self, Write};
use std::ops::ControlFlow;

use clap::Args;
use flqr_core::refine::{Demonstration, demonstrate};

use super::output::{Failure, Output, number};
use super::progress::Progress;
use super::refine;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Random seed: selects the hidden effect and draws all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    kept: refine::Kept,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    arguments.kept.check(&[])?;
    let bar = Progress::new("demo");
    let shown = demonstrate(arguments.seed, &mut |share| {
        bar.set_share(share);
        ControlFlow::Continue(())
    })
    .map_err(Failure::from_error)?;
    drop(bar);
    arguments.kept.write(&shown.found, || output.answer(&shown, |out| print(out, &shown)))
}

fn print(out: &mut dyn Write, shown: &Demonstration) -> io::Result<()> {
    writeln!(out, "1. The robot of the paper is simulated with an effect that its model does not contain.")?;
    writeln!(out, "2. It balances with the controller designed for that model; the run is recorded:")?;
    for log in &shown.logs {
        writeln!(out, "   {}, {} rows", log.source, log.rows())?;
    }
    let before = &shown.found.before;
    if let (Some((channel, error)), Some((_, noise))) = (before.rmse.0.first(), before.noise_floor.0.first())
    {
        writeln!(
            out,
            "3. The {channel} residual of the model is {} {}; the noise floor is {}.",
            number(error.value),
            error.unit,
            number(noise.value)
        )?;
    }
    writeln!(out, "4. Missing effects are identified from the recorded data alone:\n")?;
    refine::print(out, &shown.found)?;
    let truth = &shown.truth;
    writeln!(out, "\n5. The simulated robot had:\n\n{}{:>31}{:>14}", truth.effect.id(), "true", "found")?;
    let own = shown.found.effects.iter().find(|effect| effect.effect.kind() == truth.effect.kind());
    for (key, value) in truth.effect.parameters() {
        let estimate = own.and_then(|own| own.effect.get(key)).map_or("not".to_owned(), number);
        writeln!(out, "  {key:24}{:>14}{estimate:>14}", number(*value))?;
    }
    let like = shown.found.effects.iter().find(|found| found.ambiguous_with.contains(&truth.effect.kind()));
    match (own, like) {
        (Some(_), _) => writeln!(out, "\nThe effect was identified."),
        (None, Some(like)) => {
            writeln!(
                out,
                "\nIt was identified as {}, which cannot be distinguished from it with this data.",
                like.effect.id()
            )
        }
        (None, None) => writeln!(out, "\nThe effect was not identified."),
    }
}
