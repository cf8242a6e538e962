//! Saving under a typed path: the form, the question before a file is replaced, writing on a worker.

use std::path::{Path, PathBuf};

use egui::{Button, Key, TextEdit, Ui};

use crate::job::{Job, Outcome, Reporter, Waker};
use crate::widgets::{choice_ui, error_ui, section_ui, warning_ui};
use crate::write_file::write_file;

/// What a page can save.
pub(crate) trait FileKind: Copy + Default + PartialEq + 'static {
    /// All of them, with their names and what the files hold.
    const ALL: &'static [(Self, &'static str, &'static str)];

    /// Ending of the file.
    fn extension(self) -> &'static str;
}

/// What a path's ending says is saved.
fn known_ending<K: FileKind>(path: &Path) -> Option<K> {
    let ending = path.extension()?.to_string_lossy().to_lowercase();
    K::ALL.iter().map(|(kind, ..)| *kind).find(|kind| kind.extension() == ending)
}

/// The ending follows what is saved; a name may have other points in it.
pub(crate) fn with_ending<K: FileKind>(path: PathBuf, kind: K) -> PathBuf {
    if known_ending::<K>(&path).is_some() {
        return path.with_extension(kind.extension());
    }
    let mut name = path.into_os_string();
    name.push(".");
    name.push(kind.extension());
    name.into()
}

/// Why a file was not written, and the mend.
pub(crate) fn not_saved(path: &Path, error: &std::io::Error) -> String {
    format!(
        "{} could not be saved: {error}; check the folder, its permissions and the space on the disk.",
        path.display()
    )
}

/// Files with what is to be in them.
pub(crate) type Files = Vec<(PathBuf, Vec<u8>)>;

/// How a job of saving ended.
#[derive(Debug)]
enum Saved {
    Written(Vec<PathBuf>),
    /// These files are there already; nothing was written.
    Exists(Vec<PathBuf>),
}

/// What is being written.
struct Writing<K> {
    kind: K,
    path: PathBuf,
    /// What has to be said of it.
    remark: Option<String>,
    job: Job<(), Result<Saved, String>>,
}

/// What was asked for and would replace files.
struct Overwrite<K> {
    kind: K,
    path: PathBuf,
    existing: Vec<PathBuf>,
}

/// How a page speaks of its form.
pub(crate) struct Words<K> {
    /// Name of the path's field, and its help.
    pub(crate) path: [&'static str; 2],
    /// The button that saves.
    pub(crate) save: fn(K) -> &'static str,
}

/// What the form asks for.
pub(crate) struct Asked<K> {
    /// Save to this path; replace what is there if true.
    pub(crate) save: Option<(K, PathBuf, bool)>,
    /// Ask for a path with a dialog.
    pub(crate) dialog: Option<K>,
}

/// Form and job.
#[derive(Default)]
pub(crate) struct SaveForm<K> {
    pub(crate) kind: K,
    pub(crate) problem: Option<String>,
    pub(crate) focus_path: bool,
    path: String,
    writing: Option<Writing<K>>,
    overwrite: Option<Overwrite<K>>,
    /// What was written last, and where to.
    written: Option<(K, PathBuf)>,
}

impl<K: FileKind> SaveForm<K> {
    pub(crate) fn is_busy(&self) -> bool {
        self.writing.is_some()
    }

    /// What has been written since this was asked last.
    pub(crate) fn take_written(&mut self) -> Option<(K, PathBuf)> {
        self.written.take()
    }

    /// Takes note of what is to be saved; the path with its ending.
    pub(crate) fn begin(&mut self, kind: K, path: PathBuf) -> PathBuf {
        let path = with_ending(path, kind);
        self.path = path.display().to_string();
        self.kind = kind;
        self.problem = None;
        self.overwrite = None;
        path
    }

    /// Writes what `files` makes on a worker; existing files are replaced only if `replace`.
    pub(crate) fn write(
        &mut self,
        (kind, path, replace): (K, PathBuf, bool),
        files: impl FnOnce(&Path) -> Result<Files, String> + Send + 'static,
        remark: Option<String>,
        waker: &Waker,
    ) -> Result<(), String> {
        if self.is_busy() {
            return Err("A file is still being written: try again when that has ended.".to_owned());
        }
        let asked = path.clone();
        let work = move |_: &Reporter<()>| write_all(files(&asked)?, replace);
        let job = Job::start("save", waker, work)
            .map_err(|error| format!("No thread to write the file: {error}."))?;
        self.writing = Some(Writing { kind, path, remark, job });
        Ok(())
    }

    /// A sentence when something was written, or could not be.
    pub(crate) fn drain(&mut self) -> Option<Result<String, String>> {
        let result = match self.writing.as_mut()?.job.poll().1 {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Writing the file failed: this is a defect of flqr.".to_owned()),
        };
        let Writing { kind, path, remark, .. } = self.writing.take()?;
        Some(match result {
            Ok(Saved::Written(paths)) => {
                self.written = Some((kind, path));
                let remark = remark.map(|remark| format!(" {remark}")).unwrap_or_default();
                Ok(format!("Saved {}.{remark}", listed(&paths)))
            }
            Ok(Saved::Exists(existing)) => {
                let verbs = if existing.len() == 1 { "exists and was" } else { "exist and were" };
                let message = format!("{} {verbs} not replaced.", listed(&existing));
                self.overwrite = Some(Overwrite { kind, path, existing });
                Ok(message)
            }
            Err(problem) => {
                self.problem = Some(problem.clone());
                Err(problem)
            }
        })
    }

    /// `hint` comes below the buttons; `busy` where the page is at work for a file of its own.
    pub(crate) fn ui(
        &mut self,
        words: &Words<K>,
        busy: bool,
        hint: impl FnOnce(&mut Ui, K),
        ui: &mut Ui,
    ) -> Asked<K> {
        section_ui(ui, "Save", |_| {});
        ui.horizontal_wrapped(|ui| {
            if choice_ui(ui, &mut self.kind, K::ALL) {
                self.overwrite = None;
                self.problem = None;
                if !self.path.trim().is_empty() {
                    let path = with_ending(self.path.trim().into(), self.kind);
                    self.path = path.display().to_string();
                }
            }
        });
        let entered = self.path_ui(words, ui);
        let mut asked = Asked { save: None, dialog: None };
        ui.horizontal_wrapped(|ui| {
            let ready = !self.path.trim().is_empty() && !self.is_busy() && !busy;
            let save = ui.add_enabled(ready, Button::new((words.save)(self.kind)));
            let save = save.on_hover_text("An existing file is replaced only after a question");
            if save.clicked() || (entered && ready) {
                asked.save = Some((self.kind, PathBuf::from(self.path.trim()), false));
            }
            if ui.button("Choose…").on_hover_text("Choose where to save").clicked() {
                asked.dialog = Some(self.kind);
            }
        });
        hint(ui, self.kind);
        if let Some(problem) = &self.problem {
            error_ui(ui, problem);
        }
        self.overwrite_ui(&mut asked, ui);
        asked
    }

    /// Whether a path was entered.
    fn path_ui(&mut self, words: &Words<K>, ui: &mut Ui) -> bool {
        let [name, help] = words.path;
        let field = TextEdit::singleline(&mut self.path)
            .hint_text(format!("path, .{}", self.kind.extension()))
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name(name);
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if std::mem::take(&mut self.focus_path) {
            field.request_focus();
        }
        if field.changed() {
            self.overwrite = None;
            self.problem = None;
            self.kind = known_ending(Path::new(self.path.trim())).unwrap_or(self.kind);
        }
        field.on_hover_text(help);
        entered
    }

    fn overwrite_ui(&mut self, asked: &mut Asked<K>, ui: &mut Ui) {
        let Some(Overwrite { kind, path, existing }) = self.overwrite.take() else { return };
        warning_ui(ui, format!("Replace {}?", listed(&existing)));
        let answer = ui.horizontal(|ui| {
            let replace = ui.button("Replace").on_hover_text("Replace what is there");
            (replace.clicked(), ui.button("Keep").on_hover_text("Leave what is there").clicked())
        });
        match answer.inner {
            (true, _) => asked.save = Some((kind, path, true)),
            (_, true) => {}
            _ => self.overwrite = Some(Overwrite { kind, path, existing }),
        }
    }
}

fn listed(paths: &[PathBuf]) -> String {
    let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

fn write_all(files: Files, replace: bool) -> Result<Saved, String> {
    let paths = files.iter().map(|(path, _)| path);
    let existing: Vec<_> = paths.filter(|path| path.symlink_metadata().is_ok()).cloned().collect();
    if !replace && !existing.is_empty() {
        return Ok(Saved::Exists(existing));
    }
    let mut written = Vec::new();
    for (path, content) in files {
        write_file(&path, &content).map_err(|error| not_saved(&path, &error))?;
        written.push(path);
    }
    Ok(Saved::Written(written))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::FigureKind;

    #[test]
    fn the_ending_is_that_of_what_is_saved() {
        for (name, kind, expected) in [
            ("a", FigureKind::Svg, "a.svg"),
            ("a.CSV", FigureKind::Png, "a.png"),
            ("a.svg", FigureKind::Svg, "a.svg"),
            ("v1.2", FigureKind::Csv, "v1.2.csv"),
        ] {
            assert_eq!(with_ending(name.into(), kind), PathBuf::from(expected));
        }
    }

    #[test]
    fn nothing_is_written_where_one_of_several_files_exists() {
        let folder = std::env::temp_dir().join(format!("flqr-save-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [first, second] = ["a.csv", "b.csv"].map(|name| folder.join(name));
        std::fs::write(&second, "precious").unwrap();
        let files = || vec![(first.clone(), b"1".to_vec()), (second.clone(), b"2".to_vec())];
        assert!(matches!(write_all(files(), false), Ok(Saved::Exists(paths)) if paths == [second.clone()]));
        assert!(!first.exists());
        assert!(matches!(write_all(files(), true), Ok(Saved::Written(paths)) if paths.len() == 2));
        assert_eq!(std::fs::read_to_string(&second).unwrap(), "2");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
