//! Saving the report and the refined model.

use egui::Ui;

use super::command::{RefineCommand, RefineFile};
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::save_form::{FileKind, Layout, SaveForm, Words};

/// Format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum SavedAs {
    /// HTML with tables and figures.
    #[default]
    Report,
    /// TOML.
    Model,
}

impl FileKind for SavedAs {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Report, "Report", "HTML with tables and figures, in one file"),
        (Self::Model, "Model", "TOML with the selected effects"),
    ];

    fn extension(self) -> &'static str {
        match self {
            Self::Report => "html",
            Self::Model => "toml",
        }
    }
}

impl SavedAs {
    /// Name for a dialog.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Report => "Save the report",
            Self::Model => "Save the refined model",
        }
    }
}

const WORDS: Words<SavedAs> = Words {
    path: ["path to save the results to", "The file extension selects the format: .html or .toml"],
    save: |saved_as| match saved_as {
        SavedAs::Report => "Save report",
        SavedAs::Model => "Save model",
    },
};

pub(super) fn ui(form: &mut SaveForm<SavedAs>, context: &ViewContext<'_>, ui: &mut Ui) {
    let asked = form.ui(&WORDS, Layout::Column, |_, _| {}, ui);
    if let Some((saved_as, path, replace)) = asked.save {
        context.commands.send(RefineCommand::Save { saved_as, path, replace });
    }
    if let Some(saved_as) = asked.dialog {
        let purpose = FilePurpose::Refine(RefineFile::Save(saved_as));
        context.commands.send(Command::ShowDialog(purpose));
    }
}
