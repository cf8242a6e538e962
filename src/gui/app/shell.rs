//! The frame around the pages: tabs, source, theme, status line, shortcuts.

use egui::{Frame, Key, KeyboardShortcut, Margin, Modifiers, Panel, RichText, Theme, Ui};

use super::{App, Tab};
use crate::command::{Command, FilePurpose, Source};
use crate::theme::palette;
use crate::widgets::choice_ui;

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

/// Keys and what they do; shown in the help menu.
const HELP: &[(&str, &str)] = &[
    ("Ctrl+1, Ctrl+2, Ctrl+3", "tune, friction, experiments"),
    ("Ctrl+O", "open a model or a log"),
    ("Ctrl+S", "save the model"),
    ("Ctrl+E", "go to the first weight"),
    ("Ctrl+L", "go to the path of the log, or of what an experiment is saved to"),
    ("Ctrl+Enter", "start or cancel the fit or the experiment"),
    ("Space, ←, →", "play, step (with Shift or Alt: longer, shorter) an experiment"),
    ("Ctrl+P", "pause or run the simulated robot"),
    ("Ctrl+D", "light or dark"),
    ("Tab, Shift+Tab", "next, previous control"),
    ("drag, wheel, double click", "move, zoom, follow again (plots)"),
];

impl App {
    pub(super) fn shell_ui(&mut self, ui: &mut Ui) {
        self.shortcuts(ui);
        let bar = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(10, 5));
        Panel::top("head").frame(bar).show(ui, |ui| self.head_ui(ui));
        Panel::bottom("status").frame(bar).show(ui, |ui| self.status_ui(ui));
        self.page_ui(ui);
    }

    fn shortcuts(&mut self, ui: &Ui) {
        let pressed = |key| ui.input_mut(|input| input.consume_shortcut(&ctrl(key)));
        let send = |command| self.commands.send(command);
        if pressed(Key::Num1) {
            send(Command::SelectTab(Tab::Tune));
        }
        if pressed(Key::Num2) {
            send(Command::SelectTab(Tab::Friction));
        }
        if pressed(Key::Num3) {
            send(Command::SelectTab(Tab::Experiments));
        }
        if pressed(Key::O) {
            send(Command::ShowDialog(match self.tab {
                Tab::Tune | Tab::Experiments => FilePurpose::OpenModel,
                Tab::Friction => FilePurpose::OpenLog,
            }));
        }
        if pressed(Key::S) {
            send(match &self.model_path {
                Some(path) => Command::SaveModel(path.clone()),
                None => Command::ShowDialog(FilePurpose::SaveModel),
            });
        }
        if pressed(Key::P) && self.source == Source::Simulated {
            send(Command::SetPaused(!self.live.status.paused));
        }
        if pressed(Key::Enter) {
            match self.tab {
                Tab::Tune => {}
                Tab::Friction if self.friction.fit_is_running() => send(Command::CancelFit),
                Tab::Friction => send(Command::StartFit),
                Tab::Experiments if self.experiments.is_running() => send(Command::CancelExperiment),
                Tab::Experiments => send(Command::StartExperiment),
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
            if self.tab == Tab::Experiments {
                self.experiments.focus_path();
            } else {
                send(Command::SelectTab(Tab::Friction));
                self.friction.focus_path();
            }
        }
    }

    fn head_ui(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let mut tab = self.tab;
            let tabs = [
                (Tab::Tune, "Tune", "Weights, gains and the live robot (Ctrl+1)"),
                (Tab::Friction, "Friction", "Friction from a measured log (Ctrl+2)"),
                (
                    Tab::Experiments,
                    "Experiments",
                    "LQR and FLQR side by side on the simulated robot (Ctrl+3)",
                ),
            ];
            ui.scope(|ui| {
                ui.spacing_mut().button_padding.x = 14.0;
                if choice_ui(ui, &mut tab, &tabs) {
                    self.commands.send(Command::SelectTab(tab));
                }
            });
            ui.separator();
            self.model_name_ui(ui);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                help_ui(ui);
                theme_ui(ui);
                ui.separator();
                self.source_ui(ui);
            });
        });
    }

    fn model_name_ui(&self, ui: &mut Ui) {
        ui.label(RichText::new(&self.session.name).strong());
        if self.session != self.saved {
            let color = palette(ui.visuals()).warning;
            ui.label(RichText::new("changed").small().color(color))
                .on_hover_text("The model differs from its file. Ctrl+S saves it.");
        }
    }

    fn source_ui(&self, ui: &mut Ui) {
        let mut source = self.source;
        // Drawn from the right, so the last comes first.
        let choices = [
            (Source::Can, "CAN", "A real robot on a CAN bus"),
            (Source::Simulated, "simulated", "The simulated robot"),
        ];
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
        let live = &self.live.status;
        let state = match self.source {
            Source::Can => "CAN: no link",
            Source::Simulated if self.session.robot().is_none() => "no robot",
            Source::Simulated if self.designer.in_force.is_none() => "no design, nothing runs",
            Source::Simulated if live.fell => "simulated: fallen",
            Source::Simulated if live.paused => "simulated: paused",
            Source::Simulated => "simulated: 1000 Hz",
        };
        let losses = format!("late {:.1} s   lost {}", live.late_s, live.lost_samples);
        ui.label(RichText::new(losses).small().monospace().weak()).on_hover_text(
            "Simulated time that was skipped because the machine was too slow, and samples that the plots missed",
        );
        ui.separator();
        ui.label(RichText::new(state).small());
    }
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
