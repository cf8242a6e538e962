//! Pages of the manual as blocks to draw, parsed from Markdown.

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// A link target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Link {
    /// A heading of a page; an empty file is the same page.
    Page { file: String, anchor: Option<String> },
    /// A footnote of the same page.
    Note(String),
    /// A file of the source repository.
    File(String),
    /// An address on the web.
    Web(String),
}

impl Link {
    fn new(target: &str) -> Self {
        let (file, anchor) =
            target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
        if target.contains("://") {
            Self::Web(target.to_owned())
        } else if file.is_empty() || (file.ends_with(".md") && !file.contains('/')) {
            Self::Page { file: file.to_owned(), anchor: anchor.map(str::to_owned) }
        } else {
            Self::File(file.trim_start_matches("../").to_owned())
        }
    }
}

/// Text of one style.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) text: String,
    pub(super) strong: bool,
    pub(super) emphasis: bool,
    pub(super) code: bool,
    pub(super) link: Option<Link>,
}

/// A block of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Block {
    /// A heading of level 1 to 6.
    Heading { level: usize, anchor: String, spans: Vec<Span> },
    /// A paragraph, or a list item with its marker and nesting depth.
    Text { marker: Option<String>, depth: usize, spans: Vec<Span> },
    /// Preformatted text.
    Code(String),
    /// Rows of cells; the first row is the header.
    Table(Vec<Vec<Vec<Span>>>),
    /// A footnote with its label.
    Note { label: String, spans: Vec<Span> },
}

impl Block {
    /// Plain text of each row of a table, or of the whole block.
    pub(super) fn texts(&self) -> Vec<String> {
        match self {
            Self::Heading { spans, .. } | Self::Text { spans, .. } | Self::Note { spans, .. } => {
                vec![plain(spans)]
            }
            Self::Code(text) => vec![text.clone()],
            Self::Table(rows) => {
                let row = |cells: &Vec<Vec<Span>>| {
                    cells.iter().map(|spans| plain(spans)).collect::<Vec<_>>().join("   ")
                };
                rows.iter().map(row).collect()
            }
        }
    }
}

/// Text without style.
pub(super) fn plain(spans: &[Span]) -> String {
    spans.iter().map(|span| &*span.text).collect()
}

/// Anchor of a heading as GitHub defines it: lower case, hyphens for spaces, no punctuation.
fn anchor(heading: &str) -> String {
    let letters = heading.chars().flat_map(char::to_lowercase);
    let kept = letters.filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Parses a page. Pictures are omitted.
pub(super) fn parse(text: &str) -> Vec<Block> {
    let mut page = Page::default();
    for event in Parser::new_ext(text, Options::ENABLE_TABLES | Options::ENABLE_FOOTNOTES) {
        page.take(event);
    }
    page.blocks
}

/// State of the parser.
#[derive(Default)]
struct Page {
    blocks: Vec<Block>,
    spans: Vec<Span>,
    style: Span,
    /// Next number of each open list; `None` for bullets.
    lists: Vec<Option<u64>>,
    marker: Option<String>,
    note: Option<String>,
    code: Option<String>,
    rows: Vec<Vec<Vec<Span>>>,
    in_picture: bool,
}

impl Page {
    fn take(&mut self, event: Event<'_>) {
        match event {
            Event::Start(tag) => self.start(tag),
            Event::End(tag) => self.end(tag),
            Event::Text(text) => self.add(&text, false),
            Event::Code(text) => self.add(&text, true),
            Event::SoftBreak | Event::HardBreak => self.add(" ", false),
            Event::FootnoteReference(label) => {
                let link = Some(Link::Note(label.to_string()));
                self.spans.push(Span { text: format!("[{label}]"), link, ..Span::default() });
            }
            _ => {}
        }
    }

    fn add(&mut self, text: &str, code: bool) {
        if let Some(block) = &mut self.code {
            block.push_str(text);
        } else if !self.in_picture {
            let span = Span { text: text.to_owned(), code, ..self.style.clone() };
            match self.spans.last_mut() {
                Some(last) if (Span { text: last.text.clone(), ..span.clone() }) == *last => {
                    last.text.push_str(text);
                }
                _ => self.spans.push(span),
            }
        }
    }

    fn start(&mut self, tag: Tag<'_>) {
        match tag {
            Tag::Strong => self.style.strong = true,
            Tag::Emphasis => self.style.emphasis = true,
            Tag::Link { dest_url, .. } => self.style.link = Some(Link::new(&dest_url)),
            Tag::Image { .. } => self.in_picture = true,
            Tag::CodeBlock(_) => self.code = Some(String::new()),
            Tag::FootnoteDefinition(label) => self.note = Some(label.to_string()),
            Tag::List(first) => {
                self.flush();
                self.lists.push(first);
            }
            Tag::Item => {
                self.marker = Some(match self.lists.last_mut() {
                    Some(Some(number)) => {
                        *number += 1;
                        format!("{}.", *number - 1)
                    }
                    _ => "•".to_owned(),
                });
            }
            Tag::TableHead | Tag::TableRow => self.rows.push(Vec::new()),
            _ => {}
        }
    }

    fn end(&mut self, tag: TagEnd) {
        match tag {
            TagEnd::Strong => self.style.strong = false,
            TagEnd::Emphasis => self.style.emphasis = false,
            TagEnd::Link => self.style.link = None,
            TagEnd::Image => self.in_picture = false,
            TagEnd::Heading(level) => {
                let spans = std::mem::take(&mut self.spans);
                let anchor = anchor(&plain(&spans));
                self.blocks.push(Block::Heading { level: level as usize, anchor, spans });
            }
            TagEnd::CodeBlock => {
                let code = self.code.take().unwrap_or_default();
                self.blocks.push(Block::Code(code.trim_end().to_owned()));
            }
            TagEnd::List(_) => {
                self.lists.pop();
            }
            TagEnd::TableCell => {
                let spans = std::mem::take(&mut self.spans);
                if let Some(row) = self.rows.last_mut() {
                    row.push(spans);
                }
            }
            TagEnd::Table => self.blocks.push(Block::Table(std::mem::take(&mut self.rows))),
            TagEnd::Paragraph | TagEnd::Item => self.flush(),
            TagEnd::FootnoteDefinition => self.note = None,
            _ => {}
        }
    }

    /// Ends a paragraph, a list item or a footnote.
    fn flush(&mut self) {
        let spans = std::mem::take(&mut self.spans);
        if spans.is_empty() {
            return;
        }
        self.blocks.push(match &self.note {
            Some(label) => Block::Note { label: label.clone(), spans },
            None => Block::Text { marker: self.marker.take(), depth: self.lists.len(), spans },
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Span {
        Span { text: text.to_owned(), ..Span::default() }
    }

    #[test]
    fn a_page_becomes_blocks() {
        let page = "# A, *page*\n\nWith `code` and\n**weight**[^1].\n\n```sh\nflqr\n```\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n\
                    - one\n  1. two\n\n![picture](a.png)\n\n[^1]: <https://x.y> note\n";
        let note = Span { text: "[1]".into(), link: Some(Link::Note("1".into())), ..Span::default() };
        let web = Span {
            text: "https://x.y".into(),
            link: Some(Link::Web("https://x.y".into())),
            ..Span::default()
        };
        let item = |marker: &str, depth, item: &str| Block::Text {
            marker: Some(marker.into()),
            depth,
            spans: vec![text(item)],
        };
        let blocks = [
            Block::Heading {
                level: 1,
                anchor: "a-page".into(),
                spans: vec![text("A, "), Span { emphasis: true, ..text("page") }],
            },
            Block::Text {
                marker: None,
                depth: 0,
                spans: vec![
                    text("With "),
                    Span { code: true, ..text("code") },
                    text(" and "),
                    Span { strong: true, ..text("weight") },
                    note,
                    text("."),
                ],
            },
            Block::Code("flqr".into()),
            Block::Table(vec![
                vec![vec![text("a")], vec![text("b")]],
                vec![vec![text("1")], vec![text("2")]],
            ]),
            item("•", 1, "one"),
            item("1.", 2, "two"),
            Block::Note { label: "1".into(), spans: vec![web, text(" note")] },
        ];
        assert_eq!(parse(page), blocks);
    }

    #[test]
    fn links_are_distinguished() {
        let page = |file: &str, anchor: Option<&str>| Link::Page {
            file: file.into(),
            anchor: anchor.map(str::to_owned),
        };
        for (target, link) in [
            ("refine.md#demo", page("refine.md", Some("demo"))),
            ("#demo", page("", Some("demo"))),
            ("index.md", page("index.md", None)),
            ("../../src/main.rs", Link::File("src/main.rs".into())),
            ("https://a.b/c.md#d", Link::Web("https://a.b/c.md#d".into())),
        ] {
            assert_eq!(Link::new(target), link);
        }
    }
}
