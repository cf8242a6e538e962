//! Effects that the model has next to its declared numbers: their sizes, and whether the controller cancels them.

use egui::{Button, Checkbox, CollapsingHeader, Grid, Ui};
use flqr_core::effects::{Feedforward, name_and_unit};
use flqr_core::model::{Effect, Rig};
use flqr_core::report::capitalised;

use crate::command::Command;
use crate::context::ViewContext;
use crate::widgets::{hint_ui, mono, shown};

/// All of them; a change of one is a step that can be undone.
pub(super) fn ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let effects = match &context.session.rig {
        Rig::Robot(robot) => &robot.effects,
        Rig::Axis(axis) => &axis.effects,
    };
    if effects.is_empty() {
        return;
    }
    ui.add_space(4.0);
    CollapsingHeader::new("Effects").default_open(true).show(ui, |ui| {
        hint_ui(ui, "Effects of the simulated machine.");
        let mut changed = None;
        for (index, effect) in effects.iter().enumerate() {
            match effect_ui(index, effect, ui) {
                None => {}
                Some(Change::Feedforward(fed)) => match effect.clone().with_feedforward(fed) {
                    Ok(other) => {
                        let mut all = effects.clone();
                        all[index] = other;
                        changed = Some(all);
                    }
                    Err(problem) => context.commands.send(Command::Say(format!("Not accepted: {problem}."))),
                },
                Some(Change::Remove) => {
                    let mut all = effects.clone();
                    all.remove(index);
                    changed = Some(all);
                }
            }
        }
        if let Some(all) = changed {
            context.commands.send(Command::SetEffects(all));
        }
    });
}

enum Change {
    Feedforward(bool),
    Remove,
}

fn effect_ui(index: usize, effect: &Effect, ui: &mut Ui) -> Option<Change> {
    let kind = effect.kind();
    let place = effect.motor().map(|motor| format!(" of the {motor} motor")).unwrap_or_default();
    let name = format!("{}{place}", effect.id());
    let mut change = None;
    ui.horizontal(|ui| {
        ui.strong(&name).on_hover_text(format!("{}.", capitalised(kind.summary)));
        let remove = ui.add(Button::new("×").small().frame(false));
        let remove = remove.accessible_name(format!("remove {name}"));
        if remove.on_hover_text("Remove from the model").clicked() {
            change = Some(Change::Remove);
        }
    });
    let mut fed = effect.is_fed_forward();
    let (can_be_fed, help) = match kind.feedforward {
        Feedforward::Causal => (true, "Compensated by FLQR; always present in the simulation".to_owned()),
        Feedforward::Never(reason) => (false, format!("Cannot be compensated: {reason}")),
        Feedforward::Declared => (false, "The controller uses the corrected parameter".to_owned()),
    };
    let tick = ui.add_enabled(can_be_fed, Checkbox::new(&mut fed, "compensated by FLQR"));
    let tick = tick.accessible_name(format!("cancel {name}"));
    if tick.on_hover_text(&help).on_disabled_hover_text(&help).changed() {
        change = Some(Change::Feedforward(fed));
    }
    Grid::new(("effect", index)).num_columns(3).spacing([10.0, 2.0]).show(ui, |ui| {
        for (key, value) in effect.parameters() {
            let (name, unit) = name_and_unit(key);
            ui.label(name.replace('_', " ")).on_hover_text(key);
            ui.label(mono(shown(*value, 4)));
            ui.label(if unit == "1" { "" } else { unit });
            ui.end_row();
        }
    });
    change
}
