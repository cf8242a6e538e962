//! Connection settings and permissions.

use std::path::Path;

use egui::{Button, CollapsingHeader, ComboBox, Grid, RichText, TextEdit, Ui, vec2};
use flqr_core::control::ControllerKind;
use flqr_core::control::drive::Excitation;
use flqr_core::device::{
    Described, Interfaces, SerialAddress, SessionMode, SessionOptions, Source as DeviceSource,
};

use flqr_core::link::dbc::Choice;
use flqr_core::link::protocol::protocol;
use serde::{Deserialize, Serialize};

use super::discovery::{can_ui, ports_ui};
use super::link::sentence;
use crate::command::{Command, FilePurpose, Source};
use crate::context::ViewContext;
use crate::design::Designer;
use crate::session::Session;
use crate::widgets::{choice_ui, error_ui, hint_ui, number_ui, section_ui, warning_ui};

const BIT_RATES: [u32; 9] = [1_000_000, 800_000, 500_000, 250_000, 125_000, 100_000, 50_000, 20_000, 10_000];
const BAUD_RATES: [u32; 8] = [9600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 921_600];
/// Slowest and fastest replay.
pub(super) const REPLAY_SPEEDS: [f64; 2] = [0.1, 100.0];
/// Shortest and longest run with the wheels in the air, s.
const AIR_SECONDS: [f64; 2] = [1.0, 600.0];

/// Task of the motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Task {
    Balance,
    BalanceMultisine,
    SpeedSweep,
    Multisine,
}

impl Task {
    const ALL: [Self; 4] = [Self::Balance, Self::BalanceMultisine, Self::SpeedSweep, Self::Multisine];

    fn title(self) -> &'static str {
        match self {
            Self::Balance => "Balance",
            Self::BalanceMultisine => "Balance, with a multisine",
            Self::SpeedSweep => "Wheels in the air: speeds",
            Self::Multisine => "Wheels in the air: multisine",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Balance => "The controller of the Tune tab balances the robot.",
            Self::BalanceMultisine => {
                "The controller balances the robot with added multisine torques, to refine its model."
            }
            Self::SpeedSweep => {
                "Lift the robot: both wheels turn at a sequence of constant speeds, to fit friction."
            }
            Self::Multisine => "Lift the robot: multisine torques, to fit friction and inertia.",
        }
    }

    fn in_air(self) -> bool {
        matches!(self, Self::SpeedSweep | Self::Multisine)
    }
}

/// Typed and selected settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ConnectionForm {
    pub(crate) interface: String,
    pub(crate) port: String,
    pub(crate) bit_rate: String,
    pub(crate) imu_port: String,
    pub(crate) imu_baud: String,
    pub(crate) replay: String,
    pub(super) replay_speed: f64,
    /// Path of a DBC file and the assignment of its signals; empty if the motors speak the protocol of the model.
    dbc: String,
    signals: String,
    /// Never saved: a connection is listen-only until the operator chooses otherwise.
    #[serde(skip)]
    pub(super) may_drive: bool,
    #[serde(skip)]
    task: Task,
    air_s: f64,
    /// Reason why there is no file dialog.
    #[serde(skip)]
    pub(super) dialog_problem: Option<String>,
}

impl Default for ConnectionForm {
    fn default() -> Self {
        Self {
            interface: "can0".to_owned(),
            port: String::new(),
            bit_rate: "1000000".to_owned(),
            imu_port: String::new(),
            imu_baud: "115200".to_owned(),
            replay: String::new(),
            replay_speed: 1.0,
            dbc: String::new(),
            signals: String::new(),
            may_drive: false,
            task: Task::Balance,
            air_s: 120.0,
            dialog_problem: None,
        }
    }
}

impl ConnectionForm {
    /// Takes over what was given on the command line.
    pub(crate) fn fill(&mut self, source: &DeviceSource) {
        match source {
            DeviceSource::Can { interface } => self.interface.clone_from(interface),
            DeviceSource::Slcan { port, bit_rate } => {
                self.port.clone_from(port);
                self.bit_rate = bit_rate.to_string();
            }
            DeviceSource::Emulated => {}
            DeviceSource::Replay { file } => self.replay = file.display().to_string(),
        }
    }

    /// Takes over what was given on the command line.
    pub(crate) fn fill_imu(&mut self, imu: &SerialAddress) {
        self.imu_port.clone_from(&imu.port);
        self.imu_baud = imu.baud.to_string();
    }

    /// Command line that connects with these settings.
    pub(crate) fn command_line(
        &self,
        source: Source,
        (session, designer): (&Session, &Designer),
        controller: ControllerKind,
        model: Option<&Path>,
    ) -> Result<String, String> {
        if source == Source::Simulated {
            return Err("The simulated robot needs no connection. See the Experiments page.".to_owned());
        }
        let options = self.options(source, session, designer)?;
        Ok(crate::command_line::robot(&options, &self.signal_words(), controller, model))
    }

    fn signal_words(&self) -> Vec<&str> {
        self.signals.split([' ', ',', ';', '\n']).filter(|word| !word.is_empty()).collect()
    }

    /// Value for a session file: all settings except those that arm a robot.
    pub(crate) fn to_value(&self) -> serde_json::Value {
        serde_json::to_value(self).expect("strings and finite numbers always have a JSON form")
    }

    /// Takes over the value of a session file.
    pub(crate) fn take_value(&mut self, value: &serde_json::Value) -> Result<(), String> {
        let read: Self =
            serde_json::from_value(value.clone()).map_err(|_| "“connection” cannot be read".to_owned())?;
        *self = Self {
            replay_speed: read.replay_speed.clamp(REPLAY_SPEEDS[0], REPLAY_SPEEDS[1]),
            air_s: read.air_s.clamp(AIR_SECONDS[0], AIR_SECONDS[1]),
            ..read
        };
        Ok(())
    }

    /// Returns the options of the connection, or an error sentence if something is missing.
    pub(crate) fn options(
        &self,
        source: Source,
        session: &Session,
        designer: &Designer,
    ) -> Result<SessionOptions, String> {
        let robot = session.model_in_use();
        let robot = robot.robot().ok_or("This model is a single axis: load the model of a robot.")?.clone();
        let mode = if self.may_drive && source != Source::Replay {
            let gain = designer.in_force.map(|designed| designed.design.gain);
            let controller = gain.and_then(|gain| session.balance_controller(gain));
            let controller = controller.ok_or("There is no design to drive with. Change the weights.")?;
            SessionMode::Drive { controller: Box::new(controller), excitation: self.excitation() }
        } else {
            SessionMode::Listen
        };
        Ok(SessionOptions {
            source: self.source(source)?,
            imu: self.imu(source)?,
            dbc: self.described(source)?,
            robot,
            mode,
            record: None,
            seed: 1,
            replay_speed: self.replay_speed,
        })
    }

    fn source(&self, source: Source) -> Result<DeviceSource, String> {
        let typed = |text: &str, what: &str| match text.trim() {
            "" => Err(format!("{what} is empty. Choose or type one.")),
            text => Ok(text.to_owned()),
        };
        Ok(match source {
            Source::Simulated => return Err("The simulated robot needs no connection.".to_owned()),
            Source::Emulated => DeviceSource::Emulated,
            Source::Can => DeviceSource::Can { interface: typed(&self.interface, "The CAN interface")? },
            Source::Slcan => DeviceSource::Slcan {
                port: typed(&self.port, "The adapter's port")?,
                bit_rate: rate(&self.bit_rate, "The bit rate")?,
            },
            Source::Replay => {
                DeviceSource::Replay { file: typed(&self.replay, "The path of the recording")?.into() }
            }
        })
    }

    fn imu(&self, source: Source) -> Result<Option<SerialAddress>, String> {
        let port = self.imu_port.trim();
        if port.is_empty() || !matches!(source, Source::Can | Source::Slcan) {
            return Ok(None);
        }
        Ok(Some(SerialAddress { port: port.to_owned(), baud: rate(&self.imu_baud, "The IMU's baud rate")? }))
    }

    /// DBC description of another robot, if its frames come from a bus or a recording.
    fn described(&self, source: Source) -> Result<Option<Described>, String> {
        let file = self.dbc.trim();
        if file.is_empty() || !matches!(source, Source::Can | Source::Slcan | Source::Replay) {
            return Ok(None);
        }
        let signals = self
            .signal_words()
            .into_iter()
            .map(|word| word.parse::<Choice>().map_err(|error| sentence(&error.to_string())));
        let signals = signals.collect::<Result<Vec<_>, _>>()?;
        if signals.is_empty() {
            return Err("No signal of the DBC file is selected. Type for example pitch=Imu.Pitch.".to_owned());
        }
        if self.may_drive && source != Source::Replay {
            return Err(
                "A robot described by a DBC file can only be monitored. Choose “Listen only”.".to_owned()
            );
        }
        Ok(Some(Described { file: file.into(), signals }))
    }

    fn excitation(&self) -> Excitation {
        match self.task {
            Task::Balance => Excitation::Balance,
            Task::BalanceMultisine => Excitation::BalanceMultisine,
            Task::SpeedSweep => Excitation::SpeedSweep { seconds: self.air_s },
            Task::Multisine => Excitation::Multisine { seconds: self.air_s },
        }
    }

    /// Draws the form; `found` lists the available connections, once they are known.
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, found: Option<&Interfaces>, ui: &mut Ui) {
        let wired = matches!(context.source, Source::Can | Source::Slcan);
        section_ui(ui, "Connection", |ui| {
            let help = "Refresh the list of interfaces and ports";
            if wired && ui.button("Refresh").on_hover_text(help).clicked() {
                context.commands.send(Command::RefreshInterfaces);
            }
        });
        match context.source {
            Source::Simulated => {}
            Source::Emulated => {
                hint_ui(ui, "Emulates a robot with the real protocols in this program, without hardware.");
            }
            Source::Can => self.can_ui(found, ui),
            Source::Slcan => self.slcan_ui(found, ui),
            Source::Replay => self.replay_ui(context, ui),
        }
        if wired {
            self.imu_ui(found, ui);
        }
        if wired || context.source == Source::Replay {
            self.dbc_ui(ui);
        }
        if context.source != Source::Replay {
            self.mode_ui(context, ui);
        }
        self.connect_ui(context, ui);
    }

    fn can_ui(&mut self, found: Option<&Interfaces>, ui: &mut Ui) {
        can_ui(found, &mut self.interface, ui);
        Grid::new("can").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
            field_ui(ui, "interface", &mut self.interface, "can0", "CAN interface");
        });
    }

    fn slcan_ui(&mut self, found: Option<&Interfaces>, ui: &mut Ui) {
        ports_ui(found, &mut self.port, ui);
        Grid::new("slcan").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
            field_ui(ui, "adapter", &mut self.port, "/dev/ttyACM0", "port of the adapter");
            rate_ui(ui, "bit rate", &mut self.bit_rate, &BIT_RATES, "bit rate of the CAN bus");
        });
    }

    fn imu_ui(&mut self, found: Option<&Interfaces>, ui: &mut Ui) {
        section_ui(ui, "IMU", |_| {});
        ports_ui(found, &mut self.imu_port, ui);
        Grid::new("imu").num_columns(2).spacing([10.0, 4.0]).show(ui, |ui| {
            field_ui(ui, "port", &mut self.imu_port, "none: wheels only", "port of the IMU");
            rate_ui(ui, "baud rate", &mut self.imu_baud, &BAUD_RATES, "baud rate of the IMU");
        });
    }

    fn replay_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let field = TextEdit::singleline(&mut self.replay)
            .hint_text("path of a recording (.csv or .log)")
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("recording to replay");
        if field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) {
            context.commands.send(Command::Connect);
        }
        ui.horizontal(|ui| {
            if ui.button("Open…").on_hover_text("Choose a recording").clicked() {
                context.commands.send(Command::ShowDialog(FilePurpose::OpenReplay));
            }
            ui.menu_button("Recent", |ui| {
                if context.recent.recordings.is_empty() {
                    ui.weak("no recording yet");
                }
                for path in &context.recent.recordings {
                    let name = path.display().to_string();
                    if ui.button(&name).clicked() {
                        self.replay = name;
                        ui.close();
                    }
                }
            });
        });
        if let Some(problem) = &self.dialog_problem {
            warning_ui(ui, problem);
        }
        ui.horizontal(|ui| {
            ui.label("speed");
            speed_ui(&mut self.replay_speed, ui);
        });
    }

    fn dbc_ui(&mut self, ui: &mut Ui) {
        CollapsingHeader::new("Another robot (DBC file)").show(ui, |ui| {
            hint_ui(ui, "For motors with another protocol than the model's: file that describes its frames, and the mapping of its signals.");
            let field = |text, hint| TextEdit::singleline(text).hint_text(hint).desired_width(f32::INFINITY);
            ui.add(field(&mut self.dbc, "none: protocol of the model")).accessible_name("DBC file");
            let signals = TextEdit::multiline(&mut self.signals)
                .hint_text("pitch=Imu.Pitch\nmotor_speed_left=SpeedLeft\nmotor_speed_right=SpeedRight")
                .desired_rows(3)
                .desired_width(f32::INFINITY);
            ui.add(signals).accessible_name("signals of the DBC file").on_hover_text(
                "One per line: COLUMN=MESSAGE.SIGNAL, with *FACTOR if the unit is unclear",
            );
        });
    }

    fn mode_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Purpose", |ui| {
            ui.scope(|ui| {
                let choices = [
                    (true, "May drive", "Listens until it is armed in two steps"),
                    (false, "Listen only", "Nothing is ever sent"),
                ];
                choice_ui(ui, &mut self.may_drive, &choices);
            });
        });
        if !self.may_drive {
            hint_ui(ui, "Listen-only: no frame is sent.");
            return;
        }
        self.task_ui(ui);
        let robot = context.session.robot();
        let wired = matches!(context.source, Source::Can | Source::Slcan);
        let torques = robot.map(|robot| (protocol(robot.link.protocol).host)(&robot.link).torque_range());
        if let Some(Err(missing)) = torques.filter(|_| wired) {
            warning_ui(ui, format!("Torque cannot be commanded: {missing}."));
        }
    }

    fn task_ui(&mut self, ui: &mut Ui) {
        ui.scope(|ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for task in Task::ALL {
                let button = Button::selectable(self.task == task, task.title());
                let button = ui.add(button.min_size(vec2(ui.available_width(), 0.0)));
                if button.on_hover_text(task.help()).clicked() {
                    self.task = task;
                }
            }
        });
        hint_ui(ui, self.task.help());
        if self.task.in_air() {
            ui.horizontal(|ui| {
                ui.label("duration");
                number_ui(ui, &mut self.air_s, "duration with the wheels in the air", 52.0)
                    .on_hover_text("1 to 600 s in total");
                self.air_s = self.air_s.clamp(AIR_SECONDS[0], AIR_SECONDS[1]);
                ui.label("s");
            });
        }
    }

    fn connect_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        ui.add_space(4.0);
        let ready = self.options(context.source, context.session, context.designer);
        let (name, enabled) = if context.link.is_opening() {
            ("Connecting…", false)
        } else if context.link.is_closing() {
            ("Disconnecting…", false)
        } else {
            (if context.source == Source::Replay { "Replay" } else { "Connect" }, ready.is_ok())
        };
        let button = Button::new(RichText::new(name).strong()).min_size(vec2(ui.available_width(), 28.0));
        let button = ui.vertical_centered(|ui| ui.add_enabled(enabled, button)).inner;
        let button = match &ready {
            Ok(options) => button.on_hover_text(format!("Open {}", options.source)),
            Err(problem) => button.on_disabled_hover_text(problem),
        };
        if button.clicked() {
            context.commands.send(Command::Connect);
        }
        if context.link.is_opening() && ui.button("Cancel").clicked() {
            context.commands.send(Command::Disconnect);
        }
        if let Err(problem) = &ready {
            hint_ui(ui, problem);
        }
        if let Some(problem) = &context.link.problem {
            error_ui(ui, problem);
        }
    }
}

/// Draws the replay speed, in the form and while a replay runs; returns whether it was changed.
pub(super) fn speed_ui(speed: &mut f64, ui: &mut Ui) -> bool {
    let [least, greatest] = REPLAY_SPEEDS;
    let before = *speed;
    let slider = egui::Slider::new(speed, least..=greatest).logarithmic(true).show_value(false);
    ui.add(slider).accessible_name("replay speed").on_hover_text("1 × is real time");
    number_ui(ui, speed, "replay speed value", 40.0).on_hover_text("1 × is real time");
    *speed = speed.clamp(least, greatest);
    ui.label("×");
    *speed != before
}

fn rate(text: &str, what: &str) -> Result<u32, String> {
    let digits: String = text.chars().filter(|letter| !letter.is_whitespace()).collect();
    match digits.parse() {
        Ok(rate) if rate > 0 => Ok(rate),
        _ => Err(format!("{what} must be a whole number above 0, not {text:?}.")),
    }
}

fn field_ui(ui: &mut Ui, label: &str, text: &mut String, hint: &str, name: &str) {
    ui.label(label);
    let field = TextEdit::singleline(text).hint_text(hint).desired_width(f32::INFINITY);
    ui.add(field).accessible_name(name);
    ui.end_row();
}

fn rate_ui(ui: &mut Ui, label: &str, text: &mut String, choices: &[u32], name: &str) {
    ui.label(label);
    ui.horizontal(|ui| {
        ui.add(TextEdit::singleline(text).desired_width(72.0)).accessible_name(name);
        ui.label("bit/s");
        let combo = ComboBox::from_id_salt(name).selected_text("usual").width(56.0).show_ui(ui, |ui| {
            for choice in choices {
                let chosen = text.trim() == choice.to_string();
                if ui.selectable_label(chosen, choice.to_string()).clicked() {
                    *text = choice.to_string();
                }
            }
        });
        combo.response.accessible_name(format!("usual values of the {name}"));
    });
    ui.end_row();
}
