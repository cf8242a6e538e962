//! Stability margins of the sampled loop with delay: each margin with its verdict, and a sentence.

use egui::{CollapsingHeader, Grid, Ui};
use flqr_core::lqr::SampledPole;

use super::verdict::Verdict;
use crate::design::Designed;
use crate::widgets::{error_ui, hint_ui, mono, plain, section_ui, shown, warning_ui};

/// Usual demands: a factor of 2 up and of 0.7 down, 45° of phase, twice the delay that there is; and half of that.
const GAIN_UP: [f64; 2] = [2.0, 1.5];
const GAIN_DOWN: [f64; 2] = [1.0 / 0.7, 1.0 / 0.85];
const PHASE_DEG: [f64; 2] = [45.0, 30.0];
const DELAYS: [f64; 2] = [2.0, 1.0];

/// One margin for people.
struct Row {
    name: &'static str,
    value: String,
    help: &'static str,
    verdict: Verdict,
    /// Behaviour of the robot at the margin.
    then: String,
}

/// The margins of the active design.
pub(super) fn ui(designed: &Designed, poles: &[SampledPole], ui: &mut Ui) {
    let runs = runs(designed);
    section_ui(ui, "Stability", |ui| {
        hint_ui(ui, runs.as_str()).on_hover_text(
            "Sampled loop: all values include the delay from measurement to torque and the sample-and-hold of the IMU",
        );
    });
    if !designed.margins.stable {
        error_ui(
            ui,
            format!(
                "Unstable when sampled ({runs}): reduce the state weights or increase the torque weights."
            ),
        );
        return;
    }
    let rows = rows(designed);
    Grid::new("margins").num_columns(6).min_col_width(14.0).spacing([6.0, 2.0]).show(ui, |ui| {
        for pair in rows.chunks(2) {
            for row in pair {
                row.verdict.mark_ui(ui, row.name);
                ui.label(row.name).on_hover_text(row.help);
                ui.label(mono(&row.value).size(11.5)).on_hover_text(row.help);
            }
            ui.end_row();
        }
    });
    sentence_ui(ui, &rows);
    poles_ui(ui, poles);
}

fn runs(designed: &Designed) -> String {
    let timing = &designed.timing;
    format!(
        "1 kHz, {} ms of delay, IMU at {} Hz",
        plain(1e3 * timing.delay_s, 3),
        plain(1.0 / timing.imu_period_s, 3)
    )
}

fn rows(designed: &Designed) -> Vec<Row> {
    let (margins, timing) = (&designed.margins, &designed.timing);
    let hertz = |rad_s: f64| format!("{} Hz", shown(rad_s / std::f64::consts::TAU, 2));
    let decibels = |factor: f64| format!("{} dB", shown(20.0 * factor.log10(), 2));
    let up = margins.gain_up;
    let phase_deg = margins.phase_rad.to_degrees();
    // Without a separate delay a loop is to bear that of one tick.
    let delays = margins.delay_s / timing.delay_s.max(timing.tick_s);
    vec![
        Row {
            name: "gain up",
            value: if up.is_finite() {
                format!("×{} {}", shown(up, 3), decibels(up))
            } else {
                "any".to_owned()
            },
            help: "Gain increase (torque per command) until instability",
            verdict: Verdict::of(up, GAIN_UP[0], GAIN_UP[1]),
            then: format!(
                "unstable with {} times the torque, at {}",
                shown(up, 3),
                hertz(margins.gain_up_rad_s)
            ),
        },
        Row {
            name: "gain down",
            value: if margins.gain_down > 0.0 {
                format!("×{} {}", shown(margins.gain_down, 3), decibels(margins.gain_down))
            } else {
                "any".to_owned()
            },
            help: "Gain reduction (torque per command) until instability",
            verdict: Verdict::of(1.0 / margins.gain_down, GAIN_DOWN[0], GAIN_DOWN[1]),
            then: format!("unstable with {} of the torque", shown(margins.gain_down, 3)),
        },
        Row {
            name: "phase",
            value: format!("{}° at {}", shown(phase_deg, 3), hertz(margins.crossover_rad_s)),
            help: "Phase margin and gain crossover frequency",
            verdict: Verdict::of(phase_deg, PHASE_DEG[0], PHASE_DEG[1]),
            then: format!(
                "unstable with {}° of additional phase lag, at {}",
                shown(phase_deg, 3),
                hertz(margins.crossover_rad_s)
            ),
        },
        Row {
            name: "delay",
            value: format!("+{} ms", shown(1e3 * margins.delay_s, 3)),
            help: "Additional delay until instability; tight below twice the delay of the loop, bad below the delay of the loop",
            verdict: Verdict::of(delays, DELAYS[0], DELAYS[1]),
            then: format!("unstable with {} ms of additional delay", shown(1e3 * margins.delay_s, 3)),
        },
    ]
}

/// Meaning of the worst margin for the robot, and the remedy.
fn sentence_ui(ui: &mut Ui, rows: &[Row]) {
    let Some(worst) = rows.iter().max_by_key(|row| row.verdict) else { return };
    let remedy = "Increase the torque weights to slow the loop down, or reduce the rate weights.";
    match worst.verdict {
        Verdict::Good => {
            hint_ui(ui, "Tolerates errors of motor gain and delay.");
        }
        Verdict::Tight => {
            warning_ui(ui, format!("Tight: {}. {remedy}", worst.then));
        }
        Verdict::Bad => {
            error_ui(ui, format!("Barely stable: {}. {remedy}", worst.then));
        }
    }
}

/// The poles as text, slowest first, conjugate pairs as one.
fn poles_ui(ui: &mut Ui, poles: &[SampledPole]) {
    CollapsingHeader::new("Poles").id_salt("pole list").show(ui, |ui| {
        Grid::new("pole table").num_columns(4).spacing([18.0, 2.0]).show(ui, |ui| {
            for head in ["pole, 1/s", "damping", "Hz", "z, one IMU period"] {
                hint_ui(ui, head);
            }
            ui.end_row();
            for pole in poles.iter().filter(|pole| pole.s.im >= 0.0) {
                ui.label(mono(complex(pole.s.re, pole.s.im)));
                ui.label(mono(shown(pole.damping(), 2)));
                ui.label(mono(shown(pole.s.norm() / std::f64::consts::TAU, 3)));
                ui.label(mono(complex(pole.z.re, pole.z.im)));
                ui.end_row();
            }
        });
    });
}

/// A number, or both of a conjugate pair.
pub(super) fn complex(re: f64, im: f64) -> String {
    if im.abs() < 1e-9 * re.abs().max(1.0) {
        shown(re, 3)
    } else {
        format!("{}±{}i", shown(re, 3), shown(im.abs(), 3))
    }
}

/// Margins and their verdicts, as `--state-out` writes them.
pub(super) fn snapshot(designed: &Designed) -> serde_json::Value {
    let verdicts: serde_json::Map<_, _> =
        rows(designed).into_iter().map(|row| (row.name.to_owned(), row.verdict.word().into())).collect();
    serde_json::json!({
        "stable": designed.margins.stable,
        "delay_s": designed.margins.delay_s,
        "phase_rad": designed.margins.phase_rad,
        "verdicts": verdicts,
    })
}
