//! Available connections and the commands that create more.

use egui::{Align, Button, Label, Layout, RichText, Ui};
use flqr_core::device::{Advice, CanInterface, Interfaces, SerialPort};

use crate::theme::palette;
use crate::widgets::{hint_ui, mono, warning_ui};

/// Draws the CAN interfaces to choose from; without any, the commands that create one.
pub(super) fn can_ui(found: Option<&Interfaces>, chosen: &mut String, ui: &mut Ui) {
    let Some(found) = found else {
        hint_ui(ui, "Looking for CAN interfaces…");
        return;
    };
    for interface in &found.can {
        offer_ui(&interface.name, &can_text(interface), interface.up, chosen, ui);
    }
    if found.can.is_empty() {
        warning_ui(ui, "No CAN interface found. To create one:");
        // The window itself does what the program's own commands would.
        let others = |advice: &&Advice| !advice.commands.iter().any(|command| command.starts_with("flqr "));
        for advice in found.advice.iter().filter(others) {
            hint_ui(ui, &advice.purpose);
            commands_ui(&advice.commands, ui);
        }
    }
    let down = found.can.iter().find(|interface| interface.name == *chosen && !interface.up);
    if let Some(command) = down.and_then(|interface| interface.command.as_ref()) {
        warning_ui(ui, format!("{chosen} is down. To bring it up:"));
        commands_ui(std::slice::from_ref(command), ui);
    }
}

/// Draws the serial ports to choose from.
pub(super) fn ports_ui(found: Option<&Interfaces>, chosen: &mut String, ui: &mut Ui) {
    let Some(found) = found else {
        hint_ui(ui, "Looking for serial ports…");
        return;
    };
    if found.serial.is_empty() {
        hint_ui(ui, "No serial port found. Plug it in and press Refresh, or type its path.");
    }
    for port in &found.serial {
        offer_ui(&port.port, &port_text(port), true, chosen, ui);
    }
}

/// Draws a line with the name and the state of an interface.
fn offer_ui(name: &str, text: &str, usable: bool, chosen: &mut String, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let button = Button::selectable(chosen == name, mono(name));
        if ui.add(button).on_hover_text(format!("Use {name}")).clicked() {
            name.clone_into(chosen);
        }
        let label = RichText::new(text).small();
        let warning = palette(ui.visuals()).warning;
        let label = if usable { label.weak() } else { label.color(warning) };
        ui.add(Label::new(label).truncate()).on_hover_text(text);
    });
}

fn can_text(interface: &CanInterface) -> String {
    let mut words = vec![if interface.up { "up" } else { "down" }.to_owned()];
    words.extend(interface.is_virtual.then(|| "virtual".to_owned()));
    words.extend(interface.bit_rate.map(bit_rate));
    words.extend(interface.state.map(|state| state.to_string().to_lowercase()));
    words.push(format!("{} errors", interface.errors));
    words.extend((interface.dropped > 0).then(|| format!("{} dropped", interface.dropped)));
    words.join(", ")
}

fn port_text(port: &SerialPort) -> String {
    let driver = port.driver.as_ref().map(|driver| format!("driver {driver}"));
    port.description.clone().or(driver).unwrap_or_else(|| "serial port".to_owned())
}

fn bit_rate(rate: u32) -> String {
    let rate = f64::from(rate);
    if rate < 1e6 { format!("{} kbit/s", rate / 1e3) } else { format!("{} Mbit/s", rate / 1e6) }
}

/// Draws commands, each with a button that copies it.
fn commands_ui(commands: &[String], ui: &mut Ui) {
    for command in commands {
        ui.horizontal(|ui| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.button("Copy").on_hover_text("Copy the command").clicked() {
                    ui.ctx().copy_text(command.clone());
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    ui.add(Label::new(mono(command).size(11.5)).wrap());
                });
            });
        });
    }
}
