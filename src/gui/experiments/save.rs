//! Saving runs: as logs, as a picture of the page, as plots, as a report.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Context, Rect, TextEdit, Ui};
use flqr_core::record::write_log;

use super::report;
use super::runs::Comparison;
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::job::{Job, Outcome, Waker};
use crate::picture::Shot;
use crate::widgets::{choice_ui, error_ui, hint_ui, section_ui, warning_ui};
use crate::write_file::write_file;

/// What is saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum SavedAs {
    /// CSV, one file a run and, in the air, a motor.
    #[default]
    Logs,
    /// PNG of plots, robot and statistics as they are shown.
    Picture,
    /// SVG of the plots over the visible time.
    Plots,
    /// HTML with everything.
    Report,
}

impl SavedAs {
    const ALL: [Self; 4] = [Self::Logs, Self::Picture, Self::Plots, Self::Report];

    /// Ending of the file.
    pub(crate) fn extension(self) -> &'static str {
        match self {
            Self::Logs => "csv",
            Self::Picture => "png",
            Self::Plots => "svg",
            Self::Report => "html",
        }
    }

    /// Name for a dialog.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Logs => "Save the runs as logs",
            Self::Picture => "Save a picture of the page",
            Self::Plots => "Save the plots",
            Self::Report => "Save a report",
        }
    }
}

/// What is written, apart from the comparison.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// Of the statistics, s.
    pub(super) range_s: [f64; 2],
    /// Of the plots, s.
    pub(super) visible_s: [f64; 2],
}

/// How a job of saving ended.
#[derive(Debug)]
enum Saved {
    Written(Vec<PathBuf>),
    /// These files are there already; nothing was written.
    Exists(Vec<PathBuf>),
}

/// What was asked for and would replace files.
struct Overwrite {
    saved_as: SavedAs,
    path: PathBuf,
    existing: Vec<PathBuf>,
}

/// Form and jobs.
#[derive(Default)]
pub(super) struct Saver {
    pub(super) saved_as: SavedAs,
    path: String,
    shot: Option<(PathBuf, bool, Shot)>,
    job: Option<Job<(), Result<Saved, String>>>,
    /// What the running job would replace, and what it was asked with.
    asked: Option<(SavedAs, PathBuf)>,
    overwrite: Option<Overwrite>,
    pub(super) problem: Option<String>,
    pub(super) focus_path: bool,
}

impl Saver {
    fn is_busy(&self) -> bool {
        self.shot.is_some() || self.job.is_some()
    }

    /// Starts saving; an existing file is replaced only if `replace`.
    pub(super) fn start(
        &mut self,
        comparison: &Arc<Comparison>,
        extent: Extent,
        (saved_as, path, replace): (SavedAs, PathBuf, bool),
        page: Rect,
        ctx: &Context,
        waker: &Waker,
    ) -> Result<(), String> {
        if self.is_busy() {
            return Err("A file is still being written: try again when that has ended.".to_owned());
        }
        let path = with_ending(path, saved_as);
        self.path = path.display().to_string();
        self.saved_as = saved_as;
        self.problem = None;
        self.overwrite = None;
        self.asked = Some((saved_as, path.clone()));
        if saved_as == SavedAs::Picture {
            self.shot = Some((path, replace, Shot::ask(ctx, page)));
            return Ok(());
        }
        let comparison = Arc::clone(comparison);
        self.write(waker, replace, move || files(saved_as, &path, &comparison, extent))
    }

    fn write(
        &mut self,
        waker: &Waker,
        replace: bool,
        files: impl FnOnce() -> Result<Vec<(PathBuf, Vec<u8>)>, String> + Send + 'static,
    ) -> Result<(), String> {
        let job = Job::start("save-experiment", waker, move |_| write_all(files()?, replace));
        self.job = Some(job.map_err(|error| format!("No thread to write the file: {error}."))?);
        Ok(())
    }

    /// A sentence when something was written, or could not be.
    pub(super) fn drain(&mut self, waker: &Waker) -> Option<Result<String, String>> {
        if let Some((path, replace, shot)) = self.shot.take() {
            match shot.poll() {
                Some(Ok(picture)) => {
                    let png = move || Ok(vec![(path, picture.png()?)]);
                    if let Err(problem) = self.write(waker, replace, png) {
                        return Some(Err(problem));
                    }
                }
                Some(Err(problem)) => return Some(Err(problem)),
                None => self.shot = Some((path, replace, shot)),
            }
        }
        let result = match self.job.as_mut()?.poll().1 {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Writing the file failed: this is a defect of flqr.".to_owned()),
        };
        self.job = None;
        Some(match result {
            Ok(Saved::Written(paths)) => Ok(format!("Saved {}.", listed(&paths))),
            Ok(Saved::Exists(existing)) => {
                let verbs = if existing.len() == 1 { "exists and was" } else { "exist and were" };
                let message = format!("{} {verbs} not replaced.", listed(&existing));
                let asked = self.asked.take();
                self.overwrite = asked.map(|(saved_as, path)| Overwrite { saved_as, path, existing });
                Ok(message)
            }
            Err(problem) => {
                self.problem = Some(problem.clone());
                Err(problem)
            }
        })
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Save", |_| {});
        ui.scope(|ui| {
            let choices = [
                (SavedAs::Logs, "Logs", "CSV as every command reads it: one file a run"),
                (SavedAs::Picture, "Picture", "PNG of plots, robot and statistics as they are shown"),
                (SavedAs::Plots, "Plots", "SVG of the plots over the visible time"),
                (SavedAs::Report, "Report", "HTML with plots, statistics, model and commands"),
            ];
            ui.horizontal(|ui| {
                if choice_ui(ui, &mut self.saved_as, &choices) {
                    self.overwrite = None;
                    self.problem = None;
                    if !self.path.trim().is_empty() {
                        let path = with_ending(self.path.trim().into(), self.saved_as);
                        self.path = path.display().to_string();
                    }
                }
            });
        });
        let field = TextEdit::singleline(&mut self.path)
            .hint_text(format!("path, .{}", self.saved_as.extension()))
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("path to save to");
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if std::mem::take(&mut self.focus_path) {
            field.request_focus();
        }
        if field.changed() {
            self.overwrite = None;
            self.problem = None;
            self.saved_as = known_ending(Path::new(self.path.trim())).unwrap_or(self.saved_as);
        }
        field.on_hover_text("The ending says what is saved: .csv, .png, .svg or .html (Ctrl+L comes here)");
        ui.horizontal(|ui| self.buttons_ui(context, ui, entered));
        if self.saved_as == SavedAs::Logs {
            hint_ui(ui, "Names of the controllers are added to the file's name.");
        }
        if let Some(problem) = &self.problem {
            error_ui(ui, problem);
        }
        self.overwrite_ui(context, ui);
    }

    fn buttons_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui, entered: bool) {
        let ready = !self.path.trim().is_empty() && !self.is_busy();
        let save = ui.add_enabled(ready, egui::Button::new("Save runs"));
        let save =
            save.on_hover_text("Save to the path above; an existing file is replaced after a question");
        if save.clicked() || (entered && ready) {
            let path = PathBuf::from(self.path.trim());
            context.commands.send(Command::SaveExperiment { saved_as: self.saved_as, path, replace: false });
        }
        if ui.button("Choose…").on_hover_text("Choose where to save").clicked() {
            context.commands.send(Command::ShowDialog(FilePurpose::SaveExperiment(self.saved_as)));
        }
    }

    fn overwrite_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some(Overwrite { saved_as, path, existing }) = self.overwrite.take() else { return };
        warning_ui(ui, format!("Replace {}?", listed(&existing)));
        let answer = ui.horizontal(|ui| {
            let replace = ui.button("Replace").on_hover_text("Replace what is there");
            (replace.clicked(), ui.button("Keep").on_hover_text("Leave what is there").clicked())
        });
        match answer.inner {
            (true, _) => {
                context.commands.send(Command::SaveExperiment { saved_as, path, replace: true });
            }
            (_, true) => {}
            _ => self.overwrite = Some(Overwrite { saved_as, path, existing }),
        }
    }
}

fn listed(paths: &[PathBuf]) -> String {
    let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
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

/// What goes where.
fn files(
    saved_as: SavedAs,
    path: &Path,
    comparison: &Comparison,
    extent: Extent,
) -> Result<Vec<(PathBuf, Vec<u8>)>, String> {
    let one = |text: String| vec![(path.to_owned(), text.into_bytes())];
    Ok(match saved_as {
        SavedAs::Logs => logs(path, comparison)?,
        SavedAs::Plots => one(report::chart(comparison, extent.visible_s).to_svg()),
        SavedAs::Report => one(report::document(comparison, extent.range_s).to_html()),
        SavedAs::Picture => Vec::new(),
    })
}

fn logs(path: &Path, comparison: &Comparison) -> Result<Vec<(PathBuf, Vec<u8>)>, String> {
    let mut files = Vec::new();
    for (variant, run) in comparison.recorded() {
        for (suffix, log) in run.logs() {
            let mut text = Vec::new();
            if let Some(row) = comparison.provenance(variant) {
                text.extend_from_slice(format!("# {row}\n").as_bytes());
            }
            write_log(&log, &mut text).map_err(|error| format!("the log has no text: {error}"))?;
            files.push((log_path(path, variant.name(comparison.settings.scenario), suffix), text));
        }
    }
    Ok(files)
}

/// Where the log of a controller goes; the rest of the name may have points in it.
fn log_path(path: &Path, controller: &str, suffix: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{controller}{suffix}.csv"));
    path.with_file_name(name)
}

fn write_all(files: Vec<(PathBuf, Vec<u8>)>, replace: bool) -> Result<Saved, String> {
    let paths = files.iter().map(|(path, _)| path);
    let existing: Vec<_> = paths.filter(|path| path.symlink_metadata().is_ok()).cloned().collect();
    if !replace && !existing.is_empty() {
        return Ok(Saved::Exists(existing));
    }
    let mut written = Vec::new();
    for (path, content) in files {
        write_file(&path, &content).map_err(|error| {
            format!(
                "{} could not be saved: {error}; check the folder, its permissions and the space on the disk",
                path.display()
            )
        })?;
        written.push(path);
    }
    Ok(Saved::Written(written))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_is_that_of_what_is_saved() {
        for (name, expected) in [("a", "a.svg"), ("a.CSV", "a.svg"), ("a.svg", "a.svg"), ("a.v2", "a.v2.svg")]
        {
            assert_eq!(with_ending(name.into(), SavedAs::Plots), PathBuf::from(expected));
        }
    }

    #[test]
    fn every_log_has_a_file_of_its_own() {
        let parts = [("lqr", ""), ("flqr", ""), ("pi", "-left"), ("pi", "-right"), ("flqr", "-left")];
        for (name, stem) in [
            ("run", "run"),
            ("run.csv", "run"),
            ("run.txt", "run.txt"),
            ("trial.1", "trial.1"),
            ("v1.2.CSV", "v1.2"),
            ("a.csv.txt", "a.csv.txt"),
            (".csv", ".csv"),
            ("dot.", "dot."),
        ] {
            let path = with_ending(Path::new("/folder.d").join(name), SavedAs::Logs);
            let paths = parts.map(|(controller, suffix)| log_path(&path, controller, suffix));
            let different: std::collections::BTreeSet<_> = paths.iter().collect();
            assert_eq!(different.len(), parts.len(), "{paths:?}");
            assert_eq!(paths[0], PathBuf::from(format!("/folder.d/{stem}-lqr.csv")));
            assert_eq!(paths[3], PathBuf::from(format!("/folder.d/{stem}-pi-right.csv")));
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
