//! The report of a refinement: what was found, errors before and after, and the residual as pictures.

use crate::record::{Log, Severity};
use crate::report::{Axis, Block, Cell, Chart, Column, Document, Mark, Panel, Series, Table, Tone};

use super::explorer::{Explorer, Variable};
use super::verdict::{Errors, Refinement, Verdict};

/// Bins of the pictures over a variable.
const BINS: usize = 90;

/// The report.
pub(super) fn document(found: &Refinement, logs: &[Log]) -> Document {
    let mut blocks = vec![verdict(found)];
    blocks.push(Block::section("Effects"));
    if found.effects.is_empty() {
        blocks.push(Block::paragraph("No effect of the library is named."));
    } else {
        blocks.push(Block::Table(effects(found)));
        for effect in &found.effects {
            blocks.push(Block::paragraph(format!(
                "{}: {}.",
                effect.effect.id(),
                effect.effect.kind().summary
            )));
        }
    }
    if !found.unexplained.description.is_empty() {
        blocks.push(Block::notice(Tone::Warning, "Unexplained", found.unexplained.description.clone()));
    }
    if let Some(next) = &found.next_experiment {
        blocks.push(Block::notice(Tone::Note, "Next experiment", next.summary.clone()));
    }
    blocks.push(Block::section("Error before and after"));
    blocks.push(Block::Table(errors(found)));
    blocks.extend(pictures(&found.explorer).into_iter().map(Block::Figure));
    blocks.push(Block::section("Declared numbers as this log has them"));
    blocks.push(Block::Table(parameters(found)));
    blocks.push(Block::section("Data"));
    blocks.push(Block::List { numbered: false, items: logs.iter().map(|log| log.source.clone()).collect() });
    for finding in &found.data_health {
        let (tone, label) = match finding.severity {
            Severity::Info => continue,
            Severity::Warning => (Tone::Note, "Warning"),
            Severity::Error => (Tone::Warning, "Error"),
        };
        let text = format!("{}: {}; {}", finding.column, finding.problem, finding.mend);
        blocks.push(Block::notice(tone, label, text));
    }
    let summary = format!(
        "What the logs say about the model {}: its residual, the effects that it lacks, and the error on rows that took no \
         part in the estimates.",
        found.model.name
    );
    Document { title: format!("{} refined", found.model.name), summary, blocks }
}

fn verdict(found: &Refinement) -> Block {
    match found.verdict {
        Verdict::ModelAdequate => Block::notice(
            Tone::Good,
            "Model adequate",
            "no effect of the library explains the log better than the declared model",
        ),
        Verdict::EffectsFound => Block::notice(
            Tone::Good,
            "Effects found",
            found.effects.iter().map(|effect| effect.effect.id()).collect::<Vec<_>>().join(", "),
        ),
        Verdict::UnexplainedResidual => Block::notice(
            Tone::Warning,
            "Unexplained residual",
            "the model lacks something that no effect of the library explains",
        ),
        Verdict::DataUnfit => {
            Block::notice(Tone::Warning, "Data unfit", "the logs cannot answer; the reasons stand below")
        }
    }
}

/// A number with five significant digits.
fn number(value: f64) -> Cell {
    if !value.is_finite() {
        return Cell::Empty;
    }
    let digits = if value == 0.0 { 0 } else { 4 - value.abs().log10().floor() as i32 };
    Cell::Number(format!("{value:.*}", digits.clamp(0, 9) as usize))
}

fn interval(ci95: Option<[f64; 2]>) -> [Cell; 2] {
    ci95.map_or([Cell::Empty, Cell::Empty], |ends| ends.map(number))
}

fn effects(found: &Refinement) -> Table {
    let mut rows = Vec::new();
    for effect in &found.effects {
        for (n, (key, value)) in effect.effect.parameters().iter().enumerate() {
            let [low, high] = interval(effect.ci95[n]);
            let first = n == 0;
            let others: Vec<&str> = effect.ambiguous_with.iter().map(|kind| kind.id).collect();
            rows.push(vec![
                Cell::text(effect.effect.id()),
                Cell::text(key.clone()),
                number(*value),
                low,
                high,
                Cell::text(effect.units[n]),
                if first { number(effect.error_drop_percent) } else { Cell::Empty },
                if first { Cell::text(others.join(", ")) } else { Cell::Empty },
            ]);
        }
    }
    Table {
        caption: "Effects in order of evidence".to_owned(),
        columns: vec![
            Column::new("Effect", ""),
            Column::new("Parameter", ""),
            Column::new("Value", ""),
            Column::grouped("95 % interval", "from", ""),
            Column::grouped("95 % interval", "to", ""),
            Column::new("Unit", ""),
            Column::new("Error lower by", "%"),
            Column::new("Not told from", ""),
        ],
        rows,
        note: String::new(),
    }
}

fn errors(found: &Refinement) -> Table {
    let mut rows = Vec::new();
    let mut add = |what: &str, of: fn(&Errors) -> &super::Channels| {
        for ((name, before), (_, after)) in of(&found.before).0.iter().zip(&of(&found.after).0) {
            rows.push(vec![
                Cell::text(format!("{what}, {name}")),
                number(before.value),
                number(after.value),
                Cell::text(before.unit),
            ]);
        }
    };
    add("Root mean square of the residual", |errors| &errors.rmse);
    add("Relative to the effort", |errors| &errors.nrmse);
    add("Noise of the sensors alone", |errors| &errors.noise_floor);
    Table {
        caption: "Residual on held-out rows".to_owned(),
        columns: vec![
            Column::new("Measure", ""),
            Column::new("Before", ""),
            Column::new("After", ""),
            Column::new("Unit", ""),
        ],
        rows,
        note: "The same rows and filters before and after; before: the declared model, its parameters estimated within \
               their tolerances."
            .to_owned(),
    }
}

fn parameters(found: &Refinement) -> Table {
    let row = |parameter: &super::Corrected| {
        let [low, high] = interval(parameter.ci95);
        vec![Cell::text(parameter.key), number(parameter.declared), number(parameter.value), low, high]
    };
    Table {
        caption: "Parameters".to_owned(),
        columns: vec![
            Column::new("Parameter", ""),
            Column::new("Declared", ""),
            Column::new("Estimated", ""),
            Column::grouped("95 % interval", "from", ""),
            Column::grouped("95 % interval", "to", ""),
        ],
        rows: found.parameters.iter().map(row).collect(),
        note: String::new(),
    }
}

fn pictures(explorer: &Explorer) -> Vec<Chart> {
    explorer.variables.iter().map(|variable| picture(explorer, variable)).collect()
}

/// The residual over a variable; over time as it is, over others as means in bins.
fn picture(explorer: &Explorer, variable: &Variable) -> Chart {
    let in_time = variable.name == "time_s";
    let held = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&explorer.held_out).filter(|(_, held)| **held).map(|(value, _)| *value).collect()
    };
    let values = held(&variable.values);
    let in_a_turn: Vec<f64> = if variable.name == "motor_angle_rad" {
        values.iter().map(|angle| angle.rem_euclid(std::f64::consts::TAU)).collect()
    } else {
        values
    };
    let series = |name: &str, residual: &[f64], mark: Mark| {
        let residual = held(residual);
        let points: Vec<[f64; 2]> = if in_time {
            in_a_turn.iter().zip(&residual).map(|(x, y)| [*x, *y]).collect()
        } else {
            binned(&in_a_turn, &residual)
        };
        Series::new(name, if in_time { Mark::Scatter } else { mark }, points)
    };
    Chart {
        title: format!("Residual over {}", variable.name),
        description: "Residual on held-out rows, before and after; means in bins, over time as it is."
            .to_owned(),
        x: Axis::new(variable.name, variable.unit),
        panels: vec![Panel::new(
            Axis::new(format!("Residual of {}", explorer.channel), explorer.unit),
            vec![
                series("before", &explorer.before, Mark::Dashed),
                series("after", &explorer.after, Mark::Line),
            ],
        )],
    }
}

/// Means of `values` in bins of `over` with the same number of rows.
fn binned(over: &[f64], values: &[f64]) -> Vec<[f64; 2]> {
    let mut pairs: Vec<[f64; 2]> = over.iter().zip(values).map(|(x, y)| [*x, *y]).collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let size = pairs.len().div_ceil(BINS).max(1);
    let mean = |bin: &[[f64; 2]]| {
        let sum = bin.iter().fold([0.0; 2], |sum, pair| [sum[0] + pair[0], sum[1] + pair[1]]);
        sum.map(|sum| sum / bin.len() as f64)
    };
    pairs.chunks(size).map(mean).collect()
}
