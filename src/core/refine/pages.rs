//! The report of a refinement: the data's health, the residual before, what was found and what lost, errors before and
//! after, the closed loop, what remains, and what to record next.

use crate::record::{Log, Severity};
use crate::report::{Block, Cell, Column, Document, Table, Tone, capitalised};

use super::closed_loop::{ClosedLoop, LoopRun};
use super::pictures;
use super::verdict::{Errors, Fate, Found, Prediction, Quantity, Refinement, Verdict};

/// Most rows of what was tried.
const MOST_TRIED: usize = 16;

/// The report.
pub(super) fn document(found: &Refinement, logs: &[Log], held_out: &[Log]) -> Document {
    let mut blocks = vec![verdict(found)];
    if !found.effects.is_empty() {
        blocks.push(Block::Table(effects(found)));
    }
    if let Some(next) = &found.next_experiment {
        blocks.push(Block::notice(Tone::Note, "Next experiment", next.summary.clone()));
    }
    health(found, [logs, held_out], &mut blocks);
    if found.verdict != Verdict::DataUnfit {
        blocks.push(Block::section("The residual"));
        blocks.extend(pictures::in_time(&found.explorer).map(Block::Figure));
        evidence(found, &mut blocks);
        blocks.push(Block::section("Error before and after"));
        blocks.push(Block::Table(errors(found)));
        if !found.before.prediction.is_empty() {
            blocks.push(Block::Table(predictions(found)));
        }
        if let Some(closed_loop) = &found.closed_loop {
            simulated(closed_loop, &mut blocks);
        }
        remains(found, &mut blocks);
        if !found.parameters.is_empty() {
            blocks.push(Block::section("Declared numbers as this log has them"));
            blocks.push(Block::Table(parameters(found)));
        }
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
            found.effects.iter().map(said).collect::<Vec<_>>().join("; "),
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

fn said(found: &Found) -> String {
    format!(
        "{} ({}), error lower by {:.1} %",
        found.effect.id(),
        found.effect.kind().summary,
        found.error_drop_percent
    )
}

fn health(found: &Refinement, [logs, held_out]: [&[Log]; 2], blocks: &mut Vec<Block>) {
    blocks.push(Block::section("Health of the data"));
    let items = logs.iter().map(|log| log.source.clone());
    let items = items.chain(held_out.iter().map(|log| format!("{}, held out", log.source))).collect();
    blocks.push(Block::List { numbered: false, items });
    let mut told: Vec<(&str, Vec<&str>)> = Vec::new();
    for finding in &found.data_health {
        let text = format!("{}: {}; {}", finding.column, finding.problem, finding.mend);
        match finding.severity {
            Severity::Info => {
                let place =
                    told.iter().position(|(column, _)| *column == finding.column).unwrap_or(told.len());
                if place == told.len() {
                    told.push((&finding.column, Vec::new()));
                }
                if !told[place].1.contains(&finding.problem.as_str()) {
                    told[place].1.push(&finding.problem);
                }
            }
            Severity::Warning => blocks.push(Block::notice(Tone::Note, "Warning", text)),
            Severity::Error => blocks.push(Block::notice(Tone::Warning, "Error", text)),
        }
    }
    if !told.is_empty() {
        blocks.push(Block::Table(Table {
            caption: "Rates, steps and held samples".to_owned(),
            columns: vec![Column::new("Column", ""), Column::new("What it is like", "")],
            rows: told
                .iter()
                .map(|(column, problems)| vec![Cell::text(*column), Cell::text(problems.join("; "))])
                .collect(),
            note: String::new(),
        }));
    }
}

/// What was found with its pictures, and what was tried beside it.
fn evidence(found: &Refinement, blocks: &mut Vec<Block>) {
    blocks.push(Block::section("Evidence"));
    if found.effects.is_empty() {
        blocks.push(Block::paragraph("No effect of the library is named."));
    }
    for effect in &found.effects {
        let kind = effect.effect.kind();
        blocks.push(Block::part(kind.id));
        let others: Vec<&str> = effect.ambiguous_with.iter().map(|kind| kind.id).collect();
        let rivals = if others.is_empty() {
            String::new()
        } else {
            format!(" This log cannot tell it from {}.", others.join(", "))
        };
        blocks.push(Block::paragraph(format!(
            "{}. With it the error on held-out rows is lower by {:.1} % than with all else alone.{rivals} What shows it best: {}.",
            capitalised(kind.summary),
            effect.error_drop_percent,
            kind.separated_by
        )));
    }
    blocks.extend(pictures::evidence(found).into_iter().map(Block::Figure));
    if !found.candidates.is_empty() {
        blocks.push(Block::Table(tried(found)));
    }
}

fn tried(found: &Refinement) -> Table {
    let row = |tried: &super::Tried| {
        let added = tried.fate == Fate::Added;
        vec![
            Cell::text(format!("{} {}", tried.kind.id, tried.detail).trim().to_owned()),
            number(tried.gain_percent),
            number(tried.z),
            Cell::text(if added { "added".to_owned() } else { tried.fate.to_string() }),
        ]
    };
    let left_out = found.candidates.len().saturating_sub(MOST_TRIED);
    let more =
        if left_out > 0 { format!("{left_out} more were tried and gain less. ") } else { String::new() };
    Table {
        caption: "What was tried".to_owned(),
        columns: vec![
            Column::new("Effect", ""),
            Column::new("Error lower by, alone", "%"),
            Column::new("Size by its standard error", ""),
            Column::new("What became of it", ""),
        ],
        rows: found.candidates.iter().take(MOST_TRIED).map(row).collect(),
        note: format!(
            "{more}Errors on left-out blocks of the fitted rows, each effect alone beside the declared model."
        ),
    }
}

/// A number with five significant digits.
fn number(value: f64) -> Cell {
    if !value.is_finite() {
        return Cell::Empty;
    }
    let digits = if value.fract() == 0.0 { 0 } else { 4 - value.abs().log10().floor() as i32 };
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
                if first { Cell::text(effect.effect.id()) } else { Cell::Empty },
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
            let mut row = vec![Cell::text(format!("{what}, {name}"))];
            for quantity in [before, after] {
                row.push(number(quantity.value));
                row.extend(interval(quantity.ci95));
            }
            row.push(Cell::text(if before.unit == "1" { "" } else { before.unit }));
            rows.push(row);
        }
    };
    add("Residual", |errors| &errors.rmse);
    add("Residual by the torque or force itself", |errors| &errors.nrmse);
    add("Noise floor of the residual", |errors| &errors.noise_floor);
    Table {
        caption: "Root mean squares on held-out rows".to_owned(),
        columns: vec![
            Column::new("Measure", ""),
            Column::grouped("Before", "value", ""),
            Column::grouped("Before", "from", ""),
            Column::grouped("Before", "to", ""),
            Column::grouped("After", "value", ""),
            Column::grouped("After", "from", ""),
            Column::grouped("After", "to", ""),
            Column::new("Unit", ""),
        ],
        rows,
        note: "The same rows and filters before and after; before: the declared model, its parameters estimated within \
               their tolerances. Intervals of 95 % by blocks of the held-out rows."
            .to_owned(),
    }
}

fn predictions(found: &Refinement) -> Table {
    let row = |(before, after): (&Prediction, &Prediction)| {
        let cell = |quantity: &Quantity| number(quantity.value);
        let error = |own: &Prediction| if own.told { cell(&own.rmse) } else { Cell::text("—") };
        vec![
            Cell::text(before.variable),
            Cell::Number(format!("{:.0}", 1e3 * before.horizon_s)),
            error(before),
            error(after),
            cell(&after.noise_floor),
            cell(&before.motion),
            Cell::text(before.rmse.unit),
        ]
    };
    Table {
        caption: "Short predictions from the log's own states under its torques".to_owned(),
        columns: vec![
            Column::new("Of", ""),
            Column::new("Ahead", "ms"),
            Column::grouped("Error", "declared", ""),
            Column::grouped("Error", "refined", ""),
            Column::new("Noise alone", ""),
            Column::new("Motion", ""),
            Column::new("Unit", ""),
        ],
        rows: found.before.prediction.iter().zip(&found.after.prediction).map(row).collect(),
        note: "Root mean squares over held-out starts. Noise alone: what the scatter of the readings at the start and the end \
               makes of it. A robot that balances is unstable, so that its noise grows with the horizon; where that alone is \
               more than the motion, the error tells nothing and a dash stands in its place."
            .to_owned(),
    }
}

fn simulated(closed_loop: &ClosedLoop, blocks: &mut Vec<Block>) {
    let heading =
        if closed_loop.scenarios.is_empty() { "In the controller" } else { "The closed loop, simulated" };
    blocks.push(Block::section(heading));
    let mut rows = Vec::new();
    for pair in &closed_loop.scenarios {
        let both = |what: &str, of: &dyn Fn(&LoopRun) -> f64, unit: &'static str| {
            vec![
                Cell::text(pair.scenario.clone()),
                Cell::text(what),
                number(of(&pair.before)),
                number(of(&pair.after)),
                Cell::text(unit),
            ]
        };
        rows.push(both("x, standard deviation", &|run| 1e3 * run.x_m.std, "mm"));
        rows.push(both("x, peak to peak", &|run| 1e3 * run.x_m.peak_to_peak, "mm"));
        rows.push(both("x_dot, standard deviation", &|run| 1e3 * run.x_dot_m_s.std, "mm/s"));
        rows.push(both("pitch, standard deviation", &|run| 1e3 * run.pitch_rad.std, "mrad"));
        rows.push(both("pitch, peak to peak", &|run| 1e3 * run.pitch_rad.peak_to_peak, "mrad"));
        let cycle = |run: &LoopRun| match (run.fell, run.limit_cycle) {
            (true, _) => Cell::text("fell"),
            (_, Some(cycle)) => {
                Cell::text(format!("{:.1} mm at {:.2} Hz", 1e3 * cycle.amplitude_m, cycle.frequency_hz))
            }
            (_, None) => Cell::text("none"),
        };
        rows.push(vec![
            Cell::text(pair.scenario.clone()),
            Cell::text("limit cycle"),
            cycle(&pair.before),
            cycle(&pair.after),
            Cell::Empty,
        ]);
    }
    if !rows.is_empty() {
        blocks.push(Block::Table(Table {
            caption: "The refined model under the controller of the declared and of the refined model"
                .to_owned(),
            columns: vec![
                Column::new("Scenario", ""),
                Column::new("Measure", ""),
                Column::new("Before", ""),
                Column::new("After", ""),
                Column::new("Unit", ""),
            ],
            rows,
            note: String::new(),
        }));
    }
    for fed in &closed_loop.feedforward {
        let (tone, label) = if fed.used { (Tone::Good, "used") } else { (Tone::Note, "not used") };
        let label = format!("{} in the controller: {label}", fed.effect.id);
        blocks.push(Block::notice(tone, label, fed.reason.clone()));
    }
}

fn remains(found: &Refinement, blocks: &mut Vec<Block>) {
    blocks.push(Block::section("What remains"));
    if found.unexplained.description.is_empty() {
        blocks.push(Block::paragraph(
            "Nothing that the tests of this program could tell from noise. That is no proof that nothing is left.",
        ));
    } else {
        blocks.push(Block::notice(Tone::Warning, "Unexplained", found.unexplained.description.clone()));
    }
    let Some(next) = &found.next_experiment else { return };
    blocks.push(Block::part("What to record next"));
    blocks.push(Block::paragraph(capitalised(&next.summary)));
    if let Some(command) = &next.command {
        blocks.push(Block::paragraph(format!("On the simulated robot: {command}")));
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
        note: "A free number that this log does not tell from the declared one stays as declared; its interval is what the \
               log alone says."
            .to_owned(),
    }
}
