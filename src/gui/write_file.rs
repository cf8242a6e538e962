//! Replacing a file as a whole.

use std::ffi::OsString;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes by way of a second file beside `path`, so that a crash leaves the old content or the new one. Each
/// call has a second file of its own, so that two at a time, also of two windows, never mix their contents.
pub(crate) fn write_file(path: &Path, content: &[u8]) -> std::io::Result<()> {
    write_file_with(path, |file| file.write_all(content))
}

/// The same of content that is made while it is written.
pub(crate) fn write_file_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> std::io::Result<()>,
) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let beside = unique_name(path);
    let written = write_through(&beside, write).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        std::fs::remove_file(&beside).ok();
    }
    written
}

/// A name that points at content that is still on its way would be an empty file after a loss of power.
fn write_through(
    path: &OsString,
    write: impl FnOnce(&mut File) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    write(&mut file)?;
    file.sync_all()
}

fn unique_name(path: &Path) -> OsString {
    static CALLS: AtomicU64 = AtomicU64::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}-{call}.new", std::process::id()));
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writers_at_the_same_time_leave_one_whole_text_and_no_other_file() {
        let folder = std::env::temp_dir().join(format!("flqr-write-{}", std::process::id()));
        let path = folder.join("model.toml");
        let texts: Vec<String> = (1..=4).map(|length| "x".repeat(length * 50_000)).collect();
        std::thread::scope(|scope| {
            for text in &texts {
                scope.spawn(|| (0..20).for_each(|_| write_file(&path, text.as_bytes()).unwrap()));
            }
        });
        assert!(texts.contains(&std::fs::read_to_string(&path).unwrap()));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside it");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_target_that_cannot_be_replaced_stays_without_anything_beside_it() {
        let folder = std::env::temp_dir().join(format!("flqr-refused-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("target/inside")).unwrap();
        assert!(write_file(&folder.join("target"), b"text").is_err());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
