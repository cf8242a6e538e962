//! The frame around the pages: tabs, source, theme, status line, shortcuts.

use egui::{Event, Frame, Key, KeyboardShortcut, Margin, Modifiers, Panel, RichText, Theme, Ui};

use flqr_core::device::{Connection, SessionOrder};

use super::{App, Tab};
use crate::command::{Command, FilePurpose, Source};
use crate::refine::{Question, RefineCommand, RefineFile};
use crate::robot::bar_ui;
use crate::theme::palette;
use crate::widgets::choice_ui;

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

/// Keys and what they do; shown in the help menu.
const HELP: &[(&str, &str)] = &[
    ("Esc, Space", "STOP a robot that is checked or driven: no torque, motors off"),
    ("Ctrl+1 … Ctrl+5", "tune, friction, refine, experiments, robot"),
    ("Ctrl+O", "open a model or a log"),
    ("Ctrl+S", "save the model"),
    ("Ctrl+E", "go to the first weight"),
    ("Ctrl+L", "go to the path of the log, or of what an experiment is saved to"),
    ("Ctrl+Enter", "start or cancel the fit, the search or the experiment; connect or disconnect the robot"),
    ("Space, ←, →", "play, step (with Shift or Alt: longer, shorter) an experiment"),
    ("Ctrl+P", "pause or run the simulated robot or the replay"),
    ("Ctrl+D", "light or dark"),
    ("Tab, Shift+Tab", "next, previous control"),
    ("drag, wheel, double click", "move, zoom, follow again (plots)"),
];

impl App {
    pub(super) fn shell_ui(&mut self, ui: &mut Ui) {
        self.shortcuts(ui);
        let bar = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(10, 5));
        Panel::top("head").frame(bar).show(ui, |ui| self.head_ui(ui));
        if self.source != Source::Simulated {
            let (link, page, commands) = (&self.link, (self.source, self.tab), &self.commands);
            let strip = Panel::top("robot strip").frame(bar);
            if strip.show(ui, |ui| bar_ui(link, page, commands, ui)).inner {
                self.link.stop();
            }
        }
        Panel::bottom("status").frame(bar).show(ui, |ui| self.status_ui(ui));
        self.page_ui(ui);
    }

    fn shortcuts(&mut self, ui: &Ui) {
        if self.link.is_hot() && take_stop_keys(ui) {
            self.link.stop();
        }
        let pressed = |key| ui.input_mut(|input| input.consume_shortcut(&ctrl(key)));
        let send = |command| self.commands.send(command);
        if pressed(Key::Num1) {
            send(Command::SelectTab(Tab::Tune));
        }
        if pressed(Key::Num2) {
            send(Command::SelectTab(Tab::Friction));
        }
        if pressed(Key::Num3) {
            send(Command::SelectTab(Tab::Refine));
        }
        if pressed(Key::Num4) {
            send(Command::SelectTab(Tab::Experiments));
        }
        if pressed(Key::Num5) {
            send(Command::SelectTab(Tab::Robot));
        }
        if pressed(Key::O) {
            send(Command::ShowDialog(match self.tab {
                Tab::Robot if self.source == Source::Replay => FilePurpose::OpenReplay,
                Tab::Robot => FilePurpose::OpenModel,
                Tab::Tune | Tab::Experiments => FilePurpose::OpenModel,
                Tab::Friction => FilePurpose::OpenLog,
                Tab::Refine => FilePurpose::Refine(RefineFile::Log),
            }));
        }
        if pressed(Key::S) {
            send(match &self.model_path {
                Some(path) => Command::SaveModel(path.clone()),
                None => Command::ShowDialog(FilePurpose::SaveModel),
            });
        }
        if pressed(Key::P) {
            match self.source {
                Source::Simulated => send(Command::SetPaused(!self.live.status.paused)),
                Source::Replay => send(Command::Order(SessionOrder::Pause(!self.link.replay_is_paused))),
                Source::Emulated | Source::Can | Source::Slcan => {}
            }
        }
        if pressed(Key::Enter) {
            match self.tab {
                Tab::Tune => {}
                Tab::Friction if self.friction.fit_is_running() => send(Command::CancelFit),
                Tab::Friction => send(Command::StartFit),
                Tab::Refine if self.refine.is_running() => send(Command::Refine(RefineCommand::Cancel)),
                Tab::Refine => send(Command::Refine(RefineCommand::Start(Question::Refine))),
                Tab::Experiments if self.experiments.is_running() => send(Command::CancelExperiment),
                Tab::Experiments => send(Command::StartExperiment),
                Tab::Robot if self.link.options().is_some() => send(Command::Disconnect),
                Tab::Robot => send(Command::Connect),
            }
        }
        if pressed(Key::D) {
            switch_theme(ui);
        }
        if pressed(Key::E) {
            send(Command::SelectTab(Tab::Tune));
            self.tune.focus_weights();
        }
        if pressed(Key::L) {
            match self.tab {
                Tab::Experiments => self.experiments.focus_path(),
                Tab::Refine => self.refine.focus_path(),
                _ => {
                    send(Command::SelectTab(Tab::Friction));
                    self.friction.focus_path();
                }
            }
        }
    }

    fn head_ui(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let mut tab = self.tab;
            let tabs = [
                (Tab::Tune, "Tune", "Weights, gains and the live robot (Ctrl+1)"),
                (Tab::Friction, "Friction", "Friction from a measured log (Ctrl+2)"),
                (Tab::Refine, "Refine", "What the model lacks, from measured logs (Ctrl+3)"),
                (
                    Tab::Experiments,
                    "Experiments",
                    "LQR and FLQR side by side on the simulated robot (Ctrl+4)",
                ),
                (Tab::Robot, "Robot", "Connection, health, arming and recording of a robot (Ctrl+5)"),
            ];
            ui.scope(|ui| {
                ui.spacing_mut().button_padding.x = 12.0;
                if choice_ui(ui, &mut tab, &tabs) {
                    self.commands.send(Command::SelectTab(tab));
                }
            });
            ui.separator();
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                help_ui(ui);
                theme_ui(ui);
                ui.separator();
                self.source_ui(ui);
                ui.separator();
                let name = egui::Layout::left_to_right(egui::Align::Center);
                ui.with_layout(name, |ui| self.model_name_ui(ui));
            });
        });
    }

    fn model_name_ui(&self, ui: &mut Ui) {
        let changed = self.session != self.saved;
        // The mark keeps its room whatever the length of the name.
        let room = ui.available_width() - if changed { 66.0 } else { 0.0 };
        ui.scope(|ui| {
            ui.set_max_width(room.max(0.0));
            let name = RichText::new(&self.session.name).strong();
            ui.add(egui::Label::new(name).truncate());
        });
        if changed {
            let color = palette(ui.visuals()).warning;
            ui.label(RichText::new("changed").small().color(color))
                .on_hover_text("The model differs from its file. Ctrl+S saves it.");
        }
    }

    fn source_ui(&self, ui: &mut Ui) {
        let mut source = self.source;
        // Drawn from the right, so the last comes first.
        let mut choices = Source::ALL;
        choices.reverse();
        ui.scope(|ui| {
            if choice_ui(ui, &mut source, &choices) {
                self.commands.send(Command::SelectSource(source));
            }
        });
        ui.label("Source");
    }

    fn status_ui(&self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                self.numbers_ui(ui);
                let color = if self.status.is_error {
                    palette(ui.visuals()).error
                } else {
                    ui.visuals().text_color()
                };
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    let text = RichText::new(&self.status.text).small().color(color);
                    ui.add(egui::Label::new(text).truncate());
                });
            });
        });
    }

    fn numbers_ui(&self, ui: &mut Ui) {
        if let Some(cpu) = self.frame_cpu_s {
            ui.label(RichText::new(format!("frame {:4.1} ms", 1e3 * cpu)).small().monospace().weak())
                .on_hover_text("Time that the last frame took, drawing by the graphics driver included");
            ui.separator();
        }
        let (state, losses, help) = self.source_text();
        ui.label(RichText::new(losses).small().monospace().weak()).on_hover_text(help);
        ui.separator();
        ui.label(RichText::new(state).small());
    }

    /// How the source stands, what was lost of it, and what that means.
    fn source_text(&self) -> (String, String, &'static str) {
        if self.source != Source::Simulated {
            let state = match (&self.link.status, self.link.is_open()) {
                (_, false) => "disconnected",
                (Some(status), true) if status.connection == Connection::Ended => "ended",
                _ => "connected",
            };
            let counters = self.link.status.as_ref().map(|status| status.counters).unwrap_or_default();
            return (
                format!("{}: {state}", self.source.name()),
                format!("late {}   lost {}   dropped {}", counters.late, counters.lost, counters.dropped),
                "Ticks of the control loop that came a period late, frames and samples that did not reach the loop, the window or the recording, and frames dropped by the system or the adapter",
            );
        }
        let live = &self.live.status;
        let state = if self.session.robot().is_none() {
            "no robot"
        } else if self.designer.in_force.is_none() {
            "no design, nothing runs"
        } else if live.fell {
            "simulated: fallen"
        } else if live.paused {
            "simulated: paused"
        } else {
            "simulated: 1000 Hz"
        };
        (
            state.to_owned(),
            format!("late {:.1} s   lost {}", live.late_s, live.lost_samples),
            "Simulated time that was skipped because the machine was too slow, and samples that the plots missed",
        )
    }
}

/// Takes Esc and Space away from whatever has the focus, and says whether one was pressed.
fn take_stop_keys(ui: &Ui) -> bool {
    ui.input_mut(|input| {
        let mut stop = false;
        input.events.retain(|event| {
            let (taken, pressed) = match event {
                Event::Key { key: Key::Escape | Key::Space, pressed, .. } => (true, *pressed),
                Event::Text(text) => (text == " ", text == " "),
                _ => (false, false),
            };
            stop |= pressed;
            !taken
        });
        stop
    })
}

fn theme_ui(ui: &mut Ui) {
    let name = if ui.visuals().dark_mode { "Light" } else { "Dark" };
    if ui.button(name).on_hover_text("Switch between light and dark (Ctrl+D)").clicked() {
        switch_theme(ui);
    }
}

fn switch_theme(ui: &Ui) {
    ui.ctx().set_theme(if ui.visuals().dark_mode { Theme::Light } else { Theme::Dark });
}

fn help_ui(ui: &mut Ui) {
    ui.menu_button("Keys", |ui| {
        egui::Grid::new("keys").num_columns(2).spacing([16.0, 4.0]).show(ui, |ui| {
            for (keys, meaning) in HELP {
                ui.label(RichText::new(*keys).monospace());
                ui.label(*meaning);
                ui.end_row();
            }
        });
    });
}
