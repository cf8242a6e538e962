//! Files used lately and the column map, kept in the user's configuration folder.
//!
//! The file is a convenience: whatever is wrong with it, the program starts, with an empty list.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

const VERSION: u32 = 1;
const LONGEST_LIST: usize = 8;

/// Files used lately, newest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Recent {
    version: u32,
    /// Logs.
    pub(crate) logs: Vec<PathBuf>,
    /// Models.
    pub(crate) models: Vec<PathBuf>,
    /// The column map as typed last.
    pub(crate) column_map: String,
}

impl Recent {
    /// The list in `text`; empty when it is damaged or of another version.
    pub(crate) fn from_json(text: &str) -> Self {
        let read: Self = serde_json::from_str(text).unwrap_or_default();
        if read.version == VERSION { read } else { Self::default() }
    }

    /// The list for its file.
    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string_pretty(&Self { version: VERSION, ..self.clone() })
            .expect("paths that came from text and strings always have a JSON form")
    }

    pub(crate) fn note_log(&mut self, path: &Path) {
        note(&mut self.logs, path);
    }

    pub(crate) fn note_model(&mut self, path: &Path) {
        note(&mut self.models, path);
    }
}

fn note(list: &mut Vec<PathBuf>, path: &Path) {
    // A path that is not Unicode has no place in a JSON file.
    if path.to_str().is_none() {
        return;
    }
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    list.retain(|other| *other != path);
    list.insert(0, path);
    list.truncate(LONGEST_LIST);
}

/// Where the list is usually kept; none where the system names no folder for it.
pub(crate) fn default_file() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let config = if cfg!(windows) {
        folder("APPDATA")?
    } else if cfg!(target_os = "macos") {
        folder("HOME")?.join("Library/Application Support")
    } else {
        folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?
    };
    Some(config.join("flqr").join("recent.json"))
}

/// Writes by way of a second file, so that a crash leaves the old list or the new one.
pub(crate) fn write_file(path: &Path, text: &str) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    std::fs::write(&name, text)?;
    std::fs::rename(&name, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_or_newer_list_is_an_empty_one() {
        for text in ["", "{\"logs\": [", "[]", "{\"version\": 2, \"logs\": [\"a.csv\"]}", "\u{0}"] {
            assert_eq!(Recent::from_json(text), Recent::default(), "{text:?}");
        }
    }

    #[test]
    fn the_newest_comes_first_and_once() {
        let mut recent = Recent::default();
        for name in ["/a.csv", "/b.csv", "/a.csv"] {
            recent.note_log(Path::new(name));
        }
        assert_eq!(recent.logs, [PathBuf::from("/a.csv"), PathBuf::from("/b.csv")]);
        let read = Recent::from_json(&recent.to_json());
        assert_eq!(read.logs, recent.logs);
    }
}
