//! The text level of a log: lines, comments, cells, header.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

use super::{LogError, recording};

/// A row longer than this is damage, not data.
const ROW_LIMIT_BYTES: usize = 1 << 20;
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Lines of CSV text with their numbers; blank ones are left out.
pub(super) struct Lines<'a, R> {
    reader: R,
    file: Cow<'a, str>,
    buffer: Vec<u8>,
    line: u64,
    bytes: u64,
    /// True if every row of the file was written with its line end, so that one without was cut.
    grows: bool,
}

/// A comment or a row.
pub(super) enum Line<'a> {
    /// A comment from its `#` to its line end.
    Comment(&'a [u8]),
    /// A row, or the header.
    Row(Row<'a>),
}

/// One row: its text without the line end, and the line at which it starts.
pub(super) struct Row<'a> {
    pub(super) text: &'a [u8],
    pub(super) line: u64,
    /// True if the end of the row is missing, as far as that can be known.
    pub(super) torn: bool,
}

impl<'a, R: BufRead> Lines<'a, R> {
    pub(super) fn new(reader: R, file: impl Into<Cow<'a, str>>) -> Self {
        Self { reader, file: file.into(), buffer: Vec::new(), line: 0, bytes: 0, grows: false }
    }

    /// Line that was read last, from 1.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// Bytes that were read.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The next row; a row with a line break inside quotes covers several lines. Comments are left out.
    pub(super) fn next_row(&mut self) -> Result<Option<Row<'_>>, LogError> {
        while let Some(line) = self.fill()? {
            if !self.holds_comment() {
                return Ok(Some(self.row(line)));
            }
        }
        Ok(None)
    }

    /// The next comment or row.
    pub(super) fn next_line(&mut self) -> Result<Option<Line<'_>>, LogError> {
        let Some(line) = self.fill()? else { return Ok(None) };
        if self.holds_comment() {
            return Ok(Some(Line::Comment(without_line_end(&self.buffer).trim_ascii_start())));
        }
        Ok(Some(Line::Row(self.row(line))))
    }

    fn row(&self, line: u64) -> Row<'_> {
        let torn = self.grows && !self.buffer.ends_with(b"\n");
        Row { text: without_line_end(&self.buffer), line, torn }
    }

    fn holds_comment(&self) -> bool {
        self.buffer.trim_ascii_start().starts_with(b"#")
    }

    /// Puts the next comment or row into the buffer; the line at which it starts.
    fn fill(&mut self) -> Result<Option<u64>, LogError> {
        loop {
            self.buffer.clear();
            if self.append_line(self.line + 1)? == 0 {
                return Ok(None);
            }
            if self.line == 1 {
                self.look_at_first_line();
            }
            if !self.buffer.trim_ascii_start().is_empty() {
                break;
            }
        }
        let line = self.line;
        if !self.holds_comment() {
            while has_open_quote(&self.buffer) && self.append_line(line)? > 0 {}
        }
        Ok(Some(line))
    }

    fn look_at_first_line(&mut self) {
        if self.buffer.starts_with(BYTE_ORDER_MARK) {
            self.buffer.drain(..BYTE_ORDER_MARK.len());
        }
        self.grows = self.buffer.starts_with(recording::FIRST_LINE.as_bytes());
    }

    /// Appends one line to the buffer; the row began at line `start`.
    fn append_line(&mut self, start: u64) -> Result<usize, LogError> {
        let room = (ROW_LIMIT_BYTES + 1).saturating_sub(self.buffer.len());
        let read = self.reader.by_ref().take(room as u64).read_until(b'\n', &mut self.buffer);
        let count = read.map_err(|error| self.io_error(&error))?;
        if self.buffer.len() > ROW_LIMIT_BYTES {
            let file = self.file.to_string();
            return Err(LogError::RowTooLong { file, line: start, limit: ROW_LIMIT_BYTES });
        }
        self.bytes += count as u64;
        self.line += u64::from(count > 0);
        Ok(count)
    }

    fn io_error(&self, error: &io::Error) -> LogError {
        let file = self.file.to_string();
        if error.kind() == io::ErrorKind::IsADirectory {
            return LogError::Folder { file };
        }
        LogError::Io { file, line: self.line, problem: error.to_string() }
    }
}

fn has_open_quote(text: &[u8]) -> bool {
    text.contains(&b'"') && text.iter().filter(|&&byte| byte == b'"').count() % 2 == 1
}

fn without_line_end(text: &[u8]) -> &[u8] {
    let text = text.strip_suffix(b"\n").unwrap_or(text);
    text.strip_suffix(b"\r").unwrap_or(text)
}

/// Splits a row into cells without the blanks around them, and hands each to `cell` with its number.
pub(super) fn for_each_cell(row: &[u8], delimiter: u8, mut cell: impl FnMut(usize, &[u8])) -> usize {
    if !row.contains(&b'"') {
        let cells = row.split(|&byte| byte == delimiter);
        return cells.enumerate().map(|(index, text)| cell(index, text.trim_ascii())).count();
    }
    let mut record = csv::ByteRecord::new();
    let mut reader = csv::ReaderBuilder::new().has_headers(false).delimiter(delimiter).from_reader(row);
    // The text is in memory and one record is as long as it likes, so neither kind of csv error can occur.
    if reader.read_byte_record(&mut record).unwrap_or(false) {
        record.iter().enumerate().for_each(|(index, text)| cell(index, text.trim_ascii()));
    }
    record.len()
}

/// The header of a log.
pub(super) struct Header {
    /// Names of the columns.
    pub(super) names: Vec<String>,
    /// Line of the header, from 1.
    pub(super) line: u64,
    /// Separator of the cells.
    pub(super) delimiter: u8,
}

impl Header {
    /// Reads up to the header and checks that it is one; `comment` is handed the comments above it.
    pub(super) fn read<R: BufRead>(
        lines: &mut Lines<R>,
        mut comment: impl FnMut(&[u8]),
    ) -> Result<Self, LogError> {
        let file = lines.file.to_string();
        loop {
            match lines.next_line()? {
                None => return Err(LogError::Empty { file }),
                Some(Line::Comment(text)) => comment(text),
                Some(Line::Row(row)) => return Self::parse(&row, &file),
            }
        }
    }

    fn parse(row: &Row, file: &str) -> Result<Self, LogError> {
        let line = row.line;
        if let Some(found) = not_text(row.text) {
            return Err(LogError::NotText { file: file.to_owned(), line, found });
        }
        let delimiter = delimiter(row.text);
        let mut names = Vec::new();
        for_each_cell(row.text, delimiter, |_, cell| names.push(String::from_utf8_lossy(cell).into_owned()));
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(LogError::NoHeader { file: file.to_owned(), line });
        }
        Ok(Self { names, line, delimiter })
    }
}

/// A comma, or what stands in its place where there is none.
fn delimiter(header: &[u8]) -> u8 {
    *b",;\t".iter().find(|delimiter| header.contains(delimiter)).unwrap_or(&b',')
}

/// Describes bytes that are not CSV text.
fn not_text(text: &[u8]) -> Option<&'static str> {
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
        Some("it is UTF-16 text")
    } else if text.iter().any(|&byte| byte < b' ' && !b"\t\n\r".contains(&byte)) {
        Some("it has bytes of a binary or compressed format")
    } else if text.contains(&b'\r') {
        Some("its lines end in bare carriage returns")
    } else {
        None
    }
}
