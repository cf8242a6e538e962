//! Section 4.4.3: Table 7 and Figure 12.

use super::balance::{CONTROLLERS, QUANTITIES, falls, panels, stood, three};
use super::pages::Pages;
use super::paper::{Range, TABLE_7};
use super::phrases::sig;
use super::table::{Digits, Table};
use super::trials::{KickWindows, Runs};
use crate::report::{Axis, Band, Chart};

fn width(range: Range) -> f64 {
    range[1] - range[0]
}

pub(super) fn write(runs: &Runs, windows: &KickWindows, pages: &mut Pages) {
    pages.section("A kick (section 4.4.3)");
    let [steady, disturbed] = [windows.steady_s, windows.disturbed_s];
    pages.paragraph(format!(
        "The robot is kicked at {} s, with {} N for {} s; the paper gives only the time. Steady state is {} to {} s, after \
         the response has decayed; disturbed is {} to {} s. The paper does not state which part of its run the table covers.",
        sig(windows.kick_s),
        sig(windows.force_n),
        sig(windows.duration_s),
        sig(steady[0]),
        sig(steady[1]),
        sig(disturbed[0]),
        sig(disturbed[1]),
    ));
    falls(runs, pages);
    let ranges = [0, 1].map(|controller: usize| runs[controller][0].ranges(windows));
    pages.table(range_table(&ranges));
    pages.table(ratio_table(&ranges));
    if runs[0].len() > 1 {
        pages.table(seed_table(runs, windows));
    }
    finding(&ranges, stood(runs, 0), pages);
    pages.note(displacement());
    let first = [&runs[0][0], &runs[1][0]];
    let band = |name: &str, x| Band { name: name.to_owned(), x: Some(x), y: None };
    pages.chart(Chart {
        title: "Figure 12: a kick".to_owned(),
        description: format!("Measured x, ẋ and pitch; the kick is at {} s.", sig(windows.kick_s)),
        x: Axis { range: Some(windows.shown_s), ..Axis::new("Time", "s") },
        panels: panels(first, windows.shown_s, &[band("steady", steady), band("disturbed", disturbed)]),
    });
}

/// Steady and disturbed range of x, ẋ and pitch.
type Ranges = [[Range; 2]; 3];

fn range_table(ranges: &[Ranges; 2]) -> Table {
    let columns = [("steady, least", ""), ("greatest", ""), ("disturbed, least", ""), ("greatest", "")];
    let mut table = Table::new("table_7", "Table 7: ranges during the kick and in steady state", &columns)
        .digits(Digits::Fixed(3))
        .note("A single value in the paper is used for both ends of the range.");
    for (quantity, (name, unit)) in QUANTITIES.into_iter().enumerate() {
        for (controller, label) in CONTROLLERS.into_iter().enumerate() {
            let theirs = [TABLE_7[quantity].steady[controller], TABLE_7[quantity].disturbed[controller]];
            let flat = |[steady, disturbed]: [Range; 2]| [steady, disturbed].into_iter().flatten().map(Some);
            table.push(format!("{name}, {unit}: {label}"), flat(theirs), flat(ranges[controller][quantity]));
        }
    }
    table
}

/// LQR's widths over FLQR's, steady and disturbed.
fn ratios(ranges: &[Ranges; 2]) -> [[f64; 2]; 3] {
    let ratio =
        |quantity: usize, state: usize| width(ranges[0][quantity][state]) / width(ranges[1][quantity][state]);
    std::array::from_fn(|quantity| [0, 1].map(|state| ratio(quantity, state)))
}

fn paper_ranges() -> [Ranges; 2] {
    [0, 1].map(|controller: usize| {
        std::array::from_fn(|quantity: usize| {
            [TABLE_7[quantity].steady[controller], TABLE_7[quantity].disturbed[controller]]
        })
    })
}

fn ratio_table(ranges: &[Ranges; 2]) -> Table {
    let columns = [("steady", ""), ("disturbed", "")];
    let mut table = Table::new("table_7_ratios", "Table 7, ratio of range widths LQR / FLQR", &columns)
        .digits(Digits::Fixed(1))
        .note("Empty where the paper prints one value for FLQR.");
    for ((name, _), (theirs, ours)) in
        QUANTITIES.into_iter().zip(ratios(&paper_ranges()).into_iter().zip(ratios(ranges)))
    {
        table.push(name, theirs.map(Some), ours.map(Some));
    }
    table
}

fn seed_table(runs: &Runs, windows: &KickWindows) -> Table {
    let title = format!("Table 7, ratio of range widths LQR / FLQR with {} noise seeds", runs[0].len());
    let columns = [("least", ""), ("median", ""), ("greatest", "")];
    let mut table = Table::new("table_7_seeds", title, &columns).digits(Digits::Fixed(1));
    let seeds = runs[0].iter().zip(&runs[1]);
    let all: Vec<_> = seeds.map(|(lqr, flqr)| ratios(&[lqr.ranges(windows), flqr.ranges(windows)])).collect();
    for (state, words) in ["steady", "disturbed"].into_iter().enumerate() {
        for (quantity, (name, _)) in QUANTITIES.into_iter().enumerate() {
            let values = all.iter().map(|ratios| ratios[quantity][state]).collect();
            table.push(format!("{name}, {words}"), [], three(values));
        }
    }
    table
}

fn finding(ranges: &[Ranges; 2], stood: bool, pages: &mut Pages) {
    let (theirs, ours) = (ratios(&paper_ranges()), ratios(ranges));
    let told: Vec<_> = QUANTITIES
        .into_iter()
        .enumerate()
        .map(|(quantity, (name, _))| {
            format!("{name} {} for {}", sig(ours[quantity][1]), sig(theirs[quantity][1]))
        })
        .collect();
    pages.finding(
        "table_7_disturbed",
        "During the kick, FLQR has narrower ranges than LQR",
        stood && ours.iter().all(|ratio| ratio[1] > 1.0),
        format!("Ratio of range widths LQR / FLQR, simulation (paper): {}.", told.join(", ")),
    );
}

/// Consistency of FLQR's printed speed and displacement during the kick.
fn displacement() -> String {
    const GRAVITY_M_S2: f64 = crate::model::STANDARD_GRAVITY_M_S2;
    let [x, speed, pitch] = [0, 1, 2].map(|quantity: usize| TABLE_7[quantity].disturbed[1]);
    let fastest = speed[0].abs().max(speed[1].abs());
    let steepest = width(pitch);
    let needed = fastest * fastest / (2.0 * GRAVITY_M_S2 * steepest);
    let allowed = width(x);
    let verdict = if needed > allowed {
        "more than its x allows, so the three printed values are inconsistent"
    } else {
        "which is consistent with its x"
    };
    format!(
        "The paper's FLQR reaches {} m/s during the kick, within {} m of x and {} rad of pitch. A balancing robot \
         decelerates at about g times its pitch; from that speed at that pitch, it needs {} m: {verdict}.",
        sig(fastest),
        sig(allowed),
        sig(steepest),
        sig(needed),
    )
}
