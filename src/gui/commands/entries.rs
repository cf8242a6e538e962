//! The commands themselves.

use std::borrow::Cow;

use egui::{Key, KeyboardShortcut, Modifiers};
use flqr_core::control::ControllerKind;
use flqr_core::device::SessionOrder;
use flqr_core::model_file::presets;

use super::{Entry, Menu, Sent, Situation};
use crate::command::{Command, FilePurpose, Source, Target};
use crate::layout::Side;
use crate::plot::{FigureFile, FigureKind};
use crate::refine::{Question, RefineCommand, RefineFile, SavedAs};
use crate::runs::RunsCommand;
use crate::tab::Tab;

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

const fn ctrl_shift(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key)
}

/// Keys that take the torque off a robot that may move; they go before everything else, also in a field.
pub(crate) const STOP_KEYS: [Key; 2] = [Key::Escape, Key::Space];

/// What is done with the pointer or a bare key in one place, for the list of keys.
pub(crate) const GESTURES: &[(&str, &str)] = &[
    ("Esc, Space", "STOP a robot that is checked or driven: no torque, motors off"),
    ("Space, ←, →", "play, step (with Shift or Alt: longer, shorter) an experiment"),
    ("Tab, Shift+Tab", "next, previous control"),
    ("drag, ←, → of a weight", "1.5 % a point or press, with Shift 0.15 %"),
    ("drag, wheel, double click", "move, zoom, follow again (plots)"),
    ("drag of a tab", "move a page to another tile (once there are two)"),
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

/// All, in the order of the menus.
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
            "What this page works on: a model, a log or a recording",
            &[ctrl(Key::O)],
            |s| {
                Ok(Command::AskFile(match s.tab {
                    Tab::Robot if s.source == Source::Replay => FilePurpose::OpenReplay,
                    Tab::Friction => FilePurpose::OpenLog,
                    Tab::Refine => FilePurpose::Refine(RefineFile::Log),
                    Tab::Tune | Tab::Experiments | Tab::Robot | Tab::Runs | Tab::Log => {
                        FilePurpose::OpenModel
                    }
                }))
            },
        ),
        entry(
            menu,
            "open-model",
            "Open a model…",
            "A robot or an axis, from a TOML file",
            &[],
            dialog(FilePurpose::OpenModel),
        ),
        entry(
            menu,
            "open-log",
            "Open a log…",
            "A measurement, from a CSV file",
            &[],
            dialog(FilePurpose::OpenLog),
        )
        .also("csv import measurement load"),
        entry(
            menu,
            "open-recording",
            "Open a recording to replay…",
            "The rows or frames of an earlier session, through the same path as live data",
            &[],
            dialog(FilePurpose::OpenReplay),
        ),
        entry(
            menu,
            "save",
            "Save the model",
            "To its file; to a new one if it has none",
            &[ctrl(Key::S)],
            |s| {
                Ok(match s.model_path {
                    Some(path) => Command::SaveModel(path.to_owned()),
                    None => Command::AskFile(FilePurpose::SaveModel),
                })
            },
        ),
        entry(
            menu,
            "save-as",
            "Save the model as…",
            "To a file of your choice",
            &[ctrl_shift(Key::S)],
            dialog(FilePurpose::SaveModel),
        ),
        entry(
            menu,
            "open-session",
            "Open a session…",
            "Model, layout, sources and forms as they were saved",
            &[],
            dialog(FilePurpose::OpenSession),
        )
        .also("project workspace layout load"),
        entry(
            menu,
            "save-session",
            "Save the session as…",
            "Model, layout, sources and forms, in one file",
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
            "Save the report of the search…",
            "What the Refine page has found, as HTML",
            &[],
            dialog(FilePurpose::Refine(RefineFile::Save(SavedAs::Report))),
        )
        .also("refine export html"),
        entry(
            menu,
            "save-refined",
            "Save the refined model…",
            "The model with the effects that are ticked on the Refine page, as TOML",
            &[],
            dialog(FilePurpose::Refine(RefineFile::Save(SavedAs::Model))),
        )
        .also("refine export toml"),
        entry(
            menu,
            "quit",
            "Quit",
            "Close the window; asks if the model is not saved or the robot is driven",
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
        entry(menu, "undo", "Undo", "Take the last step back", &[ctrl(Key::Z)], |s| {
            if s.can_undo { Ok(Command::Undo) } else { Err("there is nothing to undo") }
        }),
        entry(
            menu,
            "redo",
            "Redo",
            "Make the step again that was taken back",
            &[ctrl_shift(Key::Z), ctrl(Key::Y)],
            |s| if s.can_redo { Ok(Command::Redo) } else { Err("there is nothing to redo") },
        ),
        entry(
            menu,
            "copy-command",
            "Copy as a command",
            "What does in a terminal what this page shows",
            &[],
            |s| if s.tab == Tab::Log { Err("this page does nothing") } else { Ok(Command::CopyLine) },
        ),
        entry(menu, "steps", "Steps…", "All that can be undone, by name", &[], |_| Ok(Command::ShowSteps))
            .also("history"),
        entry(
            menu,
            "weights",
            "Go to the first weight",
            "The field of the first weight",
            &[ctrl(Key::E)],
            of_robot(Command::FocusWeights),
        ),
        entry(
            menu,
            "path",
            "Go to the path",
            "Of the log, or of what an experiment is saved to",
            &[ctrl(Key::L)],
            |_| Ok(Command::FocusPath),
        ),
        entry(
            menu,
            "reset-weights",
            "Reset the weights",
            "Back to the weights of the loaded model",
            &[],
            of_robot(Command::ResetWeights),
        ),
        entry(
            menu,
            "keep-a",
            "Keep the design to compare with",
            "The other one of A and B becomes the one in force",
            &[],
            of_robot(Command::KeepReference),
        ),
        entry(menu, "swap-designs", "Swap A and B", "The other design comes into force", &[], |s| {
            if s.has_reference { Ok(Command::SwapReference) } else { Err("there is no other design yet") }
        }),
        entry(
            menu,
            "back-to-a",
            "Back to the other design",
            "Take the weights of the other one of A and B",
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
            "The connected robot gets the gains of the design",
            &[],
            |s| if s.gains_wait { Ok(Command::ApplyGains) } else { Err("the robot runs them already") },
        ),
        entry(menu, "controller-lqr", "Use LQR", "Gains alone", &[], |s| match s.controller {
            ControllerKind::Lqr => Err("it is in use"),
            ControllerKind::Flqr => Ok(Command::SetController(ControllerKind::Lqr)),
        }),
        entry(menu, "controller-flqr", "Use FLQR", "Gains plus friction feedforward", &[], |s| {
            match s.controller {
                ControllerKind::Flqr => Err("it is in use"),
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
                    Side::Back => "To the tile of the other pages",
                    Side::Right | Side::Below => "In a tile of its own",
                },
                &[],
                move |_| Ok(Command::MoveTab(tab, side)),
            )
            .group("Tiles")
            .also(match side {
                Side::Back => "tile layout dock close join",
                Side::Right => "tile layout dock split beside column",
                Side::Below => "tile layout dock split below row",
            })
        })
    };
    let zoom = |factor: f32| move |s: &Situation<'_>| Ok(Command::SetZoom(s.zoom * factor));
    let mut all: Vec<Entry> = Tab::ALL.into_iter().enumerate().map(tab).collect();
    all.extend(Tab::ALL.into_iter().flat_map(beside));
    all.extend([
        entry(menu, "reset-layout", "Reset the layout", "All pages in one tile again", &[], |s| {
            if s.is_usual_layout { Err("it is as at the first start") } else { Ok(Command::ResetLayout) }
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
            "Everything, by a tenth",
            &[ctrl(Key::Plus), ctrl(Key::Equals)],
            zoom(1.1),
        ),
        entry(menu, "smaller", "Smaller", "Everything, by a tenth", &[ctrl(Key::Minus)], zoom(1.0 / 1.1)),
        entry(menu, "usual-size", "Usual size", "As the system scales", &[ctrl(Key::Num0)], |_| {
            Ok(Command::SetZoom(1.0))
        }),
    ]);
    all
}

fn run() -> Vec<Entry> {
    let menu = Menu::Run;
    let source = |(source, name, help): (Source, &'static str, &'static str)| {
        entry(menu, format!("source-{}", source.key()), format!("Source: {name}"), help, &[], move |s| {
            if s.source == source { Err("it is chosen") } else { Ok(Command::SelectSource(source)) }
        })
    };
    let mut all = vec![
        entry(
            menu,
            "start",
            "Start or cancel",
            "The fit, the search or the experiment; connects or disconnects on the Robot page",
            &[ctrl(Key::Enter)],
            |s| match s.tab {
                Tab::Tune | Tab::Runs | Tab::Log => Err("this page starts nothing"),
                Tab::Friction => start_fit(s),
                Tab::Refine => Ok(start_refine(s)),
                Tab::Experiments => Ok(start_experiment(s)),
                Tab::Robot => Ok(connect(s)),
            },
        ),
        entry(menu, "fit", "Start or cancel the fit", "Friction from the loaded log", &[], start_fit)
            .also("friction identify"),
        entry(
            menu,
            "refine",
            "Start or cancel the search for what the model lacks",
            "In the logs of the Refine page",
            &[],
            |s| Ok(start_refine(s)),
        ),
        entry(
            menu,
            "find-missing",
            "Find what is missing",
            "Look for effects that the model lacks, in the logs of the Refine page",
            &[],
            |s| ask(s, Question::Refine),
        )
        .also("refine search effects attribution"),
        entry(
            menu,
            "residual",
            "How far is the model?",
            "The residual of the logs of the Refine page alone, without a search",
            &[],
            |s| ask(s, Question::Residual),
        )
        .also("refine residual error"),
        entry(
            menu,
            "use-found",
            "Use in the model what was found",
            "The effects that are ticked on the Refine page, and the corrected numbers",
            &[],
            |_| Ok(Command::Refine(RefineCommand::Use)),
        )
        .also("refine add effects"),
        entry(
            menu,
            "use-fit",
            "Use the fit for both motors",
            "The friction that the Friction page has fitted",
            &[],
            |s| if s.has_log { Ok(Command::UseFit(Target::Both)) } else { Err("there is no log") },
        )
        .also("friction add model"),
        entry(
            menu,
            "demo",
            "Search the records of a demo robot",
            "A simulated robot with something that its model does not have",
            &[],
            |_| Ok(Command::Refine(RefineCommand::Start(Question::Demo))),
        ),
        entry(
            menu,
            "overlay-runs",
            "Overlay the last two runs",
            "Draw the last two runs of one kind over each other, on the Runs page",
            &[],
            |_| Ok(Command::Runs(RunsCommand::OverlayLast)),
        )
        .also("runs tick compare show draw"),
        entry(
            menu,
            "rows",
            "Go to the runs",
            "The box of the newest row of the Runs page: arrows go on, Space ticks",
            &[],
            |_| Ok(Command::Runs(RunsCommand::FocusRows)),
        )
        .also("rows table focus"),
        entry(menu, "untick-runs", "Untick all runs", "Draw none of the rows of the Runs page", &[], |_| {
            Ok(Command::Runs(RunsCommand::UntickAll))
        })
        .also("runs clear"),
        entry(menu, "experiment", "Run or cancel the experiment", "Both controllers", &[], |s| {
            Ok(start_experiment(s))
        }),
        entry(
            menu,
            "connect",
            "Connect or disconnect the robot",
            "As the form of the Robot page says",
            &[],
            |s| {
                if s.source == Source::Simulated {
                    Err("the simulated robot needs no connection")
                } else {
                    Ok(connect(s))
                }
            },
        ),
        entry(menu, "stop", "STOP the robot", "No torque, motors off, at once", &[], |s| {
            if s.is_hot { Ok(Command::Stop) } else { Err("no robot is driven") }
        }),
        entry(menu, "pause", "Pause or go on", "The simulated robot or the replay", &[ctrl(Key::P)], |s| {
            match s.source {
                Source::Simulated => Ok(Command::SetPaused(!s.paused)),
                Source::Replay => Ok(Command::Order(SessionOrder::Pause(!s.replay_is_paused))),
                Source::Emulated | Source::Can | Source::Slcan => Err("a robot cannot be paused"),
            }
        }),
        entry(
            menu,
            "reset-simulation",
            "Reset the simulated robot",
            "To the start, with empty plots",
            &[],
            |s| {
                if s.source == Source::Simulated {
                    Ok(Command::ResetSimulation)
                } else {
                    Err("another source is chosen")
                }
            },
        ),
        entry(menu, "interfaces", "Look for interfaces", "CAN interfaces and serial ports", &[], |_| {
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
    if s.refine_runs { Err("a search runs") } else { Ok(Command::Refine(RefineCommand::Start(question))) }
}

/// Opens the form that saves the plots of the page.
fn export(s: &Situation<'_>, kind: FigureKind) -> Sent {
    let stack = match s.tab {
        Tab::Tune if s.has_robot => "live",
        Tab::Friction if s.has_log => "log",
        Tab::Experiments => "runs",
        Tab::Runs => "overlay",
        Tab::Refine if s.has_residual => crate::refine::RESIDUAL_STACK,
        Tab::Refine => return Err("“Find what is missing” brings the plots of this page"),
        Tab::Tune | Tab::Friction | Tab::Robot | Tab::Log => return Err("this page has no plots now"),
    };
    let asks = "Type the path to save to, or choose it.".to_owned();
    Ok(Command::ChooseFigure(FigureFile { stack, kind }, Err(asks)))
}

fn start_refine(s: &Situation<'_>) -> Command {
    Command::Refine(if s.refine_runs {
        RefineCommand::Cancel
    } else {
        RefineCommand::Start(Question::Refine)
    })
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
        entry(menu, "tour", "Tour", "A first look, in five steps", &[], |_| Ok(Command::StartTour)),
        entry(menu, "palette", "Any command…", "This list, with a filter", &[ctrl(Key::K)], |_| {
            Ok(Command::ShowPalette)
        }),
    ]
}
