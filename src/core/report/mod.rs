//! One report format: a [`Document`] of plain blocks, written as one self-contained HTML file or as text.
//!
//! The HTML needs no script and nothing from outside: style and pictures (SVG) are in it, and its content policy
//! forbids anything else. It follows the reader's choice of light or dark, prints in black on white, and carries
//! each chart in two widths, of which the style shows the one that fits. Each chart has a title and a description
//! for readers who cannot see it. What a document says is escaped; the same document gives the same bytes.

mod chart;
mod html;
mod inline_style;
mod map;
mod markup;
pub mod number;
mod path;
mod phrases;
mod svg;
mod table;
#[cfg(test)]
mod tests;
mod text;
mod thin;
mod ticks;

pub use chart::{Axis, Band, Chart, Limit, Mark, Panel, Scale, Series};
pub use phrases::capitalised;
pub use table::{Cell, Column, Table};

/// A report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// Title of the whole.
    pub title: String,
    /// One paragraph below the title; may be empty.
    pub summary: String,
    /// From top to bottom.
    pub blocks: Vec<Block>,
}

/// One piece of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A heading of a section (level 1) or of a part of one (level 2).
    Heading {
        /// 1 or 2; the title of the document stands above both.
        level: u8,
        /// Its words.
        text: String,
    },
    /// A paragraph.
    Paragraph(String),
    /// A paragraph that stands out.
    Notice {
        /// Tone.
        tone: Tone,
        /// First words, in bold: the meaning must not hang on the tone's colour alone.
        label: String,
        /// Its words.
        text: String,
    },
    /// A list, numbered or not.
    List {
        /// True if the items have numbers.
        numbered: bool,
        /// One paragraph each.
        items: Vec<String>,
    },
    /// A table.
    Table(Table),
    /// A chart with its caption.
    Figure(Chart),
}

/// Tone of a notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Good to know.
    Note,
    /// Something holds, or is as it should be.
    Good,
    /// Something does not hold, or is not to be relied on.
    Warning,
}

impl Block {
    /// A heading of a section.
    pub fn section(text: impl Into<String>) -> Self {
        Self::Heading { level: 1, text: text.into() }
    }

    /// A heading of a part of a section.
    pub fn part(text: impl Into<String>) -> Self {
        Self::Heading { level: 2, text: text.into() }
    }

    /// A paragraph.
    pub fn paragraph(text: impl Into<String>) -> Self {
        Self::Paragraph(text.into())
    }

    /// A paragraph that stands out.
    pub fn notice(tone: Tone, label: impl Into<String>, text: impl Into<String>) -> Self {
        Self::Notice { tone, label: label.into(), text: text.into() }
    }
}

impl Document {
    /// The report as one HTML file.
    pub fn to_html(&self) -> String {
        html::document(self)
    }

    /// Returns whether a file that begins with these bytes was written by [`Document::to_html`].
    pub fn is_opening_of_html(bytes: &[u8]) -> bool {
        html::is_opening(bytes)
    }

    /// The report as text of at most 100 columns, tables apart.
    pub fn to_text(&self) -> String {
        text::document(self)
    }
}

impl Chart {
    /// The chart as a separate picture on white, for any program that draws SVG.
    pub fn to_svg(&self) -> String {
        svg::picture(self, [svg::WIDE, f64::NAN])
    }

    /// Creates it with a given width and height, px: the height is that of the panels with their legend and axes, which
    /// take what they need of it.
    pub fn to_svg_of(&self, size: [f64; 2]) -> String {
        svg::picture(self, size)
    }
}
