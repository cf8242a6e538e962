//! Replacing files as a whole.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flqr_core::device::replace_file;

/// Replaces a file as a whole; its folder is made if there is none.
pub(crate) fn write_file(path: &Path, content: &[u8]) -> io::Result<()> {
    write_file_with(path, |file| file.write_all(content))
}

/// Writes content that is generated while writing.
pub(crate) fn write_file_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    replace_file(path, write)
}

/// Outcome of writing one file.
#[derive(Debug)]
pub(crate) enum Saved {
    Written,
    /// A file is there already; nothing was written.
    AnotherIsThere,
}

/// Writes a file; an existing one is replaced only if `replace`. `text` is made only where it is written.
///
/// # Errors
/// A sentence that says what could not be written and the remedy.
pub(crate) fn save_file(path: &Path, text: impl FnOnce() -> String, replace: bool) -> Result<Saved, String> {
    if !replace && path.symlink_metadata().is_ok() {
        return Ok(Saved::AnotherIsThere);
    }
    write_file(path, text().as_bytes()).map(|()| Saved::Written).map_err(|error| not_saved(path, &error))
}

/// Fraction of what is written, from 0 to 1.
pub(crate) type Share = f32;

/// Is told the share that is written, and may break off.
pub(crate) type Watch<'w> = &'w mut dyn FnMut(Share) -> ControlFlow<()>;

/// Makes the content of a file while it is written. It ends with an error where it was broken off.
pub(crate) type Content = Box<dyn FnOnce(&mut dyn Write, Watch<'_>) -> io::Result<()> + Send>;

/// Files with what is to be in them.
pub(crate) type Files = Vec<(PathBuf, Content)>;

/// Content that is there already.
pub(crate) fn bytes(content: impl Into<Vec<u8>>) -> Content {
    let content = content.into();
    Box::new(move |file, _| file.write_all(&content))
}

/// Outcome of writing several files.
#[derive(Debug)]
pub(crate) enum Written {
    All(Vec<PathBuf>),
    /// These are there already; nothing was written.
    NoneAsThereAre(Vec<PathBuf>),
    /// The watch broke off; files before that are there.
    Cancelled,
}

/// Writes files one after the other; existing ones are replaced only if `replace`.
///
/// # Errors
/// A sentence that says what could not be written and the remedy.
pub(crate) fn write_files(files: Files, replace: bool, watch: Watch<'_>) -> Result<Written, String> {
    let paths = files.iter().map(|(path, _)| path);
    let existing: Vec<_> = paths.filter(|path| path.symlink_metadata().is_ok()).cloned().collect();
    if !replace && !existing.is_empty() {
        return Ok(Written::NoneAsThereAre(existing));
    }
    let (count, mut written) = (files.len(), Vec::new());
    let mut is_cancelled = false;
    for (path, content) in files {
        let done = written.len();
        let mut watch = |share: Share| {
            let flow = watch((done as Share + share) / count as Share);
            is_cancelled |= flow.is_break();
            flow
        };
        let result = write_file_with(&path, |file| {
            let mut file = BufWriter::with_capacity(1 << 16, file);
            content(&mut file, &mut watch)?;
            file.flush()
        });
        match result {
            Ok(()) => written.push(path),
            Err(_) if is_cancelled => return Ok(Written::Cancelled),
            Err(error) => return Err(not_saved(&path, &error)),
        }
    }
    Ok(Written::All(written))
}

/// Reason why a file was not written, and the remedy.
pub(crate) fn not_saved(path: &Path, error: &io::Error) -> String {
    format!(
        "{} could not be saved: {error}; check the folder, its permissions and the free disk space.",
        path.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Goes on.
    fn on(_: Share) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    #[test]
    fn nothing_is_written_where_one_of_several_files_exists() {
        let folder = std::env::temp_dir().join(format!("flqr-save-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [first, second] = ["a.csv", "b.csv"].map(|name| folder.join(name));
        std::fs::write(&second, "precious").unwrap();
        let files = || vec![(first.clone(), bytes("1")), (second.clone(), bytes("2"))];
        assert!(
            matches!(write_files(files(), false, &mut on), Ok(Written::NoneAsThereAre(paths)) if paths == [second.clone()])
        );
        assert!(!first.exists());
        assert!(matches!(write_files(files(), true, &mut on), Ok(Written::All(paths)) if paths.len() == 2));
        assert_eq!(std::fs::read_to_string(&second).unwrap(), "2");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
