//! `flqr`: tunes the balance controller of a wheel-legged robot. Without a command it opens the window.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    cli::run(cli::Cli::parse())
}
