//! Requests of this page.

use std::path::PathBuf;

use flqr_core::simulate::Scenario;

use super::run::Question;
use super::save::SavedAs;

/// One wish of this page.
#[derive(Clone, Debug)]
pub(crate) enum RefineCommand {
    /// Loads a log next to those that are there, or one of them again.
    Load {
        path: PathBuf,
        held_out: bool,
    },
    /// Takes all logs from the list.
    Clear,
    /// Stops loading a log, or takes it from the list.
    Remove(u64),
    /// True if a log takes no part in the estimates.
    HoldOut(u64, bool),
    /// Puts a question to the logs.
    Start(Question),
    Cancel,
    /// Puts what was found into the session's model.
    Use,
    /// Goes to the experiments with the scenario of the next experiment.
    Simulate(Scenario),
    /// Saves the report or the refined model; an existing file is replaced only if `replace`.
    Save {
        saved_as: SavedAs,
        path: PathBuf,
        replace: bool,
    },
}

/// Purpose of a file dialog of this page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RefineFile {
    Log,
    Save(SavedAs),
}
