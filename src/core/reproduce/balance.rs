//! Section 4.4 without the kick: Tables 5 and 6, Figures 8 and 10.

use super::pages::Pages;
use super::paper::{self, BalanceTable};
use super::phrases::{listed, sig};
use super::table::{Digits, Table};
use super::trials::{Balanced, Runs};
use crate::model::RobotModel;
use crate::report::{Axis, Band, Chart, Mark, Panel, Series};
use crate::simulate::{Statistics, Summary};

/// Tolerated factor between LQR's range and standard deviation and the paper's.
const LQR_TOLERANCE: f64 = 1.5;
pub(super) const CONTROLLERS: [&str; 2] = ["LQR", "FLQR"];
/// Name and unit of what is balanced.
pub(super) const QUANTITIES: [(&str, &str); 3] = [("x", "m"), ("ẋ", "m/s"), ("pitch", "rad")];

/// One of the two experiments with the places of its results in the paper.
pub(super) struct Ground {
    pub(super) title: &'static str,
    pub(super) on: &'static str,
    pub(super) table: usize,
    pub(super) figure: usize,
    pub(super) paper: BalanceTable,
    /// Motion of the robot.
    does: &'static str,
    /// Start of the figure before the statistics; the whole run without a drive.
    shown_before_s: f64,
    findings: [&'static str; 2],
}

pub(super) const FLAT: Ground = Ground {
    title: "Balance on flat ground (section 4.4.1)",
    on: "flat ground",
    table: 5,
    figure: 8,
    paper: paper::TABLE_5,
    does: "is released nearly upright on flat ground and stands",
    shown_before_s: f64::INFINITY,
    findings: ["table_5_lqr", "table_5_factors"],
};
pub(super) const BRIDGE: Ground = Ground {
    title: "Balance on a single-sided bridge (section 4.4.2)",
    on: "the single-sided bridge",
    table: 6,
    figure: 10,
    paper: paper::TABLE_6,
    does: "drives onto a bridge under one wheel and stands there; x is relative to the target position",
    shown_before_s: 5.0,
    findings: ["table_6_lqr", "table_6_factors"],
};

/// x, ẋ and pitch of a run.
pub(super) fn summaries(statistics: &Statistics) -> [Summary; 3] {
    [statistics.x_m, statistics.x_dot_m_s, statistics.pitch_rad]
}

fn width(summary: &Summary) -> f64 {
    summary.max - summary.min
}

/// LQR's standard deviations over FLQR's.
pub(super) fn factors(lqr: &[Summary; 3], flqr: &[Summary; 3]) -> [f64; 3] {
    std::array::from_fn(|quantity| lqr[quantity].std / flqr[quantity].std)
}

/// Values of one of the paper's tables.
pub(super) fn paper_factors(table: &BalanceTable) -> [f64; 3] {
    table.map(|[lqr, flqr]| lqr.std / flqr.std)
}

/// The factors of each seed.
pub(super) fn factors_over_seeds(runs: &Runs) -> Vec<[f64; 3]> {
    let [lqr, flqr] = runs;
    lqr.iter()
        .zip(flqr)
        .map(|(lqr, flqr)| factors(&summaries(&lqr.statistics), &summaries(&flqr.statistics)))
        .collect()
}

/// Returns whether neither run of a seed, counted from 0, ended with a fall: figures of one that did assess nothing.
pub(super) fn stood(runs: &Runs, seed: usize) -> bool {
    runs.iter().all(|controller| controller[seed].fell_at_s.is_none())
}

/// Sections common to both experiments.
pub(super) fn introduce(robot: &RobotModel, pages: &mut Pages) {
    pages.section("Interpretation of Tables 5 to 7 (section 4.4)");
    if let Some(compensation) = robot.compensation {
        pages.contradiction(
            8,
            format!(
                "Eq. 28 has sign(q̇), which is undefined at standstill and chatters with a quantized speed; \
                 the paper does not state the feedforward there. Here, the direction is tanh(q̇ / {} rad/s) and the feedforward is scaled by {}; both are parameters of the model.",
                sig(compensation.smoothing_speed_rad_s),
                sig(compensation.ratio),
            ),
        );
    }
    pages.contradiction(4, pitch_unit(robot));
    pages.contradiction(3, spread_name());
}

pub(super) fn write(ground: &Ground, robot: &RobotModel, runs: &Runs, pages: &mut Pages) {
    pages.section(ground.title);
    let first = [0, 1].map(|controller: usize| &runs[controller][0]);
    pages.paragraph(format!(
        "The robot {}. Each run lasts {} s; the statistics are of the measured signals after {} s. The paper does \
         not state which part of its runs the tables cover.",
        ground.does,
        sig(first[0].seconds),
        sig(first[0].statistics.from_s),
    ));
    falls(runs, pages);
    pages.table(statistics_table(ground, first));
    pages.table(factor_table(ground, first));
    if runs[0].len() > 1 {
        pages.table(seed_table(ground, runs));
    }
    let ours = first.map(|run| summaries(&run.statistics));
    lqr_finding(ground, runs, &ours[0], pages);
    factor_finding(ground, runs, pages);
    pages.paragraph(oscillation(ground, robot, &ours[0]));
    pages.paragraph(rounding(ground));
    pages.chart(chart(ground, first));
}

/// Says which runs ended in a fall.
pub(super) fn falls(runs: &Runs, pages: &mut Pages) {
    for (runs, name) in runs.iter().zip(CONTROLLERS) {
        for (number, run) in runs.iter().enumerate() {
            if let Some(time) = run.fell_at_s {
                pages.warning(format!(
                    "with {name} the robot fell at {} s in run {}: its numbers are up to that time",
                    sig(time),
                    number + 1
                ));
            }
        }
    }
}

fn statistics_table(ground: &Ground, runs: [&Balanced; 2]) -> Table {
    let title = format!("Table {}: {}", ground.table, ground.on);
    let columns = [("least", ""), ("greatest", ""), ("mean", ""), ("std", "")];
    let mut table = Table::new(format!("table_{}", ground.table), title, &columns)
        .digits(Digits::Fixed(4))
        .note("Std is the standard deviation, which the paper calls variance; its pitch is taken as rad.");
    for (quantity, (name, unit)) in QUANTITIES.into_iter().enumerate() {
        for (controller, label) in CONTROLLERS.into_iter().enumerate() {
            let all = |summary: Summary| [summary.min, summary.max, summary.mean, summary.std].map(Some);
            let ours = summaries(&runs[controller].statistics)[quantity];
            table.push(
                format!("{name}, {unit}: {label}"),
                all(ground.paper[quantity][controller]),
                all(ours),
            );
        }
    }
    table
}

fn factor_table(ground: &Ground, runs: [&Balanced; 2]) -> Table {
    let title = format!("Table {}, ratio LQR / FLQR", ground.table);
    let columns = [("std", ""), ("range", "")];
    let mut table =
        Table::new(format!("table_{}_factors", ground.table), title, &columns).digits(Digits::Fixed(1));
    let [lqr, flqr] = runs.map(|run| summaries(&run.statistics));
    for (quantity, (name, _)) in QUANTITIES.into_iter().enumerate() {
        let both = |lqr: &Summary, flqr: &Summary| [lqr.std / flqr.std, width(lqr) / width(flqr)].map(Some);
        let [paper_lqr, paper_flqr] = &ground.paper[quantity];
        table.push(name, both(paper_lqr, paper_flqr), both(&lqr[quantity], &flqr[quantity]));
    }
    table
}

fn seed_table(ground: &Ground, runs: &Runs) -> Table {
    let count = runs[0].len();
    let title = format!("Table {} over {count} noise seeds", ground.table);
    let columns = [("least", ""), ("median", ""), ("greatest", "")];
    let mut table = Table::new(format!("table_{}_seeds", ground.table), title, &columns);
    for (quantity, (name, unit)) in QUANTITIES.into_iter().enumerate() {
        for (runs, label) in runs.iter().zip(CONTROLLERS) {
            let deviations = runs.iter().map(|run| summaries(&run.statistics)[quantity].std).collect();
            table.push(format!("{name}, std with {label}, {unit}"), [], three(deviations));
        }
        let ratios = factors_over_seeds(runs).iter().map(|factors| factors[quantity]).collect();
        table.push(format!("{name}, std LQR / FLQR"), [], three(ratios));
    }
    table
}

/// Least, median and greatest.
pub(super) fn three(mut values: Vec<f64>) -> [Option<f64>; 3] {
    values.sort_by(f64::total_cmp);
    let count = values.len();
    let middle = values.get(count / 2).zip(values.get(count.saturating_sub(1) / 2));
    [values.first().copied(), middle.map(|(a, b)| 0.5 * (a + b)), values.last().copied()]
}

fn lqr_finding(ground: &Ground, runs: &Runs, ours: &[Summary; 3], pages: &mut Pages) {
    let ratios = QUANTITIES.into_iter().enumerate().flat_map(|(quantity, (name, _))| {
        let theirs = &ground.paper[quantity][0];
        [
            (format!("range of {name}"), width(&ours[quantity]) / width(theirs)),
            (format!("std of {name}"), ours[quantity].std / theirs.std),
        ]
    });
    let ratios: Vec<_> = ratios.collect();
    let inside = |ratio: f64| (1.0 / LQR_TOLERANCE..=LQR_TOLERANCE).contains(&ratio);
    let told: Vec<_> = ratios.iter().map(|(name, ratio)| format!("{name} {}", sig(*ratio))).collect();
    let outside: Vec<_> =
        ratios.iter().filter(|(_, ratio)| !inside(*ratio)).map(|(name, _)| name.clone()).collect();
    let rest = if outside.is_empty() { String::new() } else { format!(" Outside: {}.", listed(&outside)) };
    pages.finding(
        ground.findings[0],
        format!(
            "LQR's range and standard deviation on {} are within a factor of {LQR_TOLERANCE} of the paper's",
            ground.on
        ),
        outside.is_empty() && stood(runs, 0),
        format!("Simulation / paper: {}.{rest}", listed(&told)),
    );
}

fn factor_finding(ground: &Ground, runs: &Runs, pages: &mut Pages) {
    let theirs = paper_factors(&ground.paper);
    let seeds = factors_over_seeds(runs);
    let ours = seeds[0];
    let told: Vec<_> = QUANTITIES
        .into_iter()
        .enumerate()
        .map(|(quantity, (name, _))| {
            let reaches = |(seed, factors): &(usize, &[f64; 3])| {
                stood(runs, *seed) && factors[quantity] >= theirs[quantity]
            };
            let reached = seeds.iter().enumerate().filter(reaches).count();
            let over_seeds = if seeds.len() > 1 {
                format!(" (reached with {reached} of {} seeds)", seeds.len())
            } else {
                String::new()
            };
            format!("{name} {} ({}){over_seeds}", sig(ours[quantity]), sig(theirs[quantity]))
        })
        .collect();
    pages.finding(
        ground.findings[1],
        format!("FLQR reduces the standard deviations on {} by at least the paper's factors", ground.on),
        (0..3).all(|quantity| ours[quantity] >= theirs[quantity]) && stood(runs, 0),
        format!("Simulation (paper): {}.", listed(&told)),
    );
}

/// |pitch| over |x| of the linear robot that oscillates with a frequency, rad/m: the sum of both of Eq. 7 has no
/// torque left, (c₁ + c₅) ẍ + (c₂ + c₃) θ̈ = c₄ θ.
fn pitch_over_x(robot: &RobotModel, frequency_rad_s: f64) -> f64 {
    let c = robot.parameters.coefficients();
    let squared = frequency_rad_s * frequency_rad_s;
    (c.c1 + c.c5) * squared / (c.c4 + (c.c2 + c.c3) * squared)
}

/// Pitch implied by the spread of x and ẋ as one oscillation.
fn pitch_asked(robot: &RobotModel, summaries: &[Summary; 3]) -> f64 {
    pitch_over_x(robot, summaries[1].std / summaries[0].std) * summaries[0].std
}

fn oscillation(ground: &Ground, robot: &RobotModel, ours: &[Summary; 3]) -> String {
    let paper = ground.paper.map(|[lqr, _]| lqr);
    format!(
        "Consistency of the three quantities: an oscillation with the paper's standard deviations of x and ẋ with \
         LQR has {} rad/s and needs a pitch of {} rad (standard deviation, linear model of this robot); its table has {}. The simulation has {} rad/s and needs {} rad; measured: {}.",
        sig(paper[1].std / paper[0].std),
        sig(pitch_asked(robot, &paper)),
        sig(paper[2].std),
        sig(ours[1].std / ours[0].std),
        sig(pitch_asked(robot, ours)),
        sig(ours[2].std),
    )
}

/// Resolution of two decimals.
fn rounding(ground: &Ground) -> String {
    let [lqr, flqr] = &ground.paper[2];
    let step = 0.01;
    format!(
        "The paper prints the range of the pitch in steps of {} rad. FLQR's, {}, is {} of these steps, and its standard \
         deviation, {}, is half a step or {}: its factor of {} in pitch has that uncertainty.",
        sig(step),
        sig(width(flqr)),
        sig(libm::round(width(flqr) / step)),
        sig(flqr.std),
        if flqr.std <= 0.5 * step { "less" } else { "more" },
        sig(lqr.std / flqr.std),
    )
}

fn pitch_unit(robot: &RobotModel) -> String {
    let told = [FLAT, BRIDGE].map(|ground| {
        let lqr = ground.paper.map(|[lqr, _]| lqr);
        let asked = pitch_asked(robot, &lqr);
        let printed = lqr[2].std;
        let off = [asked / printed, asked.to_degrees() / printed].map(|ratio| ratio.max(1.0 / ratio));
        let text = format!(
            "on {} the standard deviations of x and ẋ, {} m and {} m/s, are an oscillation of {} rad/s, which needs {} rad \
             or {}°; printed is {}, off by a factor of {} if rad and {} if °",
            ground.on,
            sig(lqr[0].std),
            sig(lqr[1].std),
            sig(lqr[1].std / lqr[0].std),
            sig(asked),
            sig(asked.to_degrees()),
            sig(printed),
            sig(off[0]),
            sig(off[1]),
        );
        (text, off[0] < off[1])
    });
    let verdict = if told.iter().all(|(_, is_rad)| *is_rad) {
        "The numbers are in radians"
    } else {
        "This is inconclusive for this robot; they are taken as radians"
    };
    let [(flat, _), (bridge, _)] = told;
    format!("Tables 5 to 7 give the pitch in degrees. With LQR, {flat}; {bridge}. {verdict}.")
}

/// A value within [a, b] with mean m has a variance of at most (b − m)(m − a).
fn largest_variance(summary: &Summary) -> f64 {
    let half = 0.5 * width(summary);
    let about_mean = (summary.max - summary.mean) * (summary.mean - summary.min);
    about_mean.clamp(0.0, half * half)
}

fn spread_name() -> String {
    let rows = || FLAT.paper.into_iter().chain(BRIDGE.paper).flatten();
    let count = rows().count();
    let as_variance = rows().filter(|row| row.std > largest_variance(row)).count();
    let as_deviation = rows().filter(|row| row.std > largest_variance(row).sqrt()).count();
    let example = &FLAT.paper[0][0];
    format!(
        "The last columns of Tables 5 and 6 are labelled variance. A quantity that stays within its printed range about its \
         printed mean cannot have a variance as large as the printed number in {as_variance} of {count} rows (x on flat \
         ground under LQR: {} m² printed, {} m² possible), nor a standard deviation in {as_deviation}: they are taken \
         as standard deviations.",
        sig(example.std),
        sig(largest_variance(example)),
    )
}

fn chart(ground: &Ground, runs: [&Balanced; 2]) -> Chart {
    let from_s = runs[0].statistics.from_s;
    let shown = [(from_s - ground.shown_before_s).max(0.0), runs[0].seconds];
    let band = Band { name: "in the statistics".to_owned(), x: Some([from_s, runs[0].seconds]), y: None };
    Chart {
        title: format!("Figure {}: {}", ground.figure, ground.on),
        description: format!(
            "Measured x, ẋ and pitch. The range of x in the statistics is {} m with LQR and {} m with FLQR.",
            sig(width(&runs[0].statistics.x_m)),
            sig(width(&runs[1].statistics.x_m)),
        ),
        x: Axis { range: Some(shown), ..Axis::new("Time", "s") },
        panels: panels(runs, shown, &[band]),
    }
}

/// x, ẋ and pitch over time, LQR against FLQR.
pub(super) fn panels(runs: [&Balanced; 2], shown_s: paper::Range, bands: &[Band]) -> Vec<Panel> {
    let [from, to] = shown_s;
    QUANTITIES
        .into_iter()
        .enumerate()
        .map(|(quantity, (name, unit))| {
            let series = runs.iter().zip(CONTROLLERS).map(|(run, label)| {
                let inside = |point: &&[f64; 2]| point[0] >= from && point[0] <= to;
                Series::new(label, Mark::Line, run.curves[quantity].iter().filter(inside).copied())
            });
            Panel { bands: bands.to_vec(), ..Panel::new(Axis::new(name, unit), series.collect()) }
        })
        .collect()
}

/// Claim of the abstract, compared with the paper's tables and the simulation.
pub(super) fn abstracts_claim(flat: &Runs, bridge: &Runs, pages: &mut Pages) {
    pages.section("The abstract's claim");
    pages.paragraph(format!(
        "The paper concludes that the variances of x, ẋ and pitch fall by at least one order of magnitude, a factor of {}.",
        sig(paper::CLAIMED_FACTOR)
    ));
    let title = "Ratio LQR / FLQR of standard deviations and of variances (their squares)";
    let mut table =
        Table::new("abstract_claim", title, &[("std", ""), ("variance", "")]).digits(Digits::Fixed(1));
    let mut all = [Vec::new(), Vec::new()];
    for (ground, runs) in [(FLAT, flat), (BRIDGE, bridge)] {
        let theirs = paper_factors(&ground.paper);
        let ours = factors_over_seeds(runs)[0];
        for (quantity, (name, _)) in QUANTITIES.into_iter().enumerate() {
            let both = |factor: f64| [Some(factor), Some(factor * factor)];
            table.push(format!("{name}, {}", ground.on), both(theirs[quantity]), both(ours[quantity]));
            all[0].push(theirs[quantity]);
            all[1].push(ours[quantity]);
        }
    }
    pages.table(table);
    let count = all[0].len();
    let reach = |factors: &[f64], power: i32| {
        factors.iter().filter(|factor| factor.powi(power) >= paper::CLAIMED_FACTOR).count()
    };
    let [theirs, ours] = [0, 1].map(|side: usize| [1, 2].map(|power| reach(&all[side], power)));
    let told = |side: &str, [deviations, variances]: [usize; 2]| {
        format!(
            "{side}: {deviations} of {count} standard deviations and {variances} of {count} variances fall by that much"
        )
    };
    let factors: Vec<_> = all[0].iter().map(|factor| sig(*factor)).collect();
    pages.contradiction(
        10,
        format!(
            "The text claims a reduction by at least {} for all; the paper's columns fall by {}. {}.",
            sig(paper::CLAIMED_FACTOR),
            listed(&factors),
            told("As printed", theirs),
        ),
    );
    pages.finding(
        "abstract_claim_paper",
        "In the paper's tables, all variances fall by at least one order of magnitude",
        theirs[1] == count,
        format!("{}.", told("The paper's", theirs)),
    );
    pages.finding(
        "abstract_claim_ours",
        "In the simulation, all variances fall by at least one order of magnitude",
        ours[1] == count && stood(flat, 0) && stood(bridge, 0),
        format!("{}.", told("Ours", ours)),
    );
}
