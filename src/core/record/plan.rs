//! Which cells of a file become which columns of a log.

use super::text::Header;
use super::{ColumnMap, LogError, LogKind, Mapping, listed, schema};

/// Importance of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Need {
    /// Outside the schema: anything that is not a number is NaN.
    Unknown,
    /// Of the schema: damage is a problem, the value is NaN.
    Optional,
    /// Required by the kind of log: damage drops the row.
    Required,
}

/// One column of the log.
pub(super) struct Target {
    pub(super) name: String,
    /// Number of the file's column that it is read from.
    pub(super) from: usize,
    pub(super) factor: f64,
}

/// Which cells of a file become which columns of a log.
pub(super) struct Plan {
    pub(super) targets: Vec<Target>,
    /// Importance of each column of the file.
    pub(super) needs: Vec<Need>,
}

impl Plan {
    /// The file's own columns except those that the map replaces, then the mapped ones.
    pub(super) fn new(header: &Header, file: &str, map: &ColumnMap) -> Result<Self, LogError> {
        let replaced = |name: &str| map.entries().iter().any(|entry| entry.ours == name);
        let own = header.names.iter().enumerate().filter(|(_, name)| !replaced(name));
        let own = own.map(|(from, name)| Target { name: name.clone(), from, factor: 1.0 });
        let mut targets: Vec<Target> = own.collect();
        for entry in map.entries() {
            let from = find(header, file, &entry.theirs)?
                .ok_or_else(|| mapped_column_missing(header, file, entry))?;
            targets.push(Target { name: entry.ours.clone(), from, factor: entry.factor });
        }
        for name in schema::known() {
            if !replaced(name) {
                find(header, file, name)?;
            }
        }
        let needs = needs(&targets, header.names.len());
        Ok(Self { targets, needs })
    }
}

/// The only column of that name.
fn find(header: &Header, file: &str, name: &str) -> Result<Option<usize>, LogError> {
    let mut found = header.names.iter().enumerate().filter(|(_, other)| *other == name);
    let first = found.next().map(|(index, _)| index);
    match found.next() {
        None => Ok(first),
        Some(_) => Err(LogError::DuplicateColumn {
            file: file.to_owned(),
            line: header.line,
            column: name.to_owned(),
        }),
    }
}

fn mapped_column_missing(header: &Header, file: &str, entry: &Mapping) -> LogError {
    let names: Vec<&str> = header.names.iter().map(String::as_str).collect();
    LogError::MappedColumnMissing {
        file: file.to_owned(),
        mapping: entry.to_string(),
        theirs: entry.theirs.clone(),
        present: listed(&names),
    }
}

fn needs(targets: &[Target], columns: usize) -> Vec<Need> {
    let has = |name: &str| targets.iter().any(|target| target.name == name);
    let kinds: Vec<LogKind> = LogKind::ALL.into_iter().filter(|kind| kind.fits(has)).collect();
    let mut needs = vec![Need::Unknown; columns];
    for Target { name, from, .. } in targets {
        let name = name.as_str();
        let need = if name == "time_s" || kinds.iter().any(|kind| kind.required().contains(&name)) {
            Need::Required
        } else if schema::is_known(name) {
            Need::Optional
        } else {
            Need::Unknown
        };
        needs[*from] = needs[*from].max(need);
    }
    needs
}
