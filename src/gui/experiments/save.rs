//! Saving runs: as logs, as a picture of the page, as plots, as a report.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Context, Rect, Ui};
use flqr_core::record::write_log;

use super::report;
use super::runs::Comparison;
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::job::Waker;
use crate::picture::Shot;
use crate::save_form::{FileKind, Layout, SaveForm, Target, Words};
use crate::widgets::hint_ui;
use crate::write_file::{Files, bytes};

/// Format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum SavedAs {
    /// CSV, one file a run and, in the air, a motor.
    #[default]
    Logs,
    /// PNG picture of the page.
    Picture,
    /// SVG of the plots in the visible range.
    Plots,
    /// HTML with everything.
    Report,
}

impl FileKind for SavedAs {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Logs, "Logs", "CSV logs, one file per run"),
        (Self::Picture, "Picture", "PNG picture of the page"),
        (Self::Plots, "Plots", "SVG of the plots in the visible range"),
        (Self::Report, "Report", "HTML with plots, statistics, model and commands"),
    ];

    fn extension(self) -> &'static str {
        match self {
            Self::Logs => "csv",
            Self::Picture => "png",
            Self::Plots => "svg",
            Self::Report => "html",
        }
    }
}

impl SavedAs {
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

/// Output options besides the comparison.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// Of the statistics, s.
    pub(super) range_s: [f64; 2],
    /// Of the plots, s.
    pub(super) visible_s: [f64; 2],
}

const WORDS: Words<SavedAs> = Words {
    path: ["path to save to", "The file extension selects the format: .csv, .png, .svg or .html (Ctrl+L)"],
    save: |_| "Save runs",
};

/// Starts saving.
pub(super) fn start(
    form: &mut SaveForm<SavedAs>,
    comparison: &Arc<Comparison>,
    extent: Extent,
    (saved_as, path, replace): Target<SavedAs>,
    page: Rect,
    ctx: &Context,
    waker: &Waker,
) -> Result<(), String> {
    let path = form.begin(saved_as, path);
    let target = (saved_as, path, replace);
    if saved_as == SavedAs::Picture {
        return form.write_picture(target, comparison.provenances(), Shot::ask(ctx, page), waker);
    }
    let comparison = Arc::clone(comparison);
    form.write(target, move |path| files(saved_as, path, &comparison, extent), None, waker)
}

pub(super) fn ui(form: &mut SaveForm<SavedAs>, context: &ViewContext<'_>, ui: &mut Ui) {
    let hint = |ui: &mut Ui, saved_as| {
        if saved_as == SavedAs::Logs {
            hint_ui(ui, "The controller names are appended to the file name.");
        }
    };
    let asked = form.ui(&WORDS, Layout::Column, hint, ui);
    if let Some((saved_as, path, replace)) = asked.save {
        context.commands.send(Command::SaveExperiment { saved_as, path, replace });
    }
    if let Some(saved_as) = asked.dialog {
        context.commands.send(Command::ShowDialog(FilePurpose::SaveExperiment(saved_as)));
    }
}

/// Output files.
fn files(saved_as: SavedAs, path: &Path, comparison: &Comparison, extent: Extent) -> Result<Files, String> {
    let one = |text: String| vec![(path.to_owned(), bytes(text))];
    Ok(match saved_as {
        SavedAs::Logs => logs(path, comparison)?,
        SavedAs::Plots => one(report::chart(comparison, extent.visible_s).to_svg()),
        SavedAs::Report => one(report::document(comparison, extent.range_s).to_html()),
        SavedAs::Picture => Vec::new(),
    })
}

fn logs(path: &Path, comparison: &Comparison) -> Result<Files, String> {
    let mut files = Vec::new();
    for (variant, run) in comparison.recorded() {
        for (suffix, log) in run.logs() {
            let mut text = Vec::new();
            if let Some(row) = comparison.provenance(variant) {
                text.extend_from_slice(format!("# {row}\n").as_bytes());
            }
            write_log(&log, &mut text).map_err(|error| format!("the log has no text: {error}"))?;
            files.push((log_path(path, variant.name(comparison.settings.scenario), suffix), bytes(text)));
        }
    }
    Ok(files)
}

/// Path of the log of a controller; the name may contain dots.
fn log_path(path: &Path, controller: &str, suffix: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{controller}{suffix}.csv"));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::save_form::with_ending;

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
}
