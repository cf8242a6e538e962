//! Residual motion with FLQR and its causes.

use super::balance::{BRIDGE, FLAT, QUANTITIES, summaries};
use super::pages::Pages;
use super::phrases::{listed, sig};
use super::table::{Digits, Table};
use super::trials::Balanced;

pub(super) fn write(causes: &[(&'static str, Balanced)], pages: &mut Pages) {
    let [(_, whole), rest @ ..] = causes else { return };
    pages.section("Causes of the residual motion with FLQR");
    pages.paragraph("Flat ground with FLQR, with one imperfection removed at a time; the gain is unchanged.");
    let columns = QUANTITIES.map(|(name, unit)| (format!("std of {name}"), unit));
    let columns: Vec<_> = columns.iter().map(|(name, unit)| (name.as_str(), *unit)).collect();
    let mut table =
        Table::new("flqr_causes", "FLQR on flat ground without one of its imperfections", &columns)
            .digits(Digits::Significant(2));
    let deviations = |run: &Balanced| summaries(&run.statistics).map(|summary| summary.std);
    for (name, run) in causes {
        table.push(*name, [], deviations(run).map(Some));
    }
    pages.table(table);
    // The last two take all of them away, the last one the friction too.
    let [alone @ .., ideal, frictionless] = rest else { return };
    let whole = deviations(whole);
    let told: Vec<_> = QUANTITIES
        .into_iter()
        .enumerate()
        .filter_map(|(quantity, (name, unit))| {
            let value = |run: &Balanced| deviations(run)[quantity];
            let (cause, best) = alone.iter().min_by(|a, b| value(&a.1).total_cmp(&value(&b.1)))?;
            Some(format!("{name} from {} to {} {unit} with {cause}", sig(whole[quantity]), sig(value(best))))
        })
        .collect();
    let left = |(name, run): &(&str, Balanced)| {
        let values = QUANTITIES.into_iter().zip(deviations(run));
        let values: Vec<_> =
            values.map(|((quantity, unit), value)| format!("{} {unit} in {quantity}", sig(value))).collect();
        format!("with {name}, {} remain", listed(&values))
    };
    pages.paragraph(format!(
        "Largest reductions of the standard deviation by a single change: {}. {}; {}.",
        told.join("; "),
        capitalized(&left(ideal)),
        left(frictionless),
    ));
    pages.paragraph(reach(&deviations(&ideal.1)));
}

/// The paper's standard deviations under FLQR next to what an ideal robot of this model has.
fn reach(ideal: &[f64; 3]) -> String {
    let told = QUANTITIES.into_iter().enumerate().map(|(quantity, (name, unit))| {
        let [flat, bridge] = [FLAT, BRIDGE].map(|ground| ground.paper[quantity][1].std);
        let below = [(flat, "flat ground"), (bridge, "the bridge")]
            .into_iter()
            .filter(|(theirs, _)| *theirs < ideal[quantity])
            .map(|(_, place)| place.to_owned());
        let below: Vec<_> = below.collect();
        let verdict = if below.is_empty() {
            "neither is below".to_owned()
        } else {
            format!("that on {} is below", listed(&below))
        };
        format!("{name} {} and {} {unit}, {verdict}", sig(flat), sig(bridge))
    });
    let told: Vec<_> = told.collect();
    format!(
        "The paper's standard deviations with FLQR, on flat ground and on the bridge, compared with the simulation \
         with friction as the only imperfection: {}. Lower values cannot be reached with this robot and its feedforward by better sensors, motors or timing.",
        told.join("; ")
    )
}

fn capitalized(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}
