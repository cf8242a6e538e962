//! Saving the report and the refined model.

use std::path::{Path, PathBuf};

use egui::{TextEdit, Ui};

use super::command::{RefineCommand, RefineFile};
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::job::{Job, Outcome, Waker};
use crate::widgets::{choice_ui, error_ui, section_ui, warning_ui};
use crate::write_file::write_file;

/// What is saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum SavedAs {
    /// HTML with tables and figures.
    #[default]
    Report,
    /// TOML.
    Model,
}

impl SavedAs {
    const ALL: [Self; 2] = [Self::Report, Self::Model];

    /// Ending of the file.
    pub(crate) fn extension(self) -> &'static str {
        match self {
            Self::Report => "html",
            Self::Model => "toml",
        }
    }

    /// Name for a dialog.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Report => "Save the report",
            Self::Model => "Save the refined model",
        }
    }
}

enum Saved {
    Written,
    /// There is a file already; nothing was written.
    Exists,
}

struct Writing {
    saved_as: SavedAs,
    path: PathBuf,
    /// What has to be said of what is written.
    remark: Option<String>,
    job: Job<(), Result<Saved, String>>,
}

/// Form and job.
#[derive(Default)]
pub(super) struct Saver {
    saved_as: SavedAs,
    path: String,
    writing: Option<Writing>,
    /// What was asked for and would replace a file.
    overwrite: Option<(SavedAs, PathBuf)>,
    pub(super) problem: Option<String>,
}

impl Saver {
    /// Starts writing what `content` makes on the worker; an existing file is replaced only if `replace`.
    pub(super) fn start(
        &mut self,
        (saved_as, path, replace): (SavedAs, PathBuf, bool),
        content: impl FnOnce() -> String + Send + 'static,
        remark: Option<String>,
        waker: &Waker,
    ) -> Result<(), String> {
        if self.writing.is_some() {
            return Err("A file is still being written: try again when that has ended.".to_owned());
        }
        let path = with_ending(path, saved_as);
        self.path = path.display().to_string();
        self.saved_as = saved_as;
        self.problem = None;
        self.overwrite = None;
        let file = path.clone();
        let write = move |_: &crate::job::Reporter<()>| {
            if !replace && file.symlink_metadata().is_ok() {
                return Ok(Saved::Exists);
            }
            write_file(&file, content().as_bytes()).map(|()| Saved::Written).map_err(|error| {
                format!("{} could not be saved: {error}; nothing was changed", file.display())
            })
        };
        let job = Job::start("save-refined", waker, write)
            .map_err(|error| format!("No thread to write the file: {error}."))?;
        self.writing = Some(Writing { saved_as, path, remark, job });
        Ok(())
    }

    /// A sentence when something was written, or could not be.
    pub(super) fn drain(&mut self) -> Option<Result<String, String>> {
        let result = match self.writing.as_mut()?.job.poll().1 {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Writing the file failed: this is a defect of flqr".to_owned()),
        };
        let Writing { saved_as, path, remark, .. } = self.writing.take()?;
        Some(match result {
            Ok(Saved::Written) => {
                let remark = remark.map(|remark| format!(" {remark}")).unwrap_or_default();
                Ok(format!("Saved {}.{remark}", path.display()))
            }
            Ok(Saved::Exists) => {
                let text = format!("{} exists and was not replaced.", path.display());
                self.overwrite = Some((saved_as, path));
                Ok(text)
            }
            Err(problem) => {
                self.problem = Some(problem.clone());
                Err(format!("{problem}."))
            }
        })
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Save", |_| {});
        ui.horizontal(|ui| {
            let choices = [
                (SavedAs::Report, "Report", "HTML with tables and figures, in one file"),
                (SavedAs::Model, "Model", "TOML with the effects that are ticked"),
            ];
            if choice_ui(ui, &mut self.saved_as, &choices) {
                self.overwrite = None;
                self.problem = None;
                if !self.path.trim().is_empty() {
                    let path = with_ending(self.path.trim().into(), self.saved_as);
                    self.path = path.display().to_string();
                }
            }
        });
        let field = TextEdit::singleline(&mut self.path)
            .hint_text(format!("path, .{}", self.saved_as.extension()))
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("path to save what was found to");
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if field.changed() {
            self.overwrite = None;
            self.problem = None;
            self.saved_as = known_ending(Path::new(self.path.trim())).unwrap_or(self.saved_as);
        }
        field.on_hover_text("The ending says what is saved: .html or .toml");
        ui.horizontal(|ui| {
            let ready = !self.path.trim().is_empty() && self.writing.is_none();
            let name = match self.saved_as {
                SavedAs::Report => "Save report",
                SavedAs::Model => "Save model",
            };
            let save = ui.add_enabled(ready, egui::Button::new(name));
            let save = save.on_hover_text("An existing file is replaced only after a question");
            if save.clicked() || (entered && ready) {
                let path = PathBuf::from(self.path.trim());
                let save = RefineCommand::Save { saved_as: self.saved_as, path, replace: false };
                context.commands.send(Command::Refine(save));
            }
            if ui.button("Choose…").on_hover_text("Choose where to save").clicked() {
                let purpose = FilePurpose::Refine(RefineFile::Save(self.saved_as));
                context.commands.send(Command::ShowDialog(purpose));
            }
        });
        if let Some(problem) = &self.problem {
            error_ui(ui, problem);
        }
        self.overwrite_ui(context, ui);
    }

    fn overwrite_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some((saved_as, path)) = self.overwrite.take() else { return };
        warning_ui(ui, format!("Replace {}?", path.display()));
        let (replace, keep) = ui
            .horizontal(|ui| {
                let replace = ui.button("Replace").on_hover_text("Replace what is there");
                (replace.clicked(), ui.button("Keep").on_hover_text("Leave what is there").clicked())
            })
            .inner;
        if replace {
            context.commands.send(Command::Refine(RefineCommand::Save { saved_as, path, replace: true }));
        } else if !keep {
            self.overwrite = Some((saved_as, path));
        }
    }
}

/// What a path's ending says is saved.
fn known_ending(path: &Path) -> Option<SavedAs> {
    let ending = path.extension()?.to_string_lossy().to_lowercase();
    SavedAs::ALL.into_iter().find(|saved_as| saved_as.extension() == ending)
}

/// The ending follows what is saved; a name may have other points in it.
fn with_ending(path: PathBuf, saved_as: SavedAs) -> PathBuf {
    if known_ending(&path).is_some() {
        return path.with_extension(saved_as.extension());
    }
    let mut name = path.into_os_string();
    name.push(".");
    name.push(saved_as.extension());
    name.into()
}
