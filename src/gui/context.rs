//! Data that a view may read during one frame.

use std::path::Path;

use crate::command::{Commands, Source};
use crate::design::Designer;
use crate::history::History;
use crate::live::LiveStatus;
use crate::recent::Recent;
use crate::robot::Link;
use crate::session::Session;

/// Read access for views, and the way to ask for changes.
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
