//! The pages of the window: their names, what each offers to the rest of the window, and the list of all.
//!
//! A new page is a module with a [`Page`], a variant of [`Tab`] with its row in the table, and a field of [`Pages`].

use std::fmt;
use std::path::PathBuf;

use egui::Ui;
use serde_json::Value;

use crate::command::FilePurpose;
use crate::context::ViewContext;
use crate::experiments::ExperimentsTab;
use crate::friction::FrictionTab;
use crate::job::Waker;
use crate::messages::{Messages, Said};
use crate::refine::RefineTab;
use crate::robot::RobotTab;
use crate::runs::RunsTab;
use crate::session::Session;
use crate::tune::TuneTab;

/// A page; also the key of its tile in the layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Tab {
    /// Weights, gains and the live robot.
    #[default]
    Tune,
    /// Friction from a measured log.
    Friction,
    /// Effects that the model lacks, from measured logs.
    Refine,
    /// The paper's experiments on the simulated robot.
    Experiments,
    /// A real robot: connection, health, arming, recording.
    Robot,
    /// The ledger of all runs.
    Runs,
    /// All messages since the start.
    Log,
}

impl Tab {
    /// All pages, in the order in which they are offered; the first nine have the keys 1 to 9.
    pub const ALL: [Self; 7] =
        [Self::Tune, Self::Friction, Self::Refine, Self::Experiments, Self::Robot, Self::Runs, Self::Log];

    fn about(self) -> &'static About {
        &ABOUT[self as usize]
    }

    /// Displayed name.
    pub fn title(self) -> &'static str {
        self.about().title
    }

    /// Describes the page.
    pub fn help(self) -> &'static str {
        self.about().help
    }

    /// Name for scripts and files.
    pub fn key(self) -> &'static str {
        self.about().key
    }

    /// The page that a file or a script names.
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tab| tab.key() == key)
    }

    /// Width below which a tile scrolls its page sideways.
    pub(crate) fn least_width(self) -> f32 {
        if self == Self::Log { 240.0 } else { 400.0 }
    }

    /// File and heading of the manual that describe the page.
    pub(crate) fn manual(self) -> Place {
        self.about().manual
    }
}

/// File and heading of the manual.
type Place = (&'static str, Option<&'static str>);

/// Description of a page.
struct About {
    key: &'static str,
    title: &'static str,
    help: &'static str,
    manual: Place,
}

/// In the order of [`Tab::ALL`].
const ABOUT: [About; Tab::ALL.len()] = [
    about("tune", "Tune", "Weights, gains and the live robot", ("design.md", None)),
    about("friction", "Friction", "Friction from a measured log", ("friction.md", None)),
    about("refine", "Refine", "Effects that the model lacks, from measured logs", ("refine.md", None)),
    about("experiments", "Experiments", "LQR and FLQR side by side in simulation", ("simulate.md", None)),
    about("robot", "Robot", "Connection, health, arming and recording of a robot", ("robot.md", None)),
    about("runs", "Runs", "All runs: overlay and comparison", ("window.md", Some("run-ledger"))),
    about("log", "Log", "All messages since the start", ("window.md", Some("messages"))),
];

const fn about(key: &'static str, title: &'static str, help: &'static str, manual: Place) -> About {
    About { key, title, help, manual }
}

/// A page of the window. It changes the rest of the window through the commands of its context only.
pub(crate) trait Page {
    /// Draws the page.
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui);

    /// Returns the state of the page for scripts; null if it has none.
    fn snapshot(&self, context: &ViewContext<'_>) -> Value;

    /// Returns the command line that does in a terminal what the page shows.
    ///
    /// # Errors
    /// A sentence with the reason if there is none.
    fn command_line(&self, context: &ViewContext<'_>) -> Result<String, String>;

    /// Takes the results of the threads of the page; returns messages about them.
    fn drain(&mut self) -> Vec<Said> {
        Vec::new()
    }

    /// Moves the focus to the path of a file; returns whether the page has one.
    fn focus_path(&mut self) -> bool {
        false
    }

    /// Returns the name that a file dialog of the page suggests.
    fn suggested_name(&self, _: FilePurpose) -> Option<String> {
        None
    }

    /// Shows a problem of a file dialog next to the field for its path.
    fn note_dialog_problem(&mut self, _: FilePurpose, _: &str) {}
}

/// Command of a page to itself or to another page. The rest of the window only passes it on.
pub(crate) trait PageCommand: fmt::Debug + Send + Sync {
    /// Applies the command.
    ///
    /// # Errors
    /// A sentence with the reason if it was not applied.
    fn apply(&self, pages: &mut Pages, around: Surroundings<'_>) -> Result<Done, String>;
}

/// Parts of the window available to the commands of pages.
pub(crate) struct Surroundings<'a> {
    pub(crate) session: &'a mut Session,
    /// The file that holds exactly the model of the session.
    pub(crate) model_path: Option<PathBuf>,
    pub(crate) waker: &'a Waker,
}

/// Requests of an applied command to the window.
#[derive(Default)]
pub(crate) struct Done {
    /// Message.
    pub(crate) said: Option<String>,
    /// Name of the undoable step, if the command changes the model.
    pub(crate) step: &'static str,
    /// Page to show.
    pub(crate) tab: Option<Tab>,
    /// Log for the list of recent files.
    pub(crate) log: Option<PathBuf>,
}

/// All pages.
pub(crate) struct Pages {
    pub(crate) tune: TuneTab,
    pub(crate) friction: FrictionTab,
    pub(crate) refine: RefineTab,
    pub(crate) experiments: ExperimentsTab,
    pub(crate) robot: RobotTab,
    pub(crate) runs: RunsTab,
    pub(crate) log: Messages,
}

impl Pages {
    /// All pages, in the order of [`Tab::ALL`].
    pub(crate) fn all(&self) -> [&dyn Page; Tab::ALL.len()] {
        [&self.tune, &self.friction, &self.refine, &self.experiments, &self.robot, &self.runs, &self.log]
    }

    /// All pages, in the order of [`Tab::ALL`].
    pub(crate) fn all_mut(&mut self) -> [&mut dyn Page; Tab::ALL.len()] {
        [
            &mut self.tune,
            &mut self.friction,
            &mut self.refine,
            &mut self.experiments,
            &mut self.robot,
            &mut self.runs,
            &mut self.log,
        ]
    }

    /// Takes the results of all threads, gives finished runs their rows in the ledger, and adds the messages to the log.
    pub(crate) fn drain(&mut self) {
        let said: Vec<Said> = self.all_mut().into_iter().flat_map(|page| page.drain()).collect();
        for (severity, text) in said {
            self.log.add(severity, text);
        }
        self.experiments.note_runs(&mut self.runs);
        self.friction.note_run(&mut self.runs);
        self.refine.note_run(&mut self.runs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_listed_in_one_order() {
        let numbers = Tab::ALL.map(|tab| tab as usize);
        assert!(numbers.into_iter().eq(0..ABOUT.len()), "{numbers:?}");
        let named = |tab: Tab| format!("{tab:?}").to_lowercase() == tab.key();
        assert!(Tab::ALL.into_iter().all(named));
    }
}
