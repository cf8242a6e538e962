//! The frame around the pages: tabs, source, theme, status line, shortcuts.

use egui::{Event, Frame, Margin, Panel, RichText, Ui};

use flqr_core::device::Connection;

use super::App;
use crate::command::{Command, Source};
use crate::commands::{self, STOP_KEYS, keys_ui, menu_ui};
use crate::layout::Side;
use crate::pages::Tab;
use crate::robot::bar_ui;
use crate::theme::palette;
use crate::widgets::choice_ui;

/// Widths of the window from which on the names of all sources, further buttons and the names of all pages have room.
const ROOM_FOR_SOURCES: f32 = 1020.0;
const ROOM_FOR_BUTTONS: f32 = 780.0;
const ROOM_FOR_TABS: f32 = 600.0;
const LEAST_NAME_WIDTH: f32 = 80.0;

impl App {
    pub(super) fn shell_ui(&mut self, ui: &mut Ui) {
        self.shortcuts(ui);
        let bar = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(10, 5));
        Panel::top("head").frame(bar).show(ui, |ui| self.head_ui(ui));
        if self.state.source != Source::Simulated {
            let (link, page, commands) =
                (&self.state.link, (self.state.source, self.tab), &self.state.commands);
            let strip = Panel::top("robot strip").frame(bar);
            if strip.show(ui, |ui| bar_ui(link, page, commands, ui)).inner {
                self.state.link.stop();
            }
        }
        Panel::bottom("status").frame(bar).show(ui, |ui| self.status_ui(ui));
        let pages = ui.available_rect_before_wrap();
        self.page_ui(ui);
        self.help_ui(pages, ui);
        self.palette_ui(ui);
        self.question_ui(ui.ctx());
        self.tour_ui(ui);
    }

    fn shortcuts(&mut self, ui: &Ui) {
        if self.state.link.is_hot() && take_stop_keys(ui) {
            self.state.link.stop();
        }
        if self.palette.is_some() || self.question.is_some() {
            return;
        }
        let Some(entry) = commands::pressed(ui.ctx()) else { return };
        match entry.send(&self.situation(ui.ctx())) {
            Ok(command) => self.state.commands.send(command),
            Err(reason) => self.state.commands.send(Command::Say(format!("{}: {reason}.", entry.name))),
        }
    }

    fn tour_ui(&mut self, ui: &Ui) {
        let Some(tour) = self.tour else { return };
        self.tour = tour.ui(&self.state.commands, ui.ctx());
        if self.tour.is_none() {
            self.state.recent.tour_done = true;
            self.save_recent();
        }
    }

    fn help_ui(&mut self, area: egui::Rect, ui: &Ui) {
        if let Some(help) = &mut self.help
            && !help.ui(area, &self.state.commands, ui.ctx())
        {
            self.help = None;
        }
    }

    fn palette_ui(&mut self, ui: &Ui) {
        let Some(mut palette) = self.palette.take() else { return };
        if palette.ui(&self.situation(ui.ctx()), &self.state.commands, ui.ctx()) {
            self.palette = Some(palette);
        }
    }

    fn head_ui(&mut self, ui: &mut Ui) {
        let room = ui.available_width();
        ui.horizontal(|ui| {
            menu_ui(&self.situation(ui.ctx()), &self.state.commands, ui);
            ui.scope(|ui| {
                ui.spacing_mut().button_padding.x = 10.0;
                ui.spacing_mut().item_spacing.x = 2.0;
                if room < ROOM_FOR_TABS {
                    self.tab_menu_ui(ui);
                } else {
                    Tab::ALL.into_iter().for_each(|tab| self.tab_ui(tab, ui));
                }
            });
            ui.separator();
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                // The menu has both.
                if room >= ROOM_FOR_BUTTONS {
                    ui.menu_button("Keys", keys_ui);
                    self.theme_ui(ui);
                    ui.separator();
                }
                if room < ROOM_FOR_SOURCES {
                    self.source_menu_ui(ui);
                } else {
                    self.source_ui(ui);
                }
                ui.separator();
                let name = egui::Layout::left_to_right(egui::Align::Center);
                ui.with_layout(name, |ui| self.model_name_ui(ui));
            });
        });
    }

    /// The pages in one button, where there is no room for all of their names.
    fn tab_menu_ui(&self, ui: &mut Ui) {
        ui.menu_button(self.tab.title(), |ui| {
            for tab in Tab::ALL {
                if ui.selectable_label(tab == self.tab, tab.title()).on_hover_text(tab.help()).clicked() {
                    self.state.commands.send(Command::SelectTab(tab));
                    ui.close();
                }
            }
        });
    }

    /// The button that brings a page to the front; a right click gives it another tile.
    fn tab_ui(&self, tab: Tab, ui: &mut Ui) {
        let shown = self.layout.shows(tab);
        let help = commands::with_keys(ui.ctx(), tab.help(), &format!("tab-{}", tab.key()));
        let title = RichText::new(tab.title());
        let title = if shown && tab != self.tab { title.underline() } else { title };
        let button = ui.selectable_label(tab == self.tab, title).on_hover_text(help);
        if button.clicked() {
            self.state.commands.send(Command::SelectTab(tab));
        }
        button.context_menu(|ui| {
            for side in Side::ALL {
                if ui.button(format!("{} {}", tab.title(), side.words())).clicked() {
                    self.state.commands.send(Command::MoveTab(tab, side));
                    ui.close();
                }
            }
        });
    }

    fn theme_ui(&self, ui: &mut Ui) {
        let dark = ui.visuals().dark_mode;
        let help = commands::with_keys(ui.ctx(), "Switch between light and dark", "theme");
        if ui.button(if dark { "Light" } else { "Dark" }).on_hover_text(help).clicked() {
            self.state.commands.send(Command::SetDark(!dark));
        }
    }

    fn model_name_ui(&self, ui: &mut Ui) {
        let changed = self.state.session != self.state.saved;
        // A few letters of it say nothing.
        if ui.available_width() < LEAST_NAME_WIDTH {
            return;
        }
        // The mark keeps its room whatever the length of the name.
        let room = ui.available_width() - if changed { 66.0 } else { 0.0 };
        ui.scope(|ui| {
            ui.set_max_width(room.max(0.0));
            let name = RichText::new(&self.state.session.name).strong();
            ui.add(egui::Label::new(name).truncate());
        });
        if changed {
            let color = palette(ui.visuals()).warning;
            ui.label(RichText::new("changed").small().color(color))
                .on_hover_text("The model differs from its file. Ctrl+S saves it.");
        }
    }

    fn source_ui(&self, ui: &mut Ui) {
        let mut source = self.state.source;
        // Drawn from the right, so the last comes first.
        let mut choices = Source::ALL;
        choices.reverse();
        ui.scope(|ui| {
            if choice_ui(ui, &mut source, &choices) {
                self.state.commands.send(Command::SelectSource(source));
            }
        });
        ui.label("Source");
    }

    /// The sources in one button.
    fn source_menu_ui(&self, ui: &mut Ui) {
        ui.menu_button(self.state.source.name(), |ui| {
            for (source, name, help) in Source::ALL {
                if ui.selectable_label(source == self.state.source, name).on_hover_text(help).clicked() {
                    self.state.commands.send(Command::SelectSource(source));
                    ui.close();
                }
            }
        });
    }

    fn status_ui(&self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                self.numbers_ui(ui);
                let Some((severity, text)) = self.pages.log.status() else { return };
                let color = severity.color(ui.visuals());
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    let text = RichText::new(text).small().color(color);
                    ui.add(egui::Label::new(text).truncate());
                });
            });
        });
    }

    fn numbers_ui(&self, ui: &mut Ui) {
        if let Some(cpu) = self.frame_cpu_s {
            ui.label(RichText::new(format!("frame {:4.1} ms", 1e3 * cpu)).small().monospace().weak())
                .on_hover_text("Time of the last frame, including the graphics driver");
            ui.separator();
        }
        let (state, losses, help) = self.source_text();
        ui.label(RichText::new(losses).small().monospace().weak()).on_hover_text(help);
        ui.separator();
        ui.label(RichText::new(state).small());
    }

    /// State of the source and its losses.
    fn source_text(&self) -> (String, String, &'static str) {
        if self.state.source != Source::Simulated {
            let state = match (&self.state.link.status, self.state.link.is_open()) {
                (_, false) => "disconnected",
                (Some(status), true) if status.connection == Connection::Ended => "ended",
                _ => "connected",
            };
            let counters = self.state.link.status.as_ref().map(|status| status.counters).unwrap_or_default();
            return (
                format!("{}: {state}", self.state.source.name()),
                format!("late {}   lost {}   dropped {}", counters.late, counters.lost, counters.dropped),
                "Late: control-loop ticks at least one period late. Lost: frames and samples that did not reach the loop, the window or the recording. Dropped: frames dropped by the system or the adapter",
            );
        }
        let live = &self.state.live.status;
        let state = if self.state.session.robot().is_none() {
            "no robot"
        } else if self.state.designer.in_force.is_none() {
            "no design"
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
            "Simulated time skipped because the computer was too slow, and samples missing in the plots",
        )
    }
}

/// Takes Esc and Space away from whatever has the focus, and says whether one was pressed.
fn take_stop_keys(ui: &Ui) -> bool {
    ui.input_mut(|input| {
        let mut stop = false;
        input.events.retain(|event| {
            let (taken, pressed) = match event {
                Event::Key { key, pressed, .. } if STOP_KEYS.contains(key) => (true, *pressed),
                Event::Text(text) => (text == " ", text == " "),
                _ => (false, false),
            };
            stop |= pressed;
            !taken
        });
        stop
    })
}
