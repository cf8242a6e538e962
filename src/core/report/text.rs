//! A document as plain text.

use super::chart::{Chart, Series};
use super::number::significant;
use super::table::{Cell, Table};
use super::{Block, Document};

const COLUMNS: usize = 100;
/// Widest text in a table.
const CELL: usize = 44;

pub(super) fn document(document: &Document) -> String {
    let mut out = underlined(&document.title, '=');
    if !document.summary.is_empty() {
        out += &format!("\n{}", paragraph(&document.summary));
    }
    for block in &document.blocks {
        out.push('\n');
        out += &self::block(block);
    }
    out
}

/// Lines of at most `columns` characters, broken between words; a longer word stands alone.
pub(super) fn wrap(text: &str, columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut used = 0;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        match lines.last_mut() {
            Some(line) if used + 1 + length <= columns => {
                line.push(' ');
                line.push_str(word);
                used += 1 + length;
            }
            _ => {
                lines.push(word.to_owned());
                used = length;
            }
        }
    }
    lines
}

fn block(block: &Block) -> String {
    match block {
        Block::Heading { level: 1, text } => format!("\n{}", underlined(text, '-')),
        Block::Heading { text, .. } => format!("{}\n", one_line(text)),
        Block::Paragraph(text) => paragraph(text),
        Block::Notice { label, text, .. } => paragraph(&format!("{label}: {text}")),
        Block::List { numbered, items } => list(*numbered, items),
        Block::Table(table) => self::table(table),
        Block::Figure(chart) => figure(chart),
    }
}

fn underlined(text: &str, line: char) -> String {
    let words = one_line(text);
    format!("{words}\n{}\n", line.to_string().repeat(words.chars().count()))
}

/// Without line breaks and without characters that would steer a terminal.
fn one_line(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn paragraph(text: &str) -> String {
    hanging("", text)
}

/// A paragraph whose first line begins with `mark` and whose others stand below the first word.
fn hanging(mark: &str, text: &str) -> String {
    let indent = mark.chars().count();
    let lines = wrap(&one_line(text), COLUMNS - indent);
    let line = |(number, line): (usize, &String)| {
        if number == 0 { format!("{mark}{line}\n") } else { format!("{:indent$}{line}\n", "") }
    };
    lines.iter().enumerate().map(line).collect()
}

fn list(numbered: bool, items: &[String]) -> String {
    let width = items.len().to_string().len();
    let mark = |number: usize| if numbered { format!("{number:>width$}. ") } else { "- ".to_owned() };
    items.iter().enumerate().map(|(number, item)| hanging(&mark(number + 1), item)).collect()
}

fn table(table: &Table) -> String {
    let text = |column: usize, cell: &Cell| {
        let shown = one_line(cell.shown());
        let (point, digits) = match cell {
            Cell::Number(_) if table.is_numeric(column) => table.padding(column, &shown),
            _ => (false, 0),
        };
        format!("{shown}{:1$}", "", digits + usize::from(point))
    };
    let heads: Vec<String> = table.columns.iter().map(|column| one_line(&column.label())).collect();
    let cells = |row: &Vec<Cell>| row.iter().enumerate().map(|(number, cell)| text(number, cell)).collect();
    let rows: Vec<Vec<String>> = table.rows.iter().map(cells).flat_map(in_lines).collect();
    let mut widths: Vec<usize> = heads.iter().map(|head| head.chars().count()).collect();
    for row in &rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let mut out = paragraph(&table.caption);
    out += &group_line(table, &mut widths);
    let line = |cells: &[String]| {
        let mut line = String::new();
        for (number, (cell, &width)) in cells.iter().zip(&widths).enumerate() {
            let gap = if number > 0 { "  " } else { "" };
            let aligned =
                if table.is_numeric(number) { format!("{cell:>width$}") } else { format!("{cell:<width$}") };
            line += &format!("{gap}{aligned}");
        }
        format!("{}\n", line.trim_end())
    };
    out += &line(&heads);
    let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
    out += &format!("{}\n", rule.join("  "));
    out.extend(rows.iter().map(|row| line(row)));
    if !table.note.is_empty() {
        out += &paragraph(&table.note);
    }
    out
}

/// A row as the lines that it takes where long texts are broken.
fn in_lines(cells: Vec<String>) -> Vec<Vec<String>> {
    let broken =
        |cell: &String| if cell.chars().count() > CELL { wrap(cell, CELL) } else { vec![cell.clone()] };
    let broken: Vec<Vec<String>> = cells.iter().map(broken).collect();
    let count = broken.iter().map(Vec::len).max().unwrap_or(0);
    (0..count)
        .map(|line| broken.iter().map(|cell| cell.get(line).cloned().unwrap_or_default()).collect())
        .collect()
}

/// The names of groups over their columns, which become as wide as that takes.
fn group_line(table: &Table, widths: &mut [usize]) -> String {
    let mut line = String::new();
    let mut first = 0;
    for (name, count) in table.groups() {
        let columns = &mut widths[first..first + count];
        let name = one_line(name);
        let taken = columns.iter().sum::<usize>() + 2 * (count - 1);
        let lacking = name.chars().count().saturating_sub(taken);
        columns[count - 1] += lacking;
        line += &format!("{name:<0$}  ", taken + lacking);
        first += count;
    }
    if line.trim().is_empty() { String::new() } else { format!("{}\n", line.trim_end()) }
}

/// A chart's words, and the range of each of its series.
fn figure(chart: &Chart) -> String {
    let mut out = paragraph(&format!("{}: {}", chart.title, chart.description));
    for panel in &chart.panels {
        out += &hanging("  ", &panel.y.label());
        for series in &panel.series {
            out += &hanging("    ", &format!("{}: {}", series.name, range(series)));
        }
    }
    out
}

fn range(series: &Series) -> String {
    match series.range() {
        Some([low, high]) => format!("{} … {}", significant(low, 3), significant(high, 3)),
        None => "no data".to_owned(),
    }
}
