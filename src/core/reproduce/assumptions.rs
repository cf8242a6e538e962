//! Parameters that the paper does not give, and their choice.

use super::pages::Pages;
use super::parameters::{Origin, Parameter, preface};
use super::phrases::listed;
use crate::report::{Block, Cell, Column, Table, number};
use crate::simulate::Scenario;

pub(super) fn write(parameters: &[Parameter], model_text: &str, pages: &mut Pages) {
    pages.section("Free parameters and how they were chosen");
    let counted = |(origin, words): (Origin, &str)| {
        let count = parameters.iter().filter(|parameter| parameter.origin == origin).count();
        (count > 0).then(|| format!("{count} {words}"))
    };
    let origins = [
        (Origin::Paper, "are printed in the paper"),
        (Origin::Derived, "derived from printed numbers"),
        (Origin::Assumed, "assumed"),
        (Origin::Standard, "standard"),
        (Origin::Default, "defaults of the program"),
        (Origin::NotStated, "without an explanation in the file"),
    ];
    let counts: Vec<_> = origins.into_iter().filter_map(counted).collect();
    pages.contradiction(
        11,
        format!(
            "The paper does not give wheel radius, inertias, pole length, Q, R or K. Of the {} parameters of this model, {}.",
            parameters.len(),
            listed(&counts),
        ),
    );
    let preface = preface(model_text);
    if !preface.is_empty() {
        pages.paragraph("Comments of the model file:");
        pages.blocks.push(Block::List { numbered: false, items: preface });
    }
    let described = |scenario: Scenario| format!("{}: {}", scenario.title(), scenario.description());
    let used =
        [Scenario::FrictionSweep, Scenario::SpeedTracking, Scenario::Flat, Scenario::Bridge, Scenario::Kick];
    pages.paragraph("Experiments and assumptions:");
    pages.blocks.push(Block::List { numbered: false, items: used.map(described).to_vec() });
    let cells = |parameter: &Parameter| {
        [&parameter.key, &short(&parameter.value), &parameter.unit, parameter.origin.words(), &parameter.how]
            .map(|text: &str| Cell::text(text))
            .to_vec()
    };
    pages.blocks.push(Block::Table(Table {
        caption: "Parameters of the model and their sources".to_owned(),
        columns: ["parameter", "value", "unit", "origin", "how"].map(|title| Column::new(title, "")).to_vec(),
        rows: parameters.iter().map(cells).collect(),
        note: "Keys as in the model file; default: not in the file.".to_owned(),
    }));
}

/// A long number of a file with six digits.
fn short(value: &str) -> String {
    match value.parse::<f64>() {
        Ok(number) if value.len() > 8 => number::significant(number, 6),
        _ => value.to_owned(),
    }
}
