//! State of the window that pages may read.

use std::path::{Path, PathBuf};

use crate::command::{Commands, Source};
use crate::design::Designer;
use crate::history::History;
use crate::live::{Live, LiveStatus};
use crate::recent::Recent;
use crate::robot::Link;
use crate::session::Session;

/// State of the window apart from its pages and their layout.
pub(crate) struct AppState {
    pub(crate) session: Session,
    /// The session as loaded or saved last, for the mark of unsaved changes and for Reset.
    pub(crate) saved: Session,
    pub(crate) model_path: Option<PathBuf>,
    pub(crate) designer: Designer,
    pub(crate) source: Source,
    /// The simulated robot.
    pub(crate) live: Live,
    /// Data of the simulated robot.
    pub(crate) history: History,
    /// The connection to a robot.
    pub(crate) link: Link,
    pub(crate) recent: Recent,
    pub(crate) commands: Commands,
}

impl AppState {
    /// Returns the file that holds exactly the model of the session, if there is one.
    pub(crate) fn model_path_of_session(&self) -> Option<&Path> {
        self.model_path.as_deref().filter(|_| self.session == self.saved)
    }

    /// Returns the read access for views.
    pub(crate) fn context(&self) -> ViewContext<'_> {
        ViewContext {
            session: &self.session,
            model_path: self.model_path_of_session(),
            saved: &self.saved,
            designer: &self.designer,
            history: if self.source == Source::Simulated { &self.history } else { &self.link.history },
            live: &self.live.status,
            link: &self.link,
            recent: &self.recent,
            source: self.source,
            commands: &self.commands,
        }
    }
}

/// Read access for views, and the commands by which they change the window.
pub(crate) struct ViewContext<'a> {
    pub(crate) session: &'a Session,
    /// The file that holds the very model of the session.
    pub(crate) model_path: Option<&'a Path>,
    /// As it was loaded or saved last.
    pub(crate) saved: &'a Session,
    pub(crate) designer: &'a Designer,
    /// Of the chosen source.
    pub(crate) history: &'a History,
    pub(crate) live: &'a LiveStatus,
    pub(crate) link: &'a Link,
    pub(crate) recent: &'a Recent,
    pub(crate) source: Source,
    pub(crate) commands: &'a Commands,
}
