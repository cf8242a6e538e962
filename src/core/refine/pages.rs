//! The report of a refinement: the data's health, the residual before, what was found and what lost, errors before and
//! after, the closed loop, what remains, and what to record next.

use crate::record::{Log, Severity};
use crate::report::{Block, Cell, Column, Document, Table, Tone, capitalised};

use super::closed_loop::{ClosedLoop, LoopRun};
use super::pictures;
use super::verdict::{Errors, Found, Outcome, Prediction, Quantity, Refinement, Verdict};

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
            blocks.push(Block::section("Declared parameters estimated from this log"));
            blocks.push(Block::Table(parameters(found)));
        }
    }
    let summary = format!(
        "Refinement of the model {}: its residual, the effects that it lacks, and the error \
         on held-out rows.",
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
        Verdict::DataUnfit => Block::notice(
            Tone::Warning,
            "Log not suitable for identification",
            "the logs are not suitable for identification, for the reasons below",
        ),
    }
}

fn said(found: &Found) -> String {
    format!(
        "{} ({}), error reduced by {:.1} %",
        found.effect.id(),
        found.effect.kind().summary,
        found.error_drop_percent
    )
}

fn health(found: &Refinement, [logs, held_out]: [&[Log]; 2], blocks: &mut Vec<Block>) {
    blocks.push(Block::section("Data health"));
    let items = logs.iter().map(|log| log.source.clone());
    let items = items.chain(held_out.iter().map(|log| format!("{}, held out", log.source))).collect();
    blocks.push(Block::List { numbered: false, items });
    let mut told: Vec<(&str, Vec<&str>)> = Vec::new();
    for finding in &found.data_health {
        let text = format!("{}: {}; {}", finding.column, finding.problem, finding.remedy);
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
            columns: vec![Column::new("Column", ""), Column::new("Characteristics", "")],
            rows: told
                .iter()
                .map(|(column, problems)| vec![Cell::text(*column), Cell::text(problems.join("; "))])
                .collect(),
            note: String::new(),
        }));
    }
}

/// Report sections on effects and candidates.
fn evidence(found: &Refinement, blocks: &mut Vec<Block>) {
    blocks.push(Block::section("Evidence"));
    if found.effects.is_empty() {
        blocks.push(Block::paragraph("No effect of the library was identified."));
    }
    for effect in &found.effects {
        let kind = effect.effect.kind();
        blocks.push(Block::part(kind.id));
        let others: Vec<&str> = effect.ambiguous_with.iter().map(|kind| kind.id).collect();
        let rivals = if others.is_empty() {
            String::new()
        } else {
            format!(" This log cannot distinguish it from {}.", others.join(", "))
        };
        blocks.push(Block::paragraph(format!(
            "{}. It reduces the error on held-out rows by {:.1} % compared with all other effects.{rivals} Best shown by: {}.",
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
    let row = |tried: &super::ScoredCandidate| {
        let added = tried.outcome == Outcome::Added;
        vec![
            Cell::text(format!("{} {}", tried.kind.id, tried.detail).trim().to_owned()),
            number(tried.gain_percent),
            number(tried.z),
            Cell::text(if added { "added".to_owned() } else { tried.outcome.to_string() }),
        ]
    };
    let left_out = found.candidates.len().saturating_sub(MOST_TRIED);
    let more =
        if left_out > 0 { format!("{left_out} more candidates with smaller gains.") } else { String::new() };
    Table {
        caption: "Candidates".to_owned(),
        columns: vec![
            Column::new("Effect", ""),
            Column::new("Error reduction, alone", "%"),
            Column::new("Size / standard error", ""),
            Column::new("Outcome", ""),
        ],
        rows: found.candidates.iter().take(MOST_TRIED).map(row).collect(),
        note: format!(
            "{more}Errors on left-out blocks of the fitted rows, with each effect alone added to the declared model."
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
        caption: "Effects in order of significance".to_owned(),
        columns: vec![
            Column::new("Effect", ""),
            Column::new("Parameter", ""),
            Column::new("Value", ""),
            Column::grouped("95 % interval", "from", ""),
            Column::grouped("95 % interval", "to", ""),
            Column::new("Unit", ""),
            Column::new("Error reduction", "%"),
            Column::new("Ambiguous with", ""),
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
    add("Residual relative to the torque or force", |errors| &errors.nrmse);
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
               their tolerances. 95 % intervals from blocks of the held-out rows."
            .to_owned(),
    }
}

fn predictions(found: &Refinement) -> Table {
    let row = |(before, after): (&Prediction, &Prediction)| {
        let cell = |quantity: &Quantity| number(quantity.value);
        let error = |own: &Prediction| if own.informative { cell(&own.rmse) } else { Cell::text("—") };
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
        caption: "Short predictions from the log's states and torques".to_owned(),
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
        note: "RMS over held-out initial states. Noise alone: error caused by measurement \
               noise at the start and the end. A balancing robot is unstable, so this noise grows with the horizon; a dash marks errors where it exceeds the motion."
            .to_owned(),
    }
}

fn simulated(closed_loop: &ClosedLoop, blocks: &mut Vec<Block>) {
    let heading =
        if closed_loop.scenarios.is_empty() { "In the controller" } else { "Simulated closed loop" };
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
            caption: "Refined model with the controllers of the declared and of the refined model".to_owned(),
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
            "Nothing significant at the level of the noise. This does not prove that no error remains.",
        ));
    } else {
        blocks.push(Block::notice(Tone::Warning, "Unexplained", found.unexplained.description.clone()));
    }
    let Some(next) = &found.next_experiment else { return };
    blocks.push(Block::part("Next experiment"));
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
        note: "A free parameter that does not differ significantly from its declared value keeps it; the interval \
               is from the log alone."
            .to_owned(),
    }
}
