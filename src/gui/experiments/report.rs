//! Both runs as a document and as a chart: what is saved holds what is shown, and how it was made.

use flqr_core::report::{
    Axis, Block, Cell, Chart, Column, Document, Mark, Panel, Series, Table, Tone, capitalised, number,
};

use super::run::{Recorded, Variant};
use super::runs::Comparison;
use super::signals::Signal;
use super::table::factor;
use crate::quantity::MOTORS;

/// The whole report; statistics over `range_s`.
pub(super) fn document(comparison: &Comparison, range_s: [f64; 2]) -> Document {
    let scenario = comparison.settings.scenario;
    let names = Variant::ALL.map(|variant| variant.title(scenario));
    let mut blocks = Vec::new();
    for (name, sentence) in comparison.failures() {
        blocks.push(Block::notice(Tone::Warning, name, sentence));
    }
    for (name, warning) in comparison.warnings() {
        blocks.push(Block::notice(Tone::Note, name, format!("{warning}.")));
    }
    blocks.extend(statistics(comparison, range_s).into_iter().chain(tracking(comparison)).map(Block::Table));
    blocks.push(Block::Figure(chart(comparison, [0.0, comparison.end_s()])));
    blocks.push(Block::section("Reproduction"));
    blocks.push(Block::paragraph(format!(
        "Model “{}”, {} s, seed {}. Commands to repeat the runs:",
        comparison.model.name, comparison.settings.seconds, comparison.settings.seed
    )));
    let items = Variant::ALL.map(|variant| comparison.command_line(variant)).to_vec();
    blocks.push(Block::List { numbered: false, items });
    let rows = comparison.provenances();
    if !rows.is_empty() {
        blocks.push(Block::paragraph(format!("Runs: {}.", rows.join("; "))));
    }
    blocks.push(Block::part("The model"));
    let lines = comparison.model.to_toml();
    let lines = lines.lines().filter(|line| !line.trim().is_empty()).map(str::to_owned);
    blocks.push(Block::List { numbered: false, items: lines.collect() });
    Document {
        title: format!("{}: {} and {}", scenario.title(), names[0], names[1]),
        summary: scenario.description().to_owned(),
        blocks,
    }
}

/// All signals of both runs between two times.
pub(super) fn chart(comparison: &Comparison, range_s: [f64; 2]) -> Chart {
    let scenario = comparison.settings.scenario;
    let signals = comparison.signals(false);
    let panel = |(column, signal): (usize, &Signal)| {
        let mut series = comparison
            .recorded()
            .map(|(variant, run)| series(variant.title(scenario), run, &run.columns[column], range_s))
            .collect::<Vec<_>>();
        let target = comparison.recorded().find_map(|(_, run)| Some((run, run.target_rad_s.as_ref()?)));
        if let (true, Some((run, values))) = (signal.has_target, target) {
            series.push(Series { mark: Mark::Dashed, ..self::series("target", run, values, range_s) });
        }
        Panel::new(Axis::new(capitalised(signal.quantity.name), signal.quantity.unit), series)
    };
    let names: Vec<_> = comparison.recorded().map(|(variant, _)| variant.title(scenario)).collect();
    let plotted: Vec<_> = signals.iter().map(|signal| signal.quantity.name).collect();
    let rows: String = comparison.provenances().iter().map(|row| format!(" Of {row}.")).collect();
    Chart {
        title: format!("{}, {}", scenario.title(), names.join(" and ")),
        description: format!(
            "{} over time, from {} to {} s.{rows}",
            capitalised(&plotted.join(", ")),
            number::significant(range_s[0], 4),
            number::significant(range_s[1], 4)
        ),
        x: Axis { range: Some(range_s), ..Axis::new("Time", "s") },
        panels: signals.iter().enumerate().map(panel).collect(),
    }
}

fn series(name: &str, run: &Recorded, values: &[f64], range_s: [f64; 2]) -> Series {
    let inside = run.time_s.partition_point(|time| *time < range_s[0])
        ..run.time_s.partition_point(|time| *time <= range_s[1]);
    Series::new(name, Mark::Line, inside.map(|index| [run.time_s[index], values[index]]))
}

fn statistics(comparison: &Comparison, range_s: [f64; 2]) -> Option<Table> {
    let found = comparison.statistics_between(range_s);
    if found.iter().all(Option::is_none) {
        return None;
    }
    let mut columns = vec![Column::new("Quantity", "")];
    for variant in Variant::ALL {
        let name = variant.title(comparison.settings.scenario);
        columns.extend(["from", "to", "mean", "std"].map(|title| Column::grouped(name, title, "")));
    }
    columns.extend(["range", "std"].map(|title| Column::grouped("factor", title, "")));
    let row = |(index, signal): (usize, &Signal)| {
        let pair = [0, 1].map(|run: usize| found[run].as_ref().map(|found| found[index]));
        let name = format!("{}, {}", capitalised(signal.quantity.name), signal.quantity.unit);
        let numbers = pair.into_iter().flat_map(|summary| {
            summary.map_or([const { Cell::Empty }; 4], |s| {
                [s.min, s.max, s.mean, s.std].map(|value| Cell::significant(value, 3))
            })
        });
        let factors = [factor(pair, |s| s.max - s.min), factor(pair, |s| s.std)];
        let factors = factors.map(|ratio| ratio.map_or(Cell::Empty, |ratio| Cell::significant(ratio, 3)));
        std::iter::once(Cell::text(name)).chain(numbers).chain(factors).collect()
    };
    Some(Table {
        caption: format!(
            "Statistics from {} to {} s",
            number::significant(range_s[0], 5),
            number::significant(range_s[1], 5)
        ),
        columns,
        rows: comparison.signals(false).iter().enumerate().map(row).collect(),
        note: "Range, mean and standard deviation of the recorded signals; ratio of the first run to the second."
            .to_owned(),
    })
}

fn tracking(comparison: &Comparison) -> Option<Table> {
    let mut rows = Vec::new();
    for (variant, run) in comparison.recorded() {
        for (motor, response) in run.tracking()?.iter().enumerate() {
            let rise = response.rise_time_s;
            rows.push(vec![
                Cell::text(format!("{}, {}", variant.title(comparison.settings.scenario), MOTORS[motor])),
                rise.map_or_else(|| Cell::text("never"), |time| Cell::significant(time, 3)),
                Cell::significant(response.overshoot_rad_s, 3),
                Cell::significant(response.steady_error_rad_s, 3),
            ]);
        }
    }
    Some(Table {
        caption: "Step of the target speed".to_owned(),
        columns: vec![
            Column::new("Motor", ""),
            Column::new("rise time, 10 to 90 %", "s"),
            Column::new("overshoot", "rad/s"),
            Column::new("steady error", "rad/s"),
        ],
        rows,
        note: String::new(),
    })
}
