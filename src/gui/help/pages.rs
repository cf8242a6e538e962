//! The pages of the manual, compiled in.

use std::sync::LazyLock;

use super::markdown::{Block, Link, parse};
use crate::pages::Tab;

/// Files of the manual in the order of its index.
const FILES: [(&str, &str); 15] = [
    ("index.md", include_str!("../../../assets/manual/index.md")),
    ("design.md", include_str!("../../../assets/manual/design.md")),
    ("simulate.md", include_str!("../../../assets/manual/simulate.md")),
    ("experiments.md", include_str!("../../../assets/manual/experiments.md")),
    ("friction.md", include_str!("../../../assets/manual/friction.md")),
    ("logs.md", include_str!("../../../assets/manual/logs.md")),
    ("refine.md", include_str!("../../../assets/manual/refine.md")),
    ("robot.md", include_str!("../../../assets/manual/robot.md")),
    ("files.md", include_str!("../../../assets/manual/files.md")),
    ("commands.md", include_str!("../../../assets/manual/commands.md")),
    ("window.md", include_str!("../../../assets/manual/window.md")),
    ("figures.md", include_str!("../../../assets/manual/figures.md")),
    ("limits.md", include_str!("../../../assets/manual/limits.md")),
    ("comparison.md", include_str!("../../../assets/manual/comparison.md")),
    ("development.md", include_str!("../../../assets/manual/development.md")),
];

/// Minimum length of a search text.
const SHORTEST_SEARCH: usize = 2;

/// A page of the manual.
pub(super) struct Page {
    /// Name of the file.
    pub(super) file: &'static str,
    /// First heading.
    pub(super) title: String,
    pub(super) blocks: Vec<Block>,
    /// Text of each block or table row in lower case, with its place.
    texts: Vec<(Place, String)>,
}

/// A place on a page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) page: usize,
    pub(super) block: usize,
    /// Row of a table.
    pub(super) row: usize,
}

/// A place where the words of a search occur.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Hit {
    pub(super) place: Place,
    /// Text of the block or table row.
    pub(super) text: String,
}

/// All pages.
pub(super) static PAGES: LazyLock<Vec<Page>> = LazyLock::new(|| {
    let page = |(page, (file, text)): (usize, &(&'static str, &str))| {
        let blocks = parse(text);
        let title = blocks.first().map(|block| block.texts().concat()).unwrap_or_default();
        let rows = |(block, content): (usize, &Block)| {
            let texts = content.texts().into_iter().enumerate();
            texts
                .map(move |(row, text)| (Place { page, block, row }, text.to_lowercase()))
                .collect::<Vec<_>>()
        };
        let texts = blocks.iter().enumerate().flat_map(rows).collect();
        Page { file, title, blocks, texts }
    };
    FILES.iter().enumerate().map(page).collect()
});

/// Page and heading that describe a page of the window.
pub(super) fn place_of(tab: Tab) -> Place {
    let (file, anchor) = tab.manual();
    place(0, file, anchor).unwrap_or_default()
}

/// Place of a file and a heading; an empty file is `page`.
fn place(page: usize, file: &str, anchor: Option<&str>) -> Option<Place> {
    let page = if file.is_empty() { page } else { PAGES.iter().position(|page| page.file == file)? };
    let is_it =
        |block: &Block| matches!(block, Block::Heading { anchor: known, .. } if Some(&**known) == anchor);
    let block = match anchor {
        None => 0,
        Some(_) => PAGES[page].blocks.iter().position(is_it)?,
    };
    Some(Place { page, block, row: 0 })
}

/// Target of a link on a page; `None` for a target outside of the manual.
pub(super) fn target(page: usize, link: &Link) -> Option<Place> {
    match link {
        Link::Page { file, anchor } => place(page, file, anchor.as_deref()),
        Link::Note(label) => {
            let is_it = |block: &Block| matches!(block, Block::Note { label: known, .. } if known == label);
            let block = PAGES[page].blocks.iter().position(is_it)?;
            Some(Place { page, block, row: 0 })
        }
        Link::File(_) | Link::Web(_) => None,
    }
}

/// Finds the blocks and table rows that contain all words of a text.
pub(super) fn search(text: &str) -> Vec<Hit> {
    let text = text.trim().to_lowercase();
    if text.chars().count() < SHORTEST_SEARCH {
        return Vec::new();
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    let all = PAGES.iter().flat_map(|page| &page.texts);
    all.filter(|(_, text)| words.iter().all(|word| text.contains(word)))
        .map(|&(place, _)| Hit {
            place,
            text: PAGES[place.page].blocks[place.block].texts().swap_remove(place.row),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::markdown::Span;
    use super::*;

    #[test]
    fn every_file_of_the_manual_is_compiled_in() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/manual");
        let mut found: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|file| file.unwrap().file_name().into_string().unwrap())
            .collect();
        let mut files = FILES.map(|(file, _)| file.to_owned()).to_vec();
        found.sort_unstable();
        files.sort_unstable();
        assert_eq!(found, files);
    }

    #[test]
    fn every_link_within_the_manual_has_a_target() {
        let mut count = 0;
        for (number, page) in PAGES.iter().enumerate() {
            let spans = |block: &Block| -> Vec<Span> {
                match block {
                    Block::Heading { spans, .. } | Block::Text { spans, .. } | Block::Note { spans, .. } => {
                        spans.clone()
                    }
                    Block::Table(rows) => rows.iter().flatten().flatten().cloned().collect(),
                    Block::Code(_) => Vec::new(),
                }
            };
            for link in page.blocks.iter().flat_map(spans).filter_map(|span| span.link) {
                let leads_out = matches!(link, Link::Web(_) | Link::File(_));
                assert_eq!(target(number, &link).is_none(), leads_out, "{}: {link:?}", page.file);
                count += 1;
            }
        }
        assert!(count > 200, "{count} links");
        for tab in Tab::ALL {
            assert_ne!(place_of(tab), Place::default(), "{tab:?} has no page");
        }
    }

    #[test]
    fn a_search_finds_rows_of_tables_by_all_words() {
        assert_eq!(search("z"), []);
        assert_eq!(search("no such words"), []);
        let hits = search("Presliding DAHL");
        let [hit] = &hits[..] else { panic!("{hits:?}") };
        assert_eq!(PAGES[hit.place.page].file, "files.md");
        assert!(hit.text.starts_with("presliding   part of the dry friction"), "{}", hit.text);
    }
}
