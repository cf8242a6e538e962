//! What the page asks for.

/// One wish about the ledger.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum RunsCommand {
    /// Takes the rows out; they can be put back.
    Delete(Vec<u64>),
    /// Ticks a recording whose curves are not in memory, and reads them from its file.
    ReadCurves(u64),
    /// Puts back what was taken out last.
    UndoDelete,
    /// The user's own words on a row.
    SetNote(u64, String),
}
