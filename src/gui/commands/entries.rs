//! Commands.

use std::borrow::Cow;

use egui::{Key, KeyboardShortcut, Modifiers};
use flqr_core::control::ControllerKind;
use flqr_core::device::SessionOrder;
use flqr_core::model_file::presets;

use super::{Entry, Menu, Sent, Situation};
use crate::command::{Command, FilePurpose, Source, Target};
use crate::layout::Side;
use crate::pages::Tab;
use crate::plot::{FigureFile, FigureKind};
use crate::refine::{Question, RefineCommand, RefineFile, SavedAs};
use crate::runs::RunsCommand;

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

const fn ctrl_shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key)
}

/// Keys that stop a robot; they take precedence over everything else, even in a text field.
pub(crate) const STOP_KEYS: [Key; 2] = [Key::Escape, Key::Space];

/// Pointer and key gestures for the list of keys.
pub(crate) const GESTURES: &[(&str, &str)] = &[
    ("Esc, Space", "STOP the robot: no torque, motors off"),
    ("Space, ←, →", "play or step an experiment (Shift: longer, Alt: shorter steps)"),
    ("Tab, Shift+Tab", "next, previous control"),
    ("drag, ←, → of a weight", "1.5 % per point or key press, 0.15 % with Shift"),
    ("drag, wheel, double click", "pan, zoom, follow (plots)"),
    ("drag a tab", "move a page to another tile (if there are several)"),
];

const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];

type Text = Cow<'static, str>;

fn entry(
    menu: Menu,
    id: impl Into<Text>,
    name: impl Into<Text>,
    help: impl Into<Text>,
    keys: &[KeyboardShortcut],
    send: impl Fn(&Situation<'_>) -> Sent + Send + Sync + 'static,
) -> Entry {
    Entry {
        id: id.into(),
        menu,
        name: name.into(),
        help: help.into(),
        also: "",
        group: None,
        keys: keys.to_vec(),
        send: Box::new(send),
    }
}

/// All commands, in the order of the menus.
pub(super) fn all() -> Vec<Entry> {
    [file(), preset(), edit(), view(), run(), help()].into_iter().flatten().collect()
}

fn file() -> Vec<Entry> {
    let dialog = |purpose| move |_: &Situation<'_>| Ok(Command::AskFile(purpose));
    let menu = Menu::File;
    vec![
        entry(
            menu,
            "open",
            "Open…",
            "Opens a model, a log or a recording, depending on the page",
            &[ctrl(Key::O)],
            |s| {
                Ok(Command::AskFile(match s.tab {
                    Tab::Robot if s.source == Source::Replay => FilePurpose::OpenReplay,
                    Tab::Friction => FilePurpose::OpenLog,
                    Tab::Refine => FilePurpose::Refine(RefineFile::Log),
                    _ => FilePurpose::OpenModel,
                }))
            },
        ),
        entry(
            menu,
            "open-model",
            "Open a model…",
            "Robot or axis model, TOML",
            &[],
            dialog(FilePurpose::OpenModel),
        ),
        entry(menu, "open-log", "Open a log…", "Measured log, CSV", &[], dialog(FilePurpose::OpenLog))
            .also("csv import measurement load"),
        entry(
            menu,
            "open-recording",
            "Open a recording to replay…",
            "Replay rows or frames of a recording like live data",
            &[],
            dialog(FilePurpose::OpenReplay),
        ),
        entry(menu, "save", "Save the model", "Save to its file, or to a new one", &[ctrl(Key::S)], |s| {
            Ok(match s.model_path {
                Some(path) => Command::SaveModel(path.to_owned()),
                None => Command::AskFile(FilePurpose::SaveModel),
            })
        }),
        entry(
            menu,
            "save-as",
            "Save the model as…",
            "Save to a new file",
            &[ctrl_shift(Key::S)],
            dialog(FilePurpose::SaveModel),
        ),
        entry(
            menu,
            "open-session",
            "Open a session…",
            "Restore model, layout, sources and forms",
            &[],
            dialog(FilePurpose::OpenSession),
        )
        .also("project workspace layout load"),
        entry(
            menu,
            "save-session",
            "Save the session as…",
            "Save model, layout, sources and forms in one file",
            &[],
            dialog(FilePurpose::SaveSession),
        )
        .also("project workspace layout"),
        entry(
            menu,
            "export-csv",
            "Export the plots of this page as CSV…",
            "The samples of the visible range",
            &[],
            |s| export(s, FigureKind::Csv),
        )
        .also("save data samples"),
        entry(
            menu,
            "export-figure",
            "Export the plots of this page as a figure…",
            "The visible range as SVG, or as PNG",
            &[],
            |s| export(s, FigureKind::Svg),
        )
        .also("save picture plot svg png"),
        entry(
            menu,
            "save-report",
            "Save the refine report…",
            "Results of the Refine page as HTML",
            &[],
            dialog(FilePurpose::Refine(RefineFile::Save(SavedAs::Report))),
        )
        .also("refine export html"),
        entry(
            menu,
            "save-refined",
            "Save the refined model…",
            "Model with the effects selected on the Refine page, TOML",
            &[],
            dialog(FilePurpose::Refine(RefineFile::Save(SavedAs::Model))),
        )
        .also("refine export toml"),
        entry(
            menu,
            "quit",
            "Quit",
            "Close the window; asks first if the model is unsaved or the robot is being driven",
            &[ctrl(Key::Q)],
            |_| Ok(Command::Quit),
        )
        .also("exit close"),
    ]
}

fn preset() -> Vec<Entry> {
    let of = |(number, (name, _)): (usize, &(&'static str, &'static str))| {
        entry(
            Menu::Presets,
            format!("preset-{name}"),
            format!("Load the preset “{name}”"),
            "A model that comes with the program",
            &[],
            move |_| Ok(Command::LoadPreset(number)),
        )
    };
    presets::ALL.iter().enumerate().map(of).collect()
}

fn edit() -> Vec<Entry> {
    const NO_ROBOT: &str = "the model is a single axis";
    let menu = Menu::Edit;
    let of_robot = |command: Command| {
        move |s: &Situation<'_>| if s.has_robot { Ok(command.clone()) } else { Err(NO_ROBOT) }
    };
    vec![
        entry(menu, "undo", "Undo", "Undo the last step", &[ctrl(Key::Z)], |s| {
            if s.can_undo { Ok(Command::Undo) } else { Err("there is nothing to undo") }
        }),
        entry(menu, "redo", "Redo", "Redo the last undone step", &[ctrl_shift(Key::Z), ctrl(Key::Y)], |s| {
            if s.can_redo { Ok(Command::Redo) } else { Err("there is nothing to redo") }
        }),
        entry(
            menu,
            "copy-command",
            "Copy as a command",
            "Copy the command line that does what this page shows",
            &[],
            |s| {
                if s.tab == Tab::Log {
                    Err("there is no command for this page")
                } else {
                    Ok(Command::CopyLine)
                }
            },
        ),
        entry(menu, "steps", "Steps…", "List of all undoable steps", &[], |_| Ok(Command::ShowSteps))
            .also("history"),
        entry(
            menu,
            "weights",
            "Go to the first weight",
            "Focus the field of the first weight",
            &[ctrl(Key::E)],
            of_robot(Command::FocusWeights),
        ),
        entry(
            menu,
            "path",
            "Go to the path",
            "Focus the path of the log, or of the file to save",
            &[ctrl(Key::L)],
            |_| Ok(Command::FocusPath),
        ),
        entry(
            menu,
            "reset-weights",
            "Reset the weights",
            "Restore the weights of the loaded model",
            &[],
            of_robot(Command::ResetWeights),
        ),
        entry(
            menu,
            "keep-a",
            "Swap designs A and B",
            "Make the other design of A and B active",
            &[],
            of_robot(Command::KeepReference),
        ),
        entry(menu, "swap-designs", "Swap A and B", "Make the other design active", &[], |s| {
            if s.has_reference { Ok(Command::SwapReference) } else { Err("there is no other design yet") }
        }),
        entry(
            menu,
            "back-to-a",
            "Back to the other design",
            "Copy the weights of the other design",
            &[],
            |s| {
                if s.has_reference {
                    Ok(Command::RestoreReference)
                } else {
                    Err("there is no other design yet")
                }
            },
        ),
        entry(
            menu,
            "apply-gains",
            "Apply the gains to the robot",
            "Send the gains of the design to the connected robot",
            &[],
            |s| if s.gains_wait { Ok(Command::ApplyGains) } else { Err("the robot already uses them") },
        ),
        entry(menu, "controller-lqr", "Use LQR", "State feedback only", &[], |s| match s.controller {
            ControllerKind::Lqr => Err("already selected"),
            ControllerKind::Flqr => Ok(Command::SetController(ControllerKind::Lqr)),
        }),
        entry(menu, "controller-flqr", "Use FLQR", "State feedback plus friction feedforward", &[], |s| {
            match s.controller {
                ControllerKind::Flqr => Err("already selected"),
                ControllerKind::Lqr => Ok(Command::SetController(ControllerKind::Flqr)),
            }
        }),
    ]
}

fn view() -> Vec<Entry> {
    let menu = Menu::View;
    let tab = |(index, tab): (usize, Tab)| {
        let keys: Vec<_> = DIGITS.get(index).map(|digit| ctrl(*digit)).into_iter().collect();
        entry(menu, format!("tab-{}", tab.key()), tab.title(), tab.help(), &keys, move |_| {
            Ok(Command::SelectTab(tab))
        })
    };
    let beside = |tab: Tab| {
        Side::ALL.map(|side| {
            entry(
                menu,
                format!("{}-{}", side.key(), tab.key()),
                format!("{} {}", tab.title(), side.words()),
                match side {
                    Side::Back => "Move to the tile of the other pages",
                    Side::Right | Side::Below => "Move to a separate tile",
                },
                &[],
                move |_| Ok(Command::MoveTab(tab, side)),
            )
            .group("Tiles")
            .also(match side {
                Side::Back => "tile layout dock close join",
                Side::Right => "tile layout dock split right column",
                Side::Below => "tile layout dock split below row",
            })
        })
    };
    let zoom = |factor: f32| move |s: &Situation<'_>| Ok(Command::SetZoom(s.zoom * factor));
    let mut all: Vec<Entry> = Tab::ALL.into_iter().enumerate().map(tab).collect();
    all.extend(Tab::ALL.into_iter().flat_map(beside));
    all.extend([
        entry(menu, "reset-layout", "Reset the layout", "Move all pages into one tile", &[], |s| {
            if s.is_usual_layout { Err("already the default layout") } else { Ok(Command::ResetLayout) }
        })
        .also("tiles split dock default"),
        entry(menu, "theme", "Light or dark", "Switch between light and dark", &[ctrl(Key::D)], |s| {
            Ok(Command::SetDark(!s.is_dark))
        })
        .also("theme mode colours"),
        entry(
            menu,
            "larger",
            "Larger",
            "Change the size of everything by 10 %",
            &[ctrl(Key::Plus), ctrl(Key::Equals)],
            zoom(1.1),
        ),
        entry(
            menu,
            "smaller",
            "Smaller",
            "Change the size of everything by 10 %",
            &[ctrl(Key::Minus)],
            zoom(1.0 / 1.1),
        ),
        entry(menu, "usual-size", "Default size", "Use the scale of the system", &[ctrl(Key::Num0)], |_| {
            Ok(Command::SetZoom(1.0))
        }),
    ]);
    all
}

fn run() -> Vec<Entry> {
    let menu = Menu::Run;
    let source = |(source, name, help): (Source, &'static str, &'static str)| {
        entry(menu, format!("source-{}", source.key()), format!("Source: {name}"), help, &[], move |s| {
            if s.source == source { Err("already selected") } else { Ok(Command::SelectSource(source)) }
        })
    };
    let mut all = vec![
        entry(
            menu,
            "start",
            "Start or cancel",
            "Start or cancel the fit, the search or the experiment; connect or disconnect on the Robot page",
            &[ctrl(Key::Enter)],
            |s| match s.tab {
                Tab::Friction => start_fit(s),
                Tab::Refine => Ok(start_refine(s)),
                Tab::Experiments => Ok(start_experiment(s)),
                Tab::Robot => Ok(connect(s)),
                _ => Err("nothing to start on this page"),
            },
        ),
        entry(menu, "fit", "Start or cancel the fit", "Friction from the loaded log", &[], start_fit)
            .also("friction identify"),
        entry(
            menu,
            "refine",
            "Start or cancel the search for missing effects",
            "Uses the logs of the Refine page",
            &[],
            |s| Ok(start_refine(s)),
        ),
        entry(
            menu,
            "find-missing",
            "Find missing effects",
            "Find effects that the model lacks in the logs of the Refine page",
            &[],
            |s| ask(s, Question::Refine),
        )
        .also("refine search effects attribution"),
        entry(
            menu,
            "residual",
            "Compute residual",
            "Compute the residual of the logs of the Refine page without a search",
            &[],
            |s| ask(s, Question::Residual),
        )
        .also("refine residual error"),
        entry(
            menu,
            "use-found",
            "Use the effects in the model",
            "Add the effects selected on the Refine page and the corrected parameters to the model",
            &[],
            |_| Ok(RefineCommand::Use.into()),
        )
        .also("refine add effects"),
        entry(
            menu,
            "use-fit",
            "Use the fit for both motors",
            "Use the friction fitted on the Friction page",
            &[],
            |s| if s.has_log { Ok(Command::UseFit(Target::Both)) } else { Err("there is no log") },
        )
        .also("friction add model"),
        entry(menu, "demo", "Run the demo", "Simulated robot with a hidden effect", &[], |_| {
            Ok(RefineCommand::Start(Question::Demo).into())
        }),
        entry(
            menu,
            "overlay-runs",
            "Overlay the last two runs",
            "Overlay the last two runs of one kind on the Runs page",
            &[],
            |_| Ok(RunsCommand::OverlayLast.into()),
        )
        .also("runs tick compare show draw"),
        entry(
            menu,
            "rows",
            "Go to the runs",
            "Focus the newest row of the Runs page: arrow keys move, Space selects",
            &[],
            |_| Ok(RunsCommand::FocusRows.into()),
        )
        .also("rows table focus"),
        entry(menu, "untick-runs", "Deselect all runs", "Clear the selection on the Runs page", &[], |_| {
            Ok(RunsCommand::UntickAll.into())
        })
        .also("runs clear"),
        entry(menu, "experiment", "Run or cancel the experiment", "Both controllers", &[], |s| {
            Ok(start_experiment(s))
        }),
        entry(
            menu,
            "connect",
            "Connect or disconnect the robot",
            "Uses the settings of the Robot page",
            &[],
            |s| {
                if s.source == Source::Simulated {
                    Err("the simulated robot needs no connection")
                } else {
                    Ok(connect(s))
                }
            },
        ),
        entry(menu, "stop", "STOP the robot", "No torque, motors off, immediately", &[], |s| {
            if s.is_hot { Ok(Command::Stop) } else { Err("no robot is driven") }
        }),
        entry(menu, "pause", "Pause or resume", "The simulated robot or the replay", &[ctrl(Key::P)], |s| {
            match s.source {
                Source::Simulated => Ok(Command::SetPaused(!s.paused)),
                Source::Replay => Ok(Command::Order(SessionOrder::Pause(!s.replay_is_paused))),
                Source::Emulated | Source::Can | Source::Slcan => Err("a robot cannot be paused"),
            }
        }),
        entry(menu, "reset-simulation", "Reset the simulated robot", "Restart with empty plots", &[], |s| {
            if s.source == Source::Simulated {
                Ok(Command::ResetSimulation)
            } else {
                Err("another source is selected")
            }
        }),
        entry(menu, "interfaces", "Refresh interfaces", "CAN interfaces and serial ports", &[], |_| {
            Ok(Command::RefreshInterfaces)
        }),
    ];
    all.extend(Source::ALL.map(source));
    all
}

fn start_fit(s: &Situation<'_>) -> Sent {
    match (s.fit_runs, s.has_log) {
        (true, _) => Ok(Command::CancelFit),
        (_, true) => Ok(Command::StartFit),
        _ => Err("there is no log"),
    }
}

fn ask(s: &Situation<'_>, question: Question) -> Sent {
    if s.refine_runs { Err("a search is running") } else { Ok(RefineCommand::Start(question).into()) }
}

/// Opens the form that saves the plots of the page.
fn export(s: &Situation<'_>, kind: FigureKind) -> Sent {
    let stack = match s.tab {
        Tab::Tune if s.has_robot => "live",
        Tab::Friction if s.has_log => "log",
        Tab::Experiments => "runs",
        Tab::Runs => "overlay",
        Tab::Refine if s.has_residual => crate::refine::RESIDUAL_STACK,
        Tab::Refine => return Err("use “Find missing effects” to get the plots of this page"),
        _ => return Err("this page has no plots now"),
    };
    let asks = "Type or choose the path to save to.".to_owned();
    Ok(Command::ChooseFigure(FigureFile { stack, kind }, Err(asks)))
}

fn start_refine(s: &Situation<'_>) -> Command {
    (if s.refine_runs { RefineCommand::Cancel } else { RefineCommand::Start(Question::Refine) }).into()
}

fn start_experiment(s: &Situation<'_>) -> Command {
    if s.experiment_runs { Command::CancelExperiment } else { Command::StartExperiment }
}

fn connect(s: &Situation<'_>) -> Command {
    if s.is_connected { Command::Disconnect } else { Command::Connect }
}

fn help() -> Vec<Entry> {
    let menu = Menu::Help;
    vec![
        entry(
            menu,
            "manual",
            "Manual",
            "The description of this page, with all other pages and a search",
            &[KeyboardShortcut::new(Modifiers::NONE, Key::F1)],
            |_| Ok(Command::ShowManual),
        )
        .also("help documentation guide"),
        entry(menu, "tour", "Tour", "Introduction in five steps", &[], |_| Ok(Command::StartTour)),
        entry(menu, "palette", "Any command…", "Searchable list of all commands", &[ctrl(Key::K)], |_| {
            Ok(Command::ShowPalette)
        }),
    ]
}
