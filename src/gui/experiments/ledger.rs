//! Both runs as rows of the ledger, and what exports say of that.

use std::sync::Arc;

use super::run::{Recorded, Variant};
use super::runs::Comparison;
use crate::runs::{Channel, Run, RunKind, RunsTab, Series, Sources, Value};
use crate::widgets::shown;

impl Comparison {
    /// Gives the runs their rows, once.
    pub(super) fn note_in(&self, ledger: &mut RunsTab) {
        self.rows.get_or_init(|| {
            let row = |(variant, run)| {
                let row = self.row(variant, run);
                (variant, Run { number: ledger.note(row.clone()), series: None, ..row })
            };
            self.recorded().map(row).collect()
        });
    }

    fn row(&self, variant: Variant, run: &Recorded) -> Run {
        let settings = &self.settings;
        let title = format!("{}, {}", settings.scenario.name(), variant.title(settings.scenario));
        let mut row =
            Run::new(RunKind::Experiment, title, Some(&self.model), Sources::new(Some(&self.model), []))
                .with("setting.scenario", Value::Text(settings.scenario.name().to_owned()))
                .with("setting.controller", Value::Text(variant.name(settings.scenario).to_owned()))
                .with("setting.seconds", Value::Number(settings.seconds))
                .with("setting.seed", Value::Number(settings.seed as f64));
        if let Some(gains) = settings.speed_gains {
            row = row.with("setting.kp", Value::Number(gains.kp)).with("setting.ki", Value::Number(gains.ki));
        }
        let series = Series { time_s: run.time_s.clone(), channels: self.channels(run) };
        Run {
            seed: Some(settings.seed),
            command: Some(self.command_line(variant)),
            result: self.result(run),
            series: Some(Arc::new(series)),
            ..row
        }
    }

    fn channels(&self, run: &Recorded) -> Vec<Channel> {
        let channel = |(signal, values): (super::signals::Signal, &Vec<f64>)| Channel {
            name: signal.quantity.name,
            unit: signal.quantity.unit,
            values: values.clone(),
        };
        self.signals(false).into_iter().zip(&run.columns).map(channel).collect()
    }

    /// Spread of each signal where the statistics count, and how it ended.
    fn result(&self, run: &Recorded) -> String {
        if let Some(failure) = run.failure() {
            return failure.trim_end_matches('.').to_owned();
        }
        let found = run.statistics_between([run.statistics_from_s(), run.end_s()]).unwrap_or_default();
        // Of the text, which files keep: one unit whatever the window shows.
        let signals = self.signals(self.settings.scenario.on_ground());
        let spread = signals.iter().zip(found).map(|(signal, summary)| {
            let quantity = &signal.quantity;
            format!("{} std {} {}", quantity.name, shown(quantity.scale * summary.std, 3), quantity.unit)
        });
        let settled = match run.settled() {
            Some(true) => Some("settled".to_owned()),
            Some(false) => Some("not settled".to_owned()),
            None => None,
        };
        spread.chain(settled).collect::<Vec<_>>().join(", ")
    }

    /// Description of a run in exports, once it has its row.
    pub(super) fn provenance(&self, variant: Variant) -> Option<String> {
        let rows = self.rows.get()?;
        rows.iter().find(|(of, _)| *of == variant).map(|(_, run)| run.provenance())
    }

    /// Description of both in exports.
    pub(super) fn provenances(&self) -> Vec<String> {
        Variant::ALL.into_iter().filter_map(|variant| self.provenance(variant)).collect()
    }

    /// Numbers of both, for the page and its picture.
    pub(super) fn numbers_text(&self) -> String {
        let numbers: Vec<String> =
            self.rows.get().into_iter().flatten().map(|(_, run)| run.number.to_string()).collect();
        if numbers.is_empty() { String::new() } else { format!("runs {}", numbers.join(", ")) }
    }
}
