//! A document as one HTML file, which is well-formed XML too.

use super::chart::Chart;
use super::markup::{Attribute, Markup};
use super::svg;
use super::table::{Cell, Column, Table};
use super::{Block, Document, Tone};

const STYLE: &str = include_str!("page.css");
/// Nothing from outside and no script, whatever a document says.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'";
/// A digit and a point that take their place without being seen.
const NO_DIGIT: char = '\u{2007}';
const NO_POINT: char = '\u{2008}';

/// Returns whether a file that begins with these bytes was written by [`document`].
pub(super) fn is_opening(bytes: &[u8]) -> bool {
    let empty = document(&Document::default());
    let opening = empty.split("<title").next().unwrap_or_default();
    bytes.starts_with(opening.as_bytes())
}

pub(super) fn document(document: &Document) -> String {
    let mut markup = Markup::default();
    markup.raw("<!DOCTYPE html>\n");
    markup.element("html", &[("lang", &"en"), ("xmlns", &"http://www.w3.org/1999/xhtml")], |markup| {
        markup.element("head", &[], |markup| head(&document.title, markup));
        markup.line();
        markup.element("body", &[], |markup| markup.element("main", &[], |markup| body(document, markup)));
    });
    markup.line();
    markup.into_string()
}

fn head(title: &str, markup: &mut Markup) {
    markup.leaf("meta", &[("charset", &"utf-8")]);
    markup.leaf("meta", &[("http-equiv", &"Content-Security-Policy"), ("content", &POLICY)]);
    markup.leaf("meta", &[("name", &"viewport"), ("content", &"width=device-width, initial-scale=1")]);
    markup.text_element("title", &[], title);
    // Not escaped: HTML reads a style as it stands. The two files have none of XML's characters.
    markup.element("style", &[], |markup| {
        markup.line();
        markup.raw(STYLE);
        markup.raw(svg::STYLE);
    });
}

fn body(document: &Document, markup: &mut Markup) {
    markup.text_element("h1", &[], &document.title);
    markup.line();
    if !document.summary.is_empty() {
        markup.text_element("p", &[], &document.summary);
        markup.line();
    }
    contents(document, markup);
    let mut counters = Counters::default();
    for block in &document.blocks {
        self::block(block, &mut counters, markup);
        markup.line();
    }
}

/// Numbers for ids.
#[derive(Default)]
struct Counters {
    sections: usize,
    charts: usize,
    tables: usize,
}

fn sections(document: &Document) -> impl Iterator<Item = &str> {
    document.blocks.iter().filter_map(|block| match block {
        Block::Heading { level: 1, text } => Some(text.as_str()),
        _ => None,
    })
}

/// Links to the sections, where there are several.
fn contents(document: &Document, markup: &mut Markup) {
    if sections(document).count() < 3 {
        return;
    }
    markup.element("nav", &[("aria-label", &"Contents")], |markup| {
        markup.element("ol", &[], |markup| {
            for (number, title) in sections(document).enumerate() {
                let target = format!("#section-{}", number + 1);
                markup.element("li", &[], |markup| markup.text_element("a", &[("href", &target)], title));
            }
        });
    });
    markup.line();
}

fn block(block: &Block, counters: &mut Counters, markup: &mut Markup) {
    match block {
        Block::Heading { level: 1, text } => {
            counters.sections += 1;
            let id = format!("section-{}", counters.sections);
            markup.text_element("h2", &[("id", &id)], text);
        }
        Block::Heading { text, .. } => markup.text_element("h3", &[], text),
        Block::Paragraph(text) => markup.text_element("p", &[], text),
        Block::Notice { tone, label, text } => notice(*tone, label, text, markup),
        Block::List { numbered, items } => {
            markup.element(if *numbered { "ol" } else { "ul" }, &[], |markup| {
                items.iter().for_each(|item| markup.text_element("li", &[], item));
            });
        }
        Block::Table(table) => {
            counters.tables += 1;
            self::table(table, counters.tables, markup);
        }
        Block::Figure(chart) => {
            counters.charts += 1;
            figure(chart, counters.charts, markup);
        }
    }
}

fn notice(tone: Tone, label: &str, text: &str, markup: &mut Markup) {
    let class = match tone {
        Tone::Note => "notice",
        Tone::Good => "notice good",
        Tone::Warning => "notice warning",
    };
    markup.element("p", &[("class", &class)], |markup| {
        markup.text_element("strong", &[], &format!("{label}:"));
        markup.text(" ");
        markup.text(text);
    });
}

/// Both widths; the style shows one of them.
fn figure(chart: &Chart, number: usize, markup: &mut Markup) {
    markup.element("figure", &[], |markup| {
        markup.element("figcaption", &[], |markup| {
            markup.text(&chart.title);
            markup.text_element("span", &[], &chart.description);
        });
        for (name, width) in [("wide", svg::WIDE), ("narrow", svg::NARROW)] {
            svg::draw(chart, width, name, &format!("chart-{number}-{name}"), markup);
        }
    });
}

fn table(table: &Table, number: usize, markup: &mut Markup) {
    // Not a caption element, which would be no wider than the table.
    let id = format!("table-{number}");
    markup.text_element("p", &[("class", &"caption"), ("id", &id)], &table.caption);
    // A table wider than the page scrolls by itself, with keys too.
    let region: [Attribute<'_>; 4] =
        [("class", &"scroll"), ("tabindex", &0), ("role", &"region"), ("aria-labelledby", &id)];
    markup.element("div", &region, |markup| {
        markup.element("table", &[("aria-labelledby", &id)], |markup| {
            markup.element("thead", &[], |markup| table_head(table, markup));
            markup.element("tbody", &[], |markup| {
                for row in &table.rows {
                    markup.line();
                    markup.element("tr", &[], |markup| table_row(table, row, markup));
                }
            });
        });
    });
    if !table.note.is_empty() {
        markup.text_element("p", &[("class", &"remark")], &table.note);
    }
}

fn table_head(table: &Table, markup: &mut Markup) {
    let groups = table.groups();
    if !groups.is_empty() {
        markup.element("tr", &[], |markup| {
            for (number, (name, count)) in groups.iter().enumerate() {
                let class = if number > 0 { "group g" } else { "group" };
                markup.text_element(
                    "th",
                    &[("class", &class), ("colspan", count), ("scope", &"colgroup")],
                    name,
                );
            }
        });
    }
    markup.element("tr", &[], |markup| {
        for (number, column) in table.columns.iter().enumerate() {
            let class = class(table, number);
            markup
                .element("th", &[("class", &class), ("scope", &"col")], |markup| column_head(column, markup));
        }
    });
}

fn column_head(column: &Column, markup: &mut Markup) {
    markup.text(&column.title);
    if !column.unit.is_empty() {
        markup.text(" ");
        markup.text_element("span", &[], column.unit);
    }
}

fn table_row(table: &Table, row: &[Cell], markup: &mut Markup) {
    for (number, cell) in row.iter().enumerate() {
        let class = class(table, number);
        let text = shown(table, number, cell);
        match number {
            0 => markup.text_element("th", &[("class", &class), ("scope", &"row")], &text),
            _ => markup.text_element("td", &[("class", &class)], &text),
        }
    }
}

/// Numbers to the right; a line where a group begins.
fn class(table: &Table, column: usize) -> &'static str {
    let group = |number: usize| table.columns.get(number).map(|column| &column.group);
    let begins = column > 0 && group(column) != group(column - 1);
    match (table.is_numeric(column), begins) {
        (true, true) => "n g",
        (true, false) => "n",
        (false, true) => "g",
        (false, false) => "t",
    }
}

fn shown(table: &Table, column: usize, cell: &Cell) -> String {
    let mut text = cell.shown().to_owned();
    if matches!(cell, Cell::Number(_)) && table.is_numeric(column) {
        let (point, digits) = table.padding(column, &text);
        text.extend(point.then_some(NO_POINT));
        text.extend(std::iter::repeat_n(NO_DIGIT, digits));
    }
    text
}
