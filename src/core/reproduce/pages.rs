//! Output of the sections: the report, and with it the tables and findings for scripts.

use serde::Serialize;

use super::table::Table;
use crate::report::{Block, Chart, Tone};

/// Something that was to be shown, or that the paper claims.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Key for scripts.
    pub id: &'static str,
    /// Claim.
    pub claim: String,
    /// True if it holds.
    pub holds: bool,
    /// The figures that decide it.
    pub figures: String,
}

/// A place where the paper contradicts itself or is silent, with the figures that show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contradiction {
    /// From 1, in the order in which they are known.
    pub number: usize,
    /// Description and solution used here.
    pub text: String,
}

/// Places where the paper needs a decision, all of which a report states.
pub(super) const POINTS: usize = 11;

/// A report in the making.
#[derive(Default)]
pub(super) struct Pages {
    pub(super) blocks: Vec<Block>,
    pub(super) tables: Vec<Table>,
    pub(super) findings: Vec<Finding>,
    pub(super) contradictions: Vec<Contradiction>,
}

impl Pages {
    pub(super) fn section(&mut self, title: impl Into<String>) {
        self.blocks.push(Block::section(title));
    }

    pub(super) fn paragraph(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::paragraph(text));
    }

    pub(super) fn note(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::notice(Tone::Note, "Note", text));
    }

    pub(super) fn warning(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::notice(Tone::Warning, "Warning", text));
    }

    pub(super) fn table(&mut self, table: Table) {
        self.blocks.push(Block::Table(table.to_report()));
        self.tables.push(table);
    }

    pub(super) fn chart(&mut self, chart: Chart) {
        self.blocks.push(Block::Figure(chart));
    }

    pub(super) fn finding(
        &mut self,
        id: &'static str,
        claim: impl Into<String>,
        holds: bool,
        figures: impl Into<String>,
    ) {
        let finding = Finding { id, claim: claim.into(), holds, figures: figures.into() };
        let (tone, label) = if holds { (Tone::Good, "Holds") } else { (Tone::Warning, "Does not hold") };
        self.blocks.push(Block::notice(tone, label, format!("{}. {}", finding.claim, finding.figures)));
        self.findings.push(finding);
    }

    pub(super) fn contradiction(&mut self, number: usize, text: impl Into<String>) {
        let text = text.into();
        self.blocks.push(Block::notice(
            Tone::Note,
            format!("Interpretation of the paper, {number} of {POINTS}"),
            text.clone(),
        ));
        self.contradictions.push(Contradiction { number, text });
    }
}
