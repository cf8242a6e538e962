//! Writes XML that is well formed by construction: elements close themselves, everything else is escaped.

use std::fmt::Display;

use super::inline_style::InlineStyle;

/// An attribute of an element.
pub(super) type Attribute<'a> = (&'a str, &'a dyn Display);

/// A growing piece of XML.
#[derive(Default)]
pub(super) struct Markup {
    out: String,
    /// Given to every element as attributes.
    looks: Option<InlineStyle>,
}

impl Markup {
    /// Markup whose elements have their looks with them.
    pub(super) fn with_looks(looks: InlineStyle) -> Self {
        Self { out: String::new(), looks: Some(looks) }
    }

    pub(super) fn into_string(self) -> String {
        self.out
    }

    /// An element with content; it is closed in any case, as HTML needs for all but void elements.
    pub(super) fn element(
        &mut self,
        name: &str,
        attributes: &[Attribute<'_>],
        content: impl FnOnce(&mut Self),
    ) {
        self.open(name, attributes);
        self.out.push('>');
        content(self);
        self.out.push_str("</");
        self.out.push_str(name);
        self.out.push('>');
    }

    /// An element with nothing but text in it.
    pub(super) fn text_element(&mut self, name: &str, attributes: &[Attribute<'_>], text: &str) {
        self.element(name, attributes, |markup| markup.text(text));
    }

    /// An element without content: a void element of HTML or any of SVG.
    pub(super) fn leaf(&mut self, name: &str, attributes: &[Attribute<'_>]) {
        self.open(name, attributes);
        self.out.push_str("/>");
    }

    pub(super) fn text(&mut self, text: &str) {
        escape(text, &mut self.out);
    }

    /// A line break for readers of the source; without meaning between block elements.
    pub(super) fn line(&mut self) {
        self.out.push('\n');
    }

    /// Text that is markup already.
    pub(super) fn raw(&mut self, markup: &str) {
        self.out.push_str(markup);
    }

    fn open(&mut self, name: &str, attributes: &[Attribute<'_>]) {
        self.out.push('<');
        self.out.push_str(name);
        for (key, value) in attributes {
            self.attribute(key, &value.to_string());
        }
        if let Some(looks) = &self.looks {
            let classes = attributes.iter().find(|(key, _)| *key == "class");
            let classes = classes.map(|(_, classes)| classes.to_string()).unwrap_or_default();
            for (key, value) in looks.of(name, &classes) {
                self.attribute(key, &value);
            }
        }
    }

    fn attribute(&mut self, key: &str, value: &str) {
        self.out.push(' ');
        self.out.push_str(key);
        self.out.push_str("=\"");
        escape(value, &mut self.out);
        self.out.push('"');
    }
}

/// Escapes for text and attributes alike; characters that XML does not allow at all become U+FFFD.
fn escape(text: &str, out: &mut String) {
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' => out.push(character),
            '\u{0}'..='\u{1f}' | '\u{7f}'..='\u{9f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(character),
        }
    }
}
