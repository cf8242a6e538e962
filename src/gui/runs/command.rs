//! Requests of the page.

/// One wish about the ledger.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum RunsCommand {
    /// Takes the rows out; they can be put back.
    Delete(Vec<u64>),
    /// Ticks a recording whose curves are not in memory, and reads them from its file.
    ReadCurves(u64),
    /// Gives the keyboard to the first box of the rows.
    FocusRows,
    /// Ticks the last two rows of one kind that have curves, and no others.
    OverlayLast,
    /// Unticks all rows.
    UntickAll,
    /// Puts back what was taken out last.
    UndoDelete,
    /// The user's own words on a row.
    SetNote(u64, String),
}
