//! Requests of views, applied in one place, `App::logic`.

use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::Arc;

use flqr_core::control::ControllerKind;
use flqr_core::device::{SessionOrder, Source as DeviceSource};
use flqr_core::friction::{Compensation, Stribeck};
use flqr_core::model::{Effect, RobotParameters, Weights};

use crate::experiments::SavedAs;
use crate::layout::Side;
use crate::pages::{PageCommand, Tab};
use crate::plot::FigureFile;
use crate::refine::RefineFile;

/// Source of measured values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Source {
    /// The simulated robot.
    #[default]
    Simulated,
    /// A robot emulated in this program, behind the real bytes.
    Emulated,
    /// A robot on a CAN interface of the system.
    Can,
    /// A robot behind an SLCAN adapter.
    Slcan,
    /// A recording.
    Replay,
}

impl Source {
    /// All, in the order in which they are offered, with a word of help.
    pub(crate) const ALL: [(Self, &'static str, &'static str); 5] = [
        (Self::Simulated, "simulated", "Simulated robot in this program"),
        (Self::Emulated, "emulated", "Emulated robot with the real protocols, without hardware"),
        (Self::Can, "CAN", "A robot on a CAN interface of this system"),
        (Self::Slcan, "SLCAN", "A robot on a CAN adapter at a serial port"),
        (Self::Replay, "replay", "Replay of a recording, processed like live data"),
    ];

    /// Name for people.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// Name for scripts.
    pub(crate) fn key(self) -> String {
        self.name().to_lowercase()
    }
}

impl From<&DeviceSource> for Source {
    fn from(source: &DeviceSource) -> Self {
        match source {
            DeviceSource::Can { .. } => Self::Can,
            DeviceSource::Slcan { .. } => Self::Slcan,
            DeviceSource::Emulated => Self::Emulated,
            DeviceSource::Replay { .. } => Self::Replay,
        }
    }
}

/// Which motors a fitted curve goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Left,
    Right,
    Both,
}

/// Purpose of a file dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FilePurpose {
    OpenModel,
    SaveModel,
    OpenLog,
    SaveExperiment(SavedAs),
    OpenReplay,
    SaveRecording,
    OpenSession,
    SaveSession,
    Refine(RefineFile),
    SaveFigure(FigureFile),
}

/// One wish of a view.
#[derive(Clone, Debug)]
pub(crate) enum Command {
    SelectTab(Tab),
    /// Gives a page a separate tile, or takes it back to the others.
    MoveTab(Tab, Side),
    ResetLayout,
    SetDark(bool),
    SetZoom(f32),
    ShowPalette,
    /// Goes to the first weight.
    FocusWeights,
    /// Goes to the path of the log, or of what an experiment is saved to.
    FocusPath,
    /// Closes the window, after a question where something is not saved.
    Quit,
    /// Takes the torque off a robot.
    Stop,
    SelectSource(Source),
    SetWeights(Weights),
    /// Makes the other design of the comparison the one of now.
    KeepReference,
    /// The other design of the comparison comes into force, and the one of now is the other.
    SwapReference,
    /// Goes back to the weights of the other design.
    RestoreReference,
    /// Goes back to the weights of the loaded model.
    ResetWeights,
    SetParameters(RobotParameters),
    SetFriction([Option<Stribeck>; 2]),
    SetTorqueLimit(Option<f64>),
    SetCompensation(Compensation),
    /// Effects of the model.
    SetEffects(Vec<Effect>),
    SetController(ControllerKind),
    SetPaused(bool),
    ResetSimulation,
    Push {
        force_n: f64,
        duration_s: f64,
    },
    SetFrameInterval(std::time::Duration),
    ShowDialog(FilePurpose),
    /// A dialog, or a field for the path where the desktop has none.
    AskFile(FilePurpose),
    /// Loads a preset after a question that says what changes.
    LoadPreset(usize),
    TakePreset(usize),
    OpenSession(PathBuf),
    /// Saves all of the window to a session file; replaces what is there if `replace`, or asks.
    SaveSession {
        path: PathBuf,
        replace: bool,
    },
    Undo,
    Redo,
    ShowSteps,
    StartTour,
    /// Opens the manual at the description of the page in view.
    ShowManual,
    /// Copies the command that does in a terminal what the page shows.
    CopyLine,
    /// Copies what makes a run of the ledger again in a terminal.
    CopyLineOf(u64),
    LoadModel(PathBuf),
    /// Saves; a file other than the loaded one is replaced only after a question.
    SaveModel(PathBuf),
    /// Saves, whatever is there.
    OverwriteModel(PathBuf),
    LoadLog(PathBuf),
    CancelLoad,
    StartFit,
    CancelFit,
    UseFit(Target),
    StartExperiment,
    CancelExperiment,
    /// Saves the runs of the experiment; an existing file is replaced only if `replace`.
    SaveExperiment {
        saved_as: SavedAs,
        path: PathBuf,
        replace: bool,
    },
    /// Command of a page.
    Page(Arc<dyn PageCommand>),
    /// Looks for CAN interfaces and serial ports.
    RefreshInterfaces,
    /// Opens the session that the form of the robot page describes.
    Connect,
    Disconnect,
    /// Applies the design to the connected robot, after a question if its gains change much.
    ApplyGains,
    /// Same without a confirmation.
    ConfirmGains,
    /// True if a driven robot gets new gains as they change.
    FollowGains(bool),
    /// Stops the robot and closes the window.
    StopAndQuit,
    /// To the session with the robot.
    Order(SessionOrder),
    /// Chooses a recording to replay.
    ChooseReplay(PathBuf),
    /// Chooses the file to record to.
    ChooseRecording(PathBuf),
    /// Path of a figure, or the reason why there is none.
    ChooseFigure(FigureFile, Result<PathBuf, String>),
    /// One sentence for the status line.
    Say(String),
    /// Adds an error message.
    Complain(String),
}

impl<C: PageCommand + 'static> From<C> for Command {
    fn from(command: C) -> Self {
        Self::Page(Arc::new(command))
    }
}

/// Commands of this pass.
#[derive(Default)]
pub(crate) struct Commands(RefCell<Vec<Command>>);

impl Commands {
    pub(crate) fn send(&self, command: impl Into<Command>) {
        self.0.borrow_mut().push(command.into());
    }

    pub(crate) fn take(&self) -> Vec<Command> {
        self.0.take()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.borrow().is_empty()
    }
}
