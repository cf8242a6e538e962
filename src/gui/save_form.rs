//! Saving under a typed path: the form, the question before a file is replaced, writing on a worker.

use std::path::{Path, PathBuf};

use egui::{Button, Key, ProgressBar, RichText, TextEdit, Ui};

use crate::job::{Job, Outcome, Reporter, Waker};
use crate::picture::Shot;
use crate::widgets::{choice_ui, error_ui, section_ui, warning_ui};
use crate::write_file::{Files, Share, Written, bytes, write_files};

/// Formats that a page can save.
pub(crate) trait FileKind: Copy + Default + PartialEq + 'static {
    /// All of them, with their names and what the files hold.
    const ALL: &'static [(Self, &'static str, &'static str)];

    /// Ending of the file.
    fn extension(self) -> &'static str;
}

/// Format given by a file extension.
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

/// Format, path and permission to overwrite.
pub(crate) type Target<K> = (K, PathBuf, bool);

/// Running write.
struct Writing<K> {
    kind: K,
    path: PathBuf,
    /// Message about it.
    remark: Option<String>,
    share: Share,
    job: Job<Share, Result<Written, String>>,
}

/// A picture of the window that was requested.
struct Awaited<K> {
    target: Target<K>,
    /// Metadata of the picture.
    sources: Vec<String>,
    shot: Shot,
    waker: Waker,
}

/// Requested files that would be overwritten.
struct Overwrite<K> {
    kind: K,
    path: PathBuf,
    existing: Vec<PathBuf>,
}

/// Labels of a form.
pub(crate) struct Words<K> {
    /// Name of the path's field, and its help.
    pub(crate) path: [&'static str; 2],
    /// The button that saves.
    pub(crate) save: fn(K) -> &'static str,
}

/// Layout of a form.
pub(crate) enum Layout {
    /// In a column of a page, below a heading.
    Column,
    /// In a row above what is saved, after these words.
    Row(&'static str),
}

/// Requests of the form.
pub(crate) struct FormRequest<K> {
    pub(crate) save: Option<Target<K>>,
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
    awaited: Option<Awaited<K>>,
    writing: Option<Writing<K>>,
    overwrite: Option<Overwrite<K>>,
    /// Last written format and path.
    written: Option<(K, PathBuf)>,
}

impl<K: FileKind> SaveForm<K> {
    pub(crate) fn is_busy(&self) -> bool {
        self.awaited.is_some() || self.writing.is_some()
    }

    /// Files written since the last call.
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

    /// Writes what `files` makes on a worker; existing files are replaced only if the target says so.
    pub(crate) fn write(
        &mut self,
        target: Target<K>,
        files: impl FnOnce(&Path) -> Result<Files, String> + Send + 'static,
        remark: Option<String>,
        waker: &Waker,
    ) -> Result<(), String> {
        if self.is_busy() {
            return Err("A file is still being written. Try again when it is finished.".to_owned());
        }
        let (kind, path, replace) = target;
        let request = path.clone();
        let work = move |reporter: &Reporter<Share>| {
            write_files(files(&request)?, replace, &mut |share| reporter.progress(share))
        };
        let job = Job::start("save", waker, work)
            .map_err(|error| format!("Cannot start writing the file: {error}."))?;
        self.writing = Some(Writing { kind, path, remark, share: 0.0, job });
        Ok(())
    }

    /// Writes a picture of the window as soon as it has come.
    pub(crate) fn write_picture(
        &mut self,
        target: Target<K>,
        sources: Vec<String>,
        shot: Shot,
        waker: &Waker,
    ) -> Result<(), String> {
        if self.is_busy() {
            return Err("A file is still being written. Try again when it is finished.".to_owned());
        }
        self.awaited = Some(Awaited { target, sources, shot, waker: Waker::clone(waker) });
        Ok(())
    }

    /// A sentence when something was written, or could not be.
    pub(crate) fn drain(&mut self) -> Option<Result<String, String>> {
        let said = self.drain_picture().or_else(|| self.drain_job());
        if let Some(Err(problem)) = &said {
            self.problem = Some(problem.clone());
        }
        said
    }

    fn drain_picture(&mut self) -> Option<Result<String, String>> {
        let picture = self.awaited.as_ref()?.shot.poll()?;
        let Awaited { target, sources, waker, .. } = self.awaited.take()?;
        let written = picture.and_then(|picture| {
            let png = move |path: &Path| Ok(vec![(path.to_owned(), bytes(picture.png(&sources)?))]);
            self.write(target, png, None, &waker)
        });
        written.err().map(Err)
    }

    fn drain_job(&mut self) -> Option<Result<String, String>> {
        let writing = self.writing.as_mut()?;
        let (shares, outcome) = writing.job.poll();
        writing.share = shares.last().copied().unwrap_or(writing.share);
        let result = match outcome {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Writing the file failed: this is an internal error.".to_owned()),
        };
        let Writing { kind, path, remark, .. } = self.writing.take()?;
        Some(result.map(|written| match written {
            Written::All(paths) => {
                self.written = Some((kind, path));
                let remark = remark.map(|remark| format!(" {remark}")).unwrap_or_default();
                format!("Saved {}.{remark}", listed(&paths))
            }
            Written::NoneAsThereAre(existing) => {
                let verbs = if existing.len() == 1 { "exists and was" } else { "exist and were" };
                let message = format!("{} {verbs} not overwritten.", listed(&existing));
                self.overwrite = Some(Overwrite { kind, path, existing });
                message
            }
            Written::Cancelled => format!("Cancelled: {} was not written.", path.display()),
        }))
    }

    /// `more` comes after the buttons.
    pub(crate) fn ui(
        &mut self,
        words: &Words<K>,
        layout: Layout,
        more: impl FnOnce(&mut Ui, K),
        ui: &mut Ui,
    ) -> FormRequest<K> {
        let mut request = FormRequest { save: None, dialog: None };
        match layout {
            Layout::Column => {
                section_ui(ui, "Save", |_| {});
                ui.horizontal_wrapped(|ui| self.kind_ui(ui));
                let entered = self.path_ui(words, f32::INFINITY, ui);
                ui.horizontal_wrapped(|ui| self.buttons_ui(words, entered, &mut request, ui));
                more(ui, self.kind);
            }
            Layout::Row(title) => {
                ui.horizontal_wrapped(|ui| {
                    ui.label(title);
                    ui.scope(|ui| self.kind_ui(ui));
                    let entered = self.path_ui(words, 220.0, ui);
                    self.buttons_ui(words, entered, &mut request, ui);
                    more(ui, self.kind);
                });
            }
        }
        self.progress_ui(ui);
        if let Some(problem) = &self.problem {
            error_ui(ui, problem);
        }
        self.overwrite_ui(&mut request, ui);
        request
    }

    fn kind_ui(&mut self, ui: &mut Ui) {
        if choice_ui(ui, &mut self.kind, K::ALL) {
            self.overwrite = None;
            self.problem = None;
            if !self.path.trim().is_empty() {
                let path = with_ending(self.path.trim().into(), self.kind);
                self.path = path.display().to_string();
            }
        }
    }

    fn buttons_ui(&mut self, words: &Words<K>, entered: bool, request: &mut FormRequest<K>, ui: &mut Ui) {
        let ready = !self.path.trim().is_empty() && !self.is_busy();
        let save = ui.add_enabled(ready, Button::new((words.save)(self.kind)));
        let save = save.on_hover_text("You are asked before an existing file is overwritten");
        if save.clicked() || (entered && ready) {
            request.save = Some((self.kind, PathBuf::from(self.path.trim()), false));
        }
        if ui.button("Choose…").on_hover_text("Choose where to save").clicked() {
            request.dialog = Some(self.kind);
        }
    }

    /// Only what takes its time has progress.
    fn progress_ui(&self, ui: &mut Ui) {
        let Some(writing) = self.writing.as_ref().filter(|writing| writing.share > 0.0) else { return };
        ui.horizontal(|ui| {
            if ui.button("Cancel saving").on_hover_text("Stop writing; the partial file is deleted").clicked()
            {
                writing.job.cancel();
            }
            let text = format!("{}, {:.0} %", writing.path.display(), 100.0 * writing.share);
            ui.add(ProgressBar::new(writing.share).text(RichText::new(text).small()));
        });
    }

    /// Returns whether a path was entered.
    fn path_ui(&mut self, words: &Words<K>, width: f32, ui: &mut Ui) -> bool {
        let [name, help] = words.path;
        let field = TextEdit::singleline(&mut self.path)
            .hint_text(format!("path, .{}", self.kind.extension()))
            .desired_width(width);
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

    fn overwrite_ui(&mut self, request: &mut FormRequest<K>, ui: &mut Ui) {
        let Some(Overwrite { kind, path, existing }) = self.overwrite.take() else { return };
        warning_ui(ui, format!("Replace {}?", listed(&existing)));
        let answer = ui.horizontal(|ui| {
            let replace = ui.button("Replace").on_hover_text("Overwrite");
            (replace.clicked(), ui.button("Keep").on_hover_text("Do not overwrite").clicked())
        });
        match answer.inner {
            (true, _) => request.save = Some((kind, path, true)),
            (_, true) => {}
            _ => self.overwrite = Some(Overwrite { kind, path, existing }),
        }
    }
}

fn listed(paths: &[PathBuf]) -> String {
    let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
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
}
