//! `flqr`: tunes the balance controller of a wheel-legged robot. Without a command it opens the window.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::guard(cli::run)
}
