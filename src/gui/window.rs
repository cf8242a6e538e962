//! Opening the window, and one clear sentence when that cannot be done.

use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use flqr_core::device::{SerialAddress, Source};
use flqr_core::model::Model;
use flqr_core::record::Mapping;

use crate::app::App;
use crate::memory::keep_freed_memory;
use crate::pages::Tab;
use crate::robot::{Devices, System};

/// Start options of the window.
#[derive(Clone, Debug)]
pub struct WindowOptions {
    /// The model to begin with.
    pub model: Model,
    /// Path of the model, used by "Save".
    pub model_path: Option<PathBuf>,
    /// A log to load at once.
    pub log: Option<PathBuf>,
    /// Column map for logs.
    pub column_map: Vec<Mapping>,
    /// The tab to begin with.
    pub tab: Tab,
    /// A robot to connect to at once, listening only.
    pub source: Option<Source>,
    /// The IMU of a robot on CAN.
    pub imu: Option<SerialAddress>,
    /// Opens robots.
    pub devices: Arc<dyn Devices>,
    /// True if the simulated robot starts paused.
    pub paused: bool,
    /// A file that always holds what the window shows, as JSON.
    pub state_out: Option<PathBuf>,
    /// Path of the list of recent files; without it, the list is not saved.
    pub recent_file: Option<PathBuf>,
    /// A session file to open.
    pub session: Option<PathBuf>,
    /// Folder where the running session is kept; without one it is not kept.
    pub state_folder: Option<PathBuf>,
    /// Message at start.
    pub warning: Option<String>,
    /// True if the tour may begin, if it was never seen.
    pub tour: bool,
}

impl WindowOptions {
    /// A window on `model` with everything else as usual.
    pub fn new(model: Model) -> Self {
        Self {
            model,
            model_path: None,
            log: None,
            column_map: Vec::new(),
            tab: Tab::Tune,
            source: None,
            imu: None,
            devices: Arc::new(System),
            paused: false,
            state_out: None,
            recent_file: crate::recent::default_file(),
            session: None,
            state_folder: None,
            warning: None,
            tour: false,
        }
    }
}

/// Reason why there is no window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WindowError {
    /// No display, or one without OpenGL.
    NoDisplay {
        /// Message of the system.
        reason: String,
    },
    /// A library of the window system is missing.
    MissingLibrary {
        /// Message of the system.
        reason: String,
    },
    /// The last connection to a robot ended with a problem, such as motors that have not confirmed that they are off.
    Robot {
        /// The problem and its remedy.
        problem: String,
    },
}

impl std::fmt::Display for WindowError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Robot { problem } => f.write_str(problem),
            Self::NoDisplay { reason } => write!(
                f,
                "the window needs a display with OpenGL, which is not available ({reason}): without it, use `flqr gains`, `flqr fit`, `flqr simulate`, `flqr riccati` or `flqr export`"
            ),
            Self::MissingLibrary { reason } => write!(
                f,
                "the window could not be opened because a library is missing ({reason}); on Debian or Ubuntu install {PACKAGES}, or use `flqr gains`, `flqr fit`, `flqr simulate`, `flqr riccati` or `flqr export`, which do not need it"
            ),
        }
    }
}

impl std::error::Error for WindowError {}

/// Run-time packages for a minimal Debian 12.
const PACKAGES: &str = "libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 libgl1";

const ICON: &[u8] = include_bytes!("../../assets/icon.png");

/// Opens the window and returns when it is closed.
///
/// # Errors
/// No display, no OpenGL, a missing library of the window system, or a problem at the end of the last connection to a
/// robot.
pub fn run(options: WindowOptions) -> Result<(), WindowError> {
    check_display()?;
    keep_freed_memory();
    // The window library panics, instead of returning an error, where a library is missing.
    let quiet = std::panic::take_hook();
    let opening = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
    install_hook(quiet, &opening);
    let end_problem = Rc::default();
    let show = || open(options, &opening, &end_problem);
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(show));
    match result {
        Ok(Ok(())) => end_problem.take().map_or(Ok(()), |problem| Err(WindowError::Robot { problem })),
        Ok(Err(error)) => Err(WindowError::NoDisplay { reason: last_cause(&error.to_string()) }),
        Err(payload) if opening.load(std::sync::atomic::Ordering::Relaxed) => {
            Err(WindowError::MissingLibrary { reason: one_line(panic_text(&*payload)) })
        }
        Err(payload) => std::panic::resume_unwind(payload),
    }
}

type Hook = Box<dyn Fn(&std::panic::PanicHookInfo<'_>) + Send + Sync>;

/// Panics while the window opens become an error; later ones are reported as usual.
fn install_hook(usual: Hook, opening: &std::sync::Arc<std::sync::atomic::AtomicBool>) {
    let opening = std::sync::Arc::clone(opening);
    std::panic::set_hook(Box::new(move |info| {
        if !opening.load(std::sync::atomic::Ordering::Relaxed) {
            usual(info);
        }
    }));
}

fn open(
    options: WindowOptions,
    opening: &std::sync::atomic::AtomicBool,
    end_problem: &Rc<RefCell<Option<String>>>,
) -> eframe::Result {
    let mut viewport = egui::ViewportBuilder::default()
        .with_title("flqr")
        .with_app_id("flqr")
        .with_inner_size([1240.0, 720.0])
        .with_min_inner_size([480.0, 320.0])
        .with_drag_and_drop(true);
    if let Ok(icon) = eframe::icon_data::from_png_bytes(ICON) {
        viewport = viewport.with_icon(icon);
    }
    let native = eframe::NativeOptions {
        viewport,
        centered: true,
        persist_window: false,
        system_font_fallback: false,
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    eframe::run_native(
        "flqr",
        native,
        Box::new(|creation| {
            opening.store(false, std::sync::atomic::Ordering::Relaxed);
            let mut app = App::new(options, &creation.egui_ctx)?;
            app.end_problem = Rc::clone(end_problem);
            Ok(Box::new(app))
        }),
    )
}

#[cfg(all(unix, not(target_os = "macos")))]
fn check_display() -> Result<(), WindowError> {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    if set("DISPLAY") || set("WAYLAND_DISPLAY") || set("WAYLAND_SOCKET") {
        return Ok(());
    }
    Err(WindowError::NoDisplay { reason: "neither DISPLAY nor WAYLAND_DISPLAY is set".to_owned() })
}

#[cfg(not(all(unix, not(target_os = "macos"))))]
fn check_display() -> Result<(), WindowError> {
    Ok(())
}

/// The window library puts its source files before what the system said.
fn last_cause(text: &str) -> String {
    let line = one_line(text);
    line.rsplit(": ").next().unwrap_or_default().to_owned()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn panic_text(payload: &(dyn std::any::Any + Send)) -> &str {
    payload
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("no reason given")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_is_what_the_system_said() {
        let text = "winit EventLoopError: os error at a/b.rs:788: Failed to open connection to X server";
        assert_eq!(last_cause(text), "Failed to open connection to X server");
    }

    #[test]
    fn an_error_names_the_commands_that_work_and_the_packages() {
        let no_display = WindowError::NoDisplay { reason: "DISPLAY is not set".to_owned() }.to_string();
        for command in ["gains", "fit", "simulate", "riccati", "export"] {
            assert!(no_display.contains(&format!("flqr {command}")), "{no_display}");
        }
        let library = WindowError::MissingLibrary { reason: "libxkbcommon-x11".to_owned() }.to_string();
        assert!(library.contains("libxkbcommon-x11-0 libgl1"));
    }
}
