//! The *Robot* page: connection, arming and recording at the left; health, raw frames and events at the right.

mod bar;
mod cards;
mod discovery;
mod drive;
mod events;
mod feed;
mod form;
mod frames;
mod jitter;
mod link;
mod record;
mod snapshot;
mod transfer;

use std::path::Path;
use std::sync::Arc;

use egui::{Button, Frame, Label, Margin, RichText, ScrollArea, Sense, Ui, UiBuilder, vec2};
use flqr_core::control::drive::Stage;
use flqr_core::device::{Connection, Interfaces, SessionOptions, Source as DeviceSource, Update};
use flqr_core::model::LinkSettings;
use serde_json::Value;

use crate::command::{Command, FilePurpose, Source};
use crate::context::ViewContext;
use crate::job::{Job, Outcome, Waker};
use crate::messages::Said;
use crate::pages::Page;
use crate::panes::{Pane, panes_ui};
use crate::recent::Recent;
use crate::theme::palette;
use crate::widgets::{hint_ui, section_ui};
pub(crate) use bar::{STOP_HEIGHT, bar_ui, stop_ui};
use events::EventLog;
pub(crate) use feed::System;
pub use feed::{Devices, RobotFeed};
pub(crate) use form::ConnectionForm;
use frames::FrameTable;
pub(crate) use link::{Link, sentence};
use record::RecordForm;
pub(crate) use transfer::{change_rows_ui, pending_ui};

/// Height of the tables below which the page scrolls.
const LEAST_TABLE_HEIGHT: f32 = 230.0;

/// State of the page apart from the session with the robot.
#[derive(Default)]
pub(crate) struct RobotTab {
    pub(crate) form: ConnectionForm,
    record: RecordForm,
    frames: FrameTable,
    events: EventLog,
    found: Option<Interfaces>,
    looking: Option<Job<(), Interfaces>>,
}

impl RobotTab {
    /// Looks for interfaces and ports.
    pub(crate) fn look(&mut self, link: &Link, waker: &Waker) {
        let devices = Arc::clone(link.devices());
        self.looking = Job::start("list-interfaces", waker, move |_| devices.interfaces()).ok();
    }

    /// Takes the frames and events of an update.
    pub(crate) fn note(&mut self, update: &Update) {
        self.frames.extend(&update.frames);
        self.events.extend(&update.events);
    }

    /// Removes the frames and events of the last session.
    pub(crate) fn forget(&mut self) {
        self.frames.begin(LinkSettings::default());
        self.events.clear();
    }

    /// Prepares the page for another source, which is listen-only until the operator chooses otherwise.
    pub(crate) fn leave_source(&mut self) {
        self.forget();
        self.form.may_drive = false;
    }

    /// Prepares the page for a new session.
    pub(crate) fn begin(&mut self, options: &SessionOptions) {
        self.forget();
        self.frames.begin(options.robot.link);
        self.record.suggest();
        self.form.dialog_problem = None;
        if let DeviceSource::Replay { .. } = options.source {
            self.form.replay_speed = options.replay_speed;
        }
    }

    /// Fills the form with the last connection, unless something has been typed.
    pub(crate) fn suggest(&mut self, recent: &Recent) {
        if self.form != ConnectionForm::default() {
            return;
        }
        let fill = |field: &mut String, text: &str| {
            if !text.is_empty() {
                text.clone_into(field);
            }
        };
        fill(&mut self.form.interface, &recent.can_interface);
        for (field, text) in [&mut self.form.port, &mut self.form.bit_rate].into_iter().zip(&recent.slcan) {
            fill(field, text);
        }
        for (field, text) in [&mut self.form.imu_port, &mut self.form.imu_baud].into_iter().zip(&recent.imu) {
            fill(field, text);
        }
    }

    /// Chooses the file to record to.
    pub(crate) fn note_recording_path(&mut self, path: &Path) {
        self.record.path = path.display().to_string();
        self.record.dialog_problem = None;
    }

    fn side_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) -> bool {
        if context.source == Source::Simulated {
            section_ui(ui, "Connection", |_| {});
            hint_ui(ui, "The source is the simulated robot, which needs no connection.");
            return false;
        }
        if !context.link.is_open() {
            self.form.ui(context, self.found.as_ref(), ui);
            return false;
        }
        self.connected_ui(context, ui);
        let stop = if context.link.is_replay() { false } else { drive::drive_ui(context, ui) };
        if !context.link.is_replay() {
            self.record.ui(context, ui);
        }
        stop
    }

    fn connected_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some(options) = context.link.options() else { return };
        section_ui(ui, "Connection", |ui| {
            let (name, help) = if context.link.is_replay() {
                ("Close", "Close the recording")
            } else {
                ("Disconnect", "Close the connection; a robot being driven is stopped")
            };
            if ui.button(name).on_hover_text(help).clicked() {
                context.commands.send(Command::Disconnect);
            }
        });
        ui.add(Label::new(RichText::new(options.source.to_string()).monospace()).wrap());
        if let Some(imu) = &options.imu {
            ui.label(RichText::new(format!("IMU {} at {} bit/s", imu.port, imu.baud)).small());
        }
        if context.link.is_replay() {
            bar::replay_ui(context, &mut self.form.replay_speed, ui);
        }
    }

    fn middle_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some(status) = &context.link.status else {
            empty_ui(context, ui);
            return;
        };
        // In a small window the page scrolls, so that tables keep a height that is of use.
        let end = ui.max_rect().bottom();
        ScrollArea::vertical().id_salt("health").auto_shrink(false).show(ui, |ui| {
            banner_ui(context, ui);
            cards::cards_ui(status, ui);
            ui.add_space(4.0);
            let height = (end - ui.cursor().top()).max(LEAST_TABLE_HEIGHT);
            self.tables_ui(height, ui);
        });
    }

    /// Draws raw frames at the left and events at the right.
    fn tables_ui(&mut self, height: f32, ui: &mut Ui) {
        let spacing = ui.spacing().item_spacing.x + 6.0;
        let width = ui.available_width().max(1.0);
        let (room, _) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
        let events = (0.32 * room.width()).min(560.0);
        let (mut left, mut right) = (room, room);
        left.max.x = (room.max.x - events - spacing).max(left.min.x);
        right.min.x = room.max.x - events;
        ui.scope_builder(UiBuilder::new().max_rect(left).id_salt("frames"), |ui| {
            ui.set_clip_rect(left.intersect(ui.clip_rect()));
            self.frames.ui(ui);
        });
        ui.scope_builder(UiBuilder::new().max_rect(right).id_salt("events"), |ui| {
            ui.set_clip_rect(right.intersect(ui.clip_rect()));
            self.events.ui(ui);
        });
    }
}

impl Page for RobotTab {
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let panes = [
            Pane::left(Part::Connection, "Connection", 280.0, 250.0..=420.0),
            Pane::middle(Part::Robot, "Robot", 340.0),
        ];
        let mut stop = false;
        panes_ui(ui, "robot", &panes, |part, ui| match part {
            Part::Connection => stop |= self.side_ui(context, ui),
            Part::Robot => self.middle_ui(context, ui),
        });
        if stop {
            context.commands.send(Command::Stop);
        }
    }

    fn snapshot(&self, context: &ViewContext<'_>) -> Value {
        self.to_value(context.link)
    }

    fn command_line(&self, context: &ViewContext<'_>) -> Result<String, String> {
        let design = (context.session, context.designer);
        self.form.command_line(context.source, design, context.session.controller, context.model_path)
    }

    fn drain(&mut self) -> Vec<Said> {
        let found = match self.looking.as_mut().map(|job| job.poll().1) {
            None | Some(Outcome::Running) => return Vec::new(),
            Some(Outcome::Done(found)) => found,
            Some(Outcome::Broken) => Interfaces { can: Vec::new(), serial: Vec::new(), advice: Vec::new() },
        };
        (self.found, self.looking) = (Some(found), None);
        Vec::new()
    }

    fn suggested_name(&self, purpose: FilePurpose) -> Option<String> {
        if purpose != FilePurpose::SaveRecording {
            return None;
        }
        let name = Path::new(&self.record.path).file_name();
        Some(name.map_or_else(|| "robot.csv".to_owned(), |name| name.to_string_lossy().into_owned()))
    }

    fn note_dialog_problem(&mut self, purpose: FilePurpose, problem: &str) {
        match purpose {
            FilePurpose::OpenReplay => self.form.dialog_problem = Some(problem.to_owned()),
            FilePurpose::SaveRecording => self.record.dialog_problem = Some(problem.to_owned()),
            _ => {}
        }
    }
}

/// The panes of the page.
#[derive(Clone, Copy)]
enum Part {
    Connection,
    Robot,
}

/// Shows the reason for a stop or for missing data in large letters, with the remedy.
fn banner_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    let connection = context.link.status.as_ref().map(|status| &status.connection);
    let link = context.link;
    let title = bar::stage_name(link);
    let (title, text, color) = match (link.stage(), connection) {
        (None, _) if !link.end_problems().is_empty() => {
            let problems: Vec<_> =
                link.end_problems().iter().map(|problem| link::sentence(problem)).collect();
            (title, problems.join(" "), colors.error)
        }
        (None, _) => (title, "These are the last measurements.".to_owned(), colors.reference),
        (Some(Stage::Stopped(reason)), _) => (title, bar::stopped(link, &reason), colors.error),
        (_, Some(Connection::Silent { hint })) => ("Silent", link::sentence(hint), colors.warning),
        (_, Some(Connection::Lost { reason })) => {
            ("Lost", format!("{} Reconnecting automatically.", link::sentence(reason)), colors.warning)
        }
        _ => return,
    };
    let frame = Frame::new()
        .stroke(egui::Stroke::new(1.5, color))
        .corner_radius(6)
        .inner_margin(Margin::symmetric(12, 8));
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal_top(|ui| {
            ui.label(RichText::new(title).size(18.0).strong().color(color));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Min), |ui| {
                if matches!(link.stage(), Some(Stage::Stopped(_))) && !link.awaits_motors_off() {
                    use flqr_core::control::drive::DriveOrder;
                    use flqr_core::device::SessionOrder;
                    let release = Button::new("Release").min_size(vec2(90.0, 26.0));
                    if ui
                        .add(release)
                        .accessible_name("Release the stop")
                        .on_hover_text("Back to listening")
                        .clicked()
                    {
                        context.commands.send(Command::Order(SessionOrder::Drive(DriveOrder::Release)));
                    }
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Min), |ui| {
                    ui.vertical(|ui| {
                        // On the line of the title, whose letters are larger.
                        ui.add_space(3.0);
                        ui.add(Label::new(RichText::new(text).size(15.0)).wrap());
                    });
                });
            });
        });
    });
}

fn empty_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    ui.add_space(0.3 * ui.available_height());
    ui.vertical_centered(|ui| {
        let link = context.link;
        if link.is_open() || link.is_opening() {
            ui.heading(if link.is_open() { "Waiting for the first measurements…" } else { "Connecting…" });
        } else if context.source == Source::Simulated {
            ui.heading("No robot is connected");
            hint_ui(ui, "Choose a source at the top: CAN, SLCAN, a recording, or the emulated robot.");
            ui.add_space(8.0);
            if ui.button("Try the emulated robot").clicked() {
                context.commands.send(Command::SelectSource(Source::Emulated));
            }
        } else {
            ui.heading("Not connected");
            hint_ui(ui, "Fill in the form and connect. Motors, IMU, bus and raw frames are shown here, the plots on the Tune tab.");
        }
    });
}
