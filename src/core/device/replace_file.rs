//! Replacing files as a whole.

use std::ffi::OsString;
use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Links followed before a path counts as a loop, as on Linux.
const LINK_LIMIT: usize = 40;

/// Temporary files of the replacements under way.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file by way of a temporary one next to it, so that a failure or a crash leaves the previous content or the
/// new one. Links stay links, and an existing file keeps its mode and its owner. Devices and pipes are written to
/// directly. Each call has a temporary file of its own, so that concurrent calls never mix their contents.
///
/// # Errors
/// Errors of the system and of `write`.
pub fn replace_file(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let target = real_path(path)?;
    let existing = match fs::metadata(&target) {
        Ok(about) if !about.is_file() => return write(&mut File::create(&target)?),
        about => about.ok(),
    };
    let (temporary, mut file) = Temporary::create(&target)?;
    write(&mut file)?;
    // A name that points at content still on its way would be an empty file after a loss of power.
    file.sync_all()?;
    match existing {
        Some(about) if keeps_inode(&about, &file.metadata()?) => temporary.copy_over(&target),
        about => {
            if let Some(about) = about {
                fs::set_permissions(&temporary.path, about.permissions())?;
            }
            fs::rename(&temporary.path, &target)
        }
    }
}

/// Checks that [`replace_file`] could begin: the folder is there and can be written, and no folder or read-only file
/// is in the way.
///
/// # Errors
/// What stands in the way.
pub fn check_replaceable(path: &Path) -> io::Result<()> {
    let target = real_path(path)?;
    match fs::metadata(&target) {
        Ok(about) if about.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(about) if !about.is_file() => Ok(()),
        Ok(about) if about.permissions().readonly() => {
            Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is read-only"))
        }
        _ => Temporary::create(&target).map(drop),
    }
}

/// Follows the links of a path to the file that it names, which need not exist; its folder must.
///
/// # Errors
/// Errors of the system, and too many links.
pub fn real_path(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..LINK_LIMIT {
        match fs::canonicalize(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            found => return found,
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")))?;
        let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        path = folder.join(name);
        match fs::read_link(&path) {
            Ok(link) => path = folder.join(link),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many symbolic links"))
}

/// Removes the temporary files of all replacements under way, then calls `end` before another replacement can begin.
pub fn abandon_replacements(end: impl FnOnce()) {
    let unfinished = unfinished();
    for path in unfinished.iter() {
        // It may have become the file itself meanwhile.
        fs::remove_file(path).unwrap_or(());
    }
    end();
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether a rename would lose hard links or the owner.
#[cfg(unix)]
fn keeps_inode(existing: &Metadata, temporary: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    existing.nlink() > 1 || (existing.uid(), existing.gid()) != (temporary.uid(), temporary.gid())
}

#[cfg(not(unix))]
fn keeps_inode(_: &Metadata, _: &Metadata) -> bool {
    false
}

/// A file that is removed unless it has taken the place of its target.
struct Temporary {
    path: PathBuf,
}

impl Temporary {
    fn create(target: &Path) -> io::Result<(Self, File)> {
        let mut unfinished = unfinished();
        loop {
            let path = PathBuf::from(unused_name(target));
            match File::options().read(true).write(true).create_new(true).open(&path) {
                // Left behind by a process of the same number that was killed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(file) => {
                    unfinished.push(path.clone());
                    return Ok((Self { path }, file));
                }
            }
        }
    }

    /// Copies the content into an existing file.
    fn copy_over(self, target: &Path) -> io::Result<()> {
        let copy = || {
            let mut file = File::options().write(true).truncate(true).open(target)?;
            io::copy(&mut File::open(&self.path)?, &mut file)?;
            file.sync_all()
        };
        copy().map_err(|error| {
            let kept = self.path.display().to_string();
            // The target may be cut off: the whole content stays.
            unfinished().retain(|path| *path != self.path);
            std::mem::forget(self);
            io::Error::new(error.kind(), format!("{error} (the whole content is in {kept})"))
        })
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        // After a rename there is none, and the error that matters is the caller's.
        fs::remove_file(&self.path).unwrap_or(());
        unfinished.retain(|path| *path != self.path);
    }
}

fn unused_name(target: &Path) -> OsString {
    static CALLS: AtomicU64 = AtomicU64::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let mut name = target.as_os_str().to_owned();
    name.push(format!(".{}-{call}.new", std::process::id()));
    name
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// An empty folder that is removed at the end.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("flqr-{name}-{}", std::process::id()));
            fs::create_dir_all(&folder).unwrap();
            Self(folder)
        }

        fn file(&self, name: &str) -> PathBuf {
            self.0.join(name)
        }

        fn count(&self) -> usize {
            fs::read_dir(&self.0).unwrap().count()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            fs::remove_dir_all(&self.0).unwrap_or(());
        }
    }

    fn replace(path: &Path, text: &str) -> io::Result<()> {
        replace_file(path, |file| file.write_all(text.as_bytes()))
    }

    #[test]
    fn concurrent_writers_leave_one_whole_text_and_no_other_file() {
        let folder = Folder::new("concurrent");
        let path = folder.file("model.toml");
        let texts: Vec<String> = (1..=4).map(|length| "x".repeat(length * 50_000)).collect();
        std::thread::scope(|scope| {
            for text in &texts {
                scope.spawn(|| (0..20).for_each(|_| replace(&path, text).unwrap()));
            }
        });
        assert!(texts.contains(&fs::read_to_string(&path).unwrap()));
        assert_eq!(folder.count(), 1, "nothing is left beside it");
    }

    #[test]
    fn a_failure_leaves_the_previous_content_and_no_other_file() {
        let folder = Folder::new("failure");
        let path = folder.file("log.csv");
        replace(&path, "old").unwrap();
        let failed = replace_file(&path, |file| {
            file.write_all(b"half of the new")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(failed.is_err());
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), folder.count()), ("old", 1));
        fs::create_dir_all(folder.file("target/inside")).unwrap();
        assert!(replace(&folder.file("target"), "text").is_err());
        assert!(replace(&folder.file("absent/log.csv"), "text").is_err());
        assert_eq!(folder.count(), 2);
    }

    #[test]
    fn a_check_finds_what_stands_in_the_way_and_leaves_nothing() {
        let folder = Folder::new("check");
        let [free, taken, locked] = ["free", "taken", "locked"].map(|name| folder.file(name));
        fs::write(&taken, "old").unwrap();
        check_replaceable(&free).unwrap();
        check_replaceable(&taken).unwrap();
        assert_eq!(fs::read_to_string(&taken).unwrap(), "old");
        fs::write(&locked, "old").unwrap();
        let mut read_only = fs::metadata(&locked).unwrap().permissions();
        read_only.set_readonly(true);
        fs::set_permissions(&locked, read_only).unwrap();
        for path in [&folder.0, &locked, &folder.file("absent/file"), &taken.join("file")] {
            assert!(check_replaceable(path).is_err(), "{}", path.display());
        }
        assert_eq!(folder.count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_modes_and_devices_stay_as_they_are() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
        let folder = Folder::new("links");
        let [target, link, dangling, twin] =
            ["target", "link", "dangling", "twin"].map(|name| folder.file(name));
        fs::write(&target, "old").unwrap();
        fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
        symlink("target", &link).unwrap();
        symlink("new", &dangling).unwrap();
        replace(&link, "through the link").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "through the link");
        assert_eq!(fs::metadata(&target).unwrap().mode() & 0o777, 0o640);
        replace(&dangling, "made").unwrap();
        assert!(fs::symlink_metadata(&dangling).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(folder.file("new")).unwrap(), "made");
        fs::hard_link(&target, &twin).unwrap();
        replace(&twin, "both").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "both");
        assert_eq!(fs::metadata(&target).unwrap().ino(), fs::metadata(&twin).unwrap().ino());
        let everything = fs::metadata("/dev/null").unwrap();
        replace(Path::new("/dev/null"), "gone").unwrap();
        assert_eq!(fs::metadata("/dev/null").unwrap().rdev(), everything.rdev());
        assert_eq!(folder.count(), 5, "nothing is left beside them");
        symlink("loop", folder.file("loop")).unwrap();
        assert!(replace(&folder.file("loop"), "text").is_err());
    }
}
