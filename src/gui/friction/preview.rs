//! Contents of the log: kind, rate, columns, first rows, and one column as a plot.

use egui::{ComboBox, RichText, ScrollArea, Ui};

use crate::context::ViewContext;
use crate::load::{LoadedLog, Loader};
use crate::plot::{Data, Panel, PanelCurve, Stack, UnitChoice};
use crate::quantity::of_column;
use crate::runs::Run;
use crate::theme::palette;
use crate::widgets::{choice_ui, empty_page_ui, hint_ui, mono, section_ui, shown};

const FIRST_ROWS: usize = 12;

#[derive(Clone, Copy, PartialEq)]
enum Show {
    Plot,
    Rows,
}

/// State of the preview.
pub(super) struct Preview {
    show: Show,
    column: Option<usize>,
    stack: Stack,
    /// The log that the view was fitted to.
    fitted_to: u64,
}

impl Default for Preview {
    fn default() -> Self {
        Self { show: Show::Plot, column: None, stack: Stack::new("log", 1.0), fitted_to: 0 }
    }
}

impl Preview {
    /// `row` is that of the log's last fit.
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, loader: &Loader, row: Option<&Run>, ui: &mut Ui) {
        section_ui(ui, "Measured", |ui| {
            if let Some(loaded) = loader.log() {
                self.controls_ui(loaded, ui);
            }
        });
        let Some(loaded) = loader.log() else {
            let hint = "Open a CSV file with units in its column names, or drop one here. Examples:";
            return empty_page_ui(ui, "No log yet.", hint, |ui| {
                for columns in [
                    "time_s, motor_angle_rad, torque_nm",
                    "speed_rad_s, torque_nm",
                    "time_s, position_m, force_n",
                ] {
                    ui.label(mono(columns));
                }
            });
        };
        hint_ui(ui, loaded.summary());
        match self.show {
            Show::Plot => {
                self.stack.sources = sources(loaded, row);
                self.plot_ui(context, loaded, ui);
            }
            Show::Rows => rows_ui(loaded, ui),
        }
    }

    fn controls_ui(&mut self, loaded: &LoadedLog, ui: &mut Ui) {
        ui.scope(|ui| {
            let choices = [
                (Show::Rows, "Rows", "The first rows as numbers"),
                (Show::Plot, "Plot", "One column as a curve"),
            ];
            choice_ui(ui, &mut self.show, &choices);
        });
        if self.show == Show::Rows {
            return;
        }
        if ui.button("Whole log").on_hover_text("Show the log from its start to its end").clicked() {
            self.fitted_to = 0;
        }
        let column = self.column(loaded);
        let key = &loaded.log.columns[column].name;
        let combo = ComboBox::from_id_salt("column").selected_text(title(key, ui)).width(170.0);
        let combo = combo.show_ui(ui, |ui| {
            for (index, column) in loaded.log.columns.iter().enumerate() {
                let choice = ui.selectable_value(&mut self.column, Some(index), title(&column.name, ui));
                choice.on_hover_text(&column.name);
            }
        });
        let help = format!("Signal to show: column {key}");
        combo.response.on_hover_text(help).accessible_name("column");
    }

    /// The chosen column, at first the one that matters for friction.
    fn column(&self, loaded: &LoadedLog) -> usize {
        let position = |name: &str| loaded.log.columns.iter().position(|column| column.name == name);
        let first = || ["torque_nm", "force_n", "torque_left_nm"].into_iter().find_map(position).unwrap_or(0);
        self.column.filter(|column| *column < loaded.log.columns.len()).unwrap_or_else(first)
    }

    fn plot_ui(&mut self, context: &ViewContext<'_>, loaded: &LoadedLog, ui: &mut Ui) {
        let column = self.column(loaded);
        let Some(column_data) = loaded.log.columns.get(column) else { return };
        let axis = loaded.axis_values();
        let data = [axis.first().copied().unwrap_or(0.0), axis.last().copied().unwrap_or(1.0)];
        if self.fitted_to != loaded.generation {
            self.fitted_to = loaded.generation;
            self.stack.show_all(data);
        }
        self.stack.update(data);
        self.stack.x = if loaded.axis.label == "row" { ["row", "row"] } else { ["time [s]", "time_s"] };
        let curve = PanelCurve {
            name: "".into(),
            key: (&column_data.name).into(),
            color: palette(ui.visuals()).channels[0],
            data: Data::Fixed(axis, &column_data.values),
            // A log has fewer than 2^16 columns; the pair identifies the data.
            generation: (loaded.generation << 16) | column as u64,
            gap: loaded.axis.gap,
        };
        let (name, unit) = of_column(&column_data.name);
        let panel = Panel {
            name: name.into(),
            unit,
            min_span: 1e-6,
            shown: true,
            curves: vec![curve],
            limits: Vec::new(),
        };
        ui.horizontal_wrapped(|ui| self.stack.tools_ui(ui, std::slice::from_ref(&panel)));
        self.stack.show(ui, &[panel]).send(context.commands);
    }
}

/// A column for people.
fn title(key: &str, ui: &Ui) -> String {
    let (name, unit) = of_column(key);
    match unit.shown(UnitChoice::of(ui.ctx())).0 {
        "" => name,
        unit => format!("{name} [{unit}]"),
    }
}

/// Source of the curve, for exports: the log, and what was made of it.
pub(super) fn sources(loaded: &LoadedLog, row: Option<&Run>) -> Vec<String> {
    let log = format!("log {}, sources {}", loaded.path.display(), loaded.sources.hex());
    std::iter::once(log).chain(row.map(Run::provenance)).collect()
}

fn rows_ui(loaded: &LoadedLog, ui: &mut Ui) {
    ScrollArea::both().show(ui, |ui| {
        egui::Grid::new("rows").striped(true).spacing([16.0, 3.0]).show(ui, |ui| {
            for column in &loaded.log.columns {
                ui.label(RichText::new(&column.name).small().strong());
            }
            ui.end_row();
            for row in 0..FIRST_ROWS.min(loaded.log.rows()) {
                for column in &loaded.log.columns {
                    ui.label(mono(column.values.get(row).map_or_else(String::new, |v| shown(*v, 6))));
                }
                ui.end_row();
            }
        });
    });
}
