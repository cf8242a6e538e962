//! Files that commands write.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::output::Failure;

/// Writes a file whole; `what` names it in the message of a failure. See [`replace`].
pub(crate) fn write(
    path: &Path,
    what: &str,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Failure> {
    replace(path, content).map_err(|error| {
        Failure::Message(format!(
            "{}: cannot write the {what}: {error}: check the folder, its permissions and the space on the disk",
            path.display()
        ))
    })
}

/// Writes by way of a second file, so that a failure leaves what was there. Devices and pipes, which a
/// rename would replace, are written to directly.
fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let fill = |target: &Path| {
        let mut file = BufWriter::new(File::create(target)?);
        write(&mut file)?;
        file.flush()
    };
    if path.metadata().is_ok_and(|about| !about.is_file()) {
        return fill(path);
    }
    let mut beside = path.as_os_str().to_owned();
    beside.push(format!(".{}.new", std::process::id()));
    let beside = Path::new(&beside);
    let done = fill(beside).and_then(|()| fs::rename(beside, path));
    if done.is_err() {
        // There may be no such file; the error that matters is the first one.
        fs::remove_file(beside).unwrap_or(());
    }
    done
}
