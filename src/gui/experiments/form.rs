//! Experiment settings: scenario, duration, seed, and the buttons that start and stop it.

use std::cell::Cell;
use std::rc::Rc;

use egui::{Button, ComboBox, Grid, ProgressBar, RichText, Ui, vec2};

use flqr_core::simulate::{Scenario, SpeedGains};

use super::preflight::Preflight;
use super::run::{LONGEST_S, SHORTEST_S, Settings, Variant};
use super::runs::Runs;
use crate::command::Command;
use crate::context::ViewContext;
use crate::theme::palette;
use crate::widgets::{entry_ui, hint_ui, number_ui, parse, section_ui, warning_ui};

/// Which of the last entries could not be taken as they were.
#[derive(Default)]
pub(super) struct Limited {
    seconds: bool,
    seed: bool,
}

/// The whole form.
pub(super) fn ui(
    context: &ViewContext<'_>,
    (settings, limited): (&mut Settings, &mut Limited),
    preflight: &mut Preflight,
    runs: &Runs,
    ui: &mut Ui,
) {
    section_ui(ui, "Experiment", |_| {});
    ui.add_enabled_ui(!runs.is_running(), |ui| {
        scenarios_ui(settings, limited, ui);
        let grid = Grid::new("experiment").num_columns(2).spacing([12.0, 4.0]);
        grid.show(ui, |ui| numbers_ui(settings, limited, ui));
        if limited.seconds {
            let limits = format!("The duration was limited: {SHORTEST_S} to {LONGEST_S} s here.");
            warning_ui(ui, limits);
        }
        if limited.seed {
            warning_ui(ui, "The seed was limited: 0 is the smallest.");
        }
    });
    ui.add_space(2.0);
    preflight.ui(context, settings, ui);
    run_ui(context, settings, runs, ui);
}

fn scenarios_ui(settings: &mut Settings, limited: &mut Limited, ui: &mut Ui) {
    ui.spacing_mut().item_spacing.y = 1.0;
    for scenario in Scenario::ALL {
        let chosen = settings.scenario == scenario;
        let button = Button::selectable(chosen, scenario.title()).min_size(vec2(ui.available_width(), 0.0));
        let button = ui.add(button.wrap_mode(egui::TextWrapMode::Truncate));
        if button.on_hover_text(scenario.description()).clicked() {
            settings.choose(scenario);
            *limited = Limited::default();
        }
    }
    ui.add_space(3.0);
    hint_ui(ui, settings.scenario.description());
    ui.add_space(3.0);
}

fn numbers_ui(settings: &mut Settings, limited: &mut Limited, ui: &mut Ui) {
    ui.label("duration");
    ui.horizontal(|ui| {
        let field = number_ui(ui, &mut settings.seconds, "duration of the runs", 58.0);
        let within = settings.seconds.clamp(SHORTEST_S, LONGEST_S);
        if field.changed() {
            limited.seconds = within != settings.seconds;
        }
        settings.seconds = within;
        field.on_hover_text(
            "Simulated time, at most 600 s in the window; use the command line for longer runs",
        );
        ui.label("s");
    });
    ui.end_row();
    ui.label("seed");
    let negative = Rc::new(Cell::new(None));
    let seen = Rc::clone(&negative);
    let read = move |text: &str| parse(text).inspect(|value| seen.set(Some(*value < 0.0)));
    let field = entry_ui(ui, &mut settings.seed, "experiment seed", |field| {
        field.min_size(vec2(58.0, 0.0)).custom_parser(read)
    });
    if let Some(negative) = negative.get().or(field.changed().then_some(false)) {
        limited.seed = negative;
    }
    field.on_hover_text("Random seed: the same model, settings and seed give the same result");
    ui.end_row();
    if !settings.scenario.on_ground() {
        gains_ui(settings, ui);
    }
}

/// Pairs of gains of the paper's Figures 6 and 7, kp in N m s/rad and ki in N m/rad.
const PAIRS: [(SpeedGains, &str); 3] = [
    (SpeedGains::PAPER, "0.5, 0.05"),
    (SpeedGains { kp: 0.05, ki: 0.05 }, "0.05, 0.05"),
    (SpeedGains { kp: 0.05, ki: 0.01 }, "0.05, 0.01"),
];

/// Gains of the speed control: the scenario's, one of the paper's pairs, or any.
fn gains_ui(settings: &mut Settings, ui: &mut Ui) {
    ui.label("gains");
    let paper = PAIRS.iter().find(|(pair, _)| settings.speed_gains == Some(*pair));
    let shown = match (settings.speed_gains, paper) {
        (None, _) => "default of the scenario",
        (_, Some((_, name))) => name,
        _ => "own",
    };
    let combo = ComboBox::from_id_salt("gains").selected_text(shown).width(110.0).show_ui(ui, |ui| {
        ui.selectable_value(&mut settings.speed_gains, None, "default of the scenario");
        for (pair, name) in PAIRS {
            ui.selectable_value(&mut settings.speed_gains, Some(pair), name);
        }
    });
    combo
        .response
        .on_hover_text(
            "kp and ki of the speed control: the scenario's default, or a pair from Figures 6 and 7 of the paper",
        )
        .accessible_name("gains of the speed control");
    ui.end_row();
    let Some(gains) = &mut settings.speed_gains else { return };
    for (name, value, unit) in [("kp", &mut gains.kp, "N m s/rad"), ("ki", &mut gains.ki, "N m/rad")] {
        ui.label(name);
        ui.horizontal(|ui| {
            number_ui(ui, value, &format!("gain {name}"), 58.0)
                .on_hover_text(format!("{name} of the speed control"));
            *value = value.max(0.0);
            ui.label(unit);
        });
        ui.end_row();
    }
}

fn run_ui(context: &ViewContext<'_>, settings: &Settings, runs: &Runs, ui: &mut Ui) {
    let names = Variant::ALL.map(|variant| variant.title(settings.scenario));
    if let Some(shares) = runs.shares() {
        if ui.button("Cancel runs").on_hover_text("Stop both runs (Ctrl+Enter)").clicked() {
            context.commands.send(Command::CancelExperiment);
        }
        let colors = palette(ui.visuals()).runs;
        for ((share, name), color) in shares.into_iter().zip(names).zip(colors) {
            let text = RichText::new(format!("{name} {:.0} %", 100.0 * share)).small();
            ui.add(ProgressBar::new(share as f32).fill(color.gamma_multiply(0.6)).text(text));
        }
        return;
    }
    let text = RichText::new(format!("Run {} and {}", names[0], names[1])).strong();
    let fill = ui.visuals().selection.bg_fill;
    let button = ui.add_sized([ui.available_width(), 26.0], Button::new(text).fill(fill));
    if button.on_hover_text("Run both with the current model (Ctrl+Enter)").clicked() {
        context.commands.send(Command::StartExperiment);
    }
}
