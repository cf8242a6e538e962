//! A layout as plain data, for files and for undo.

use serde_json::{Value, json};

use crate::pages::Tab;

/// Position of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Right,
    Below,
    /// Behind the others again.
    Back,
}

impl Side {
    pub(crate) const ALL: [Self; 3] = [Self::Right, Self::Below, Self::Back];

    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Below => "below",
            Self::Back => "back",
        }
    }

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Right => "to the right",
            Self::Below => "to the bottom",
            Self::Back => "back to the others",
        }
    }
}

/// Files nested deeper than this are not of this program.
const DEEPEST: usize = 12;

/// A part of a layout.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Node {
    /// Pages behind each other.
    Tabs { tabs: Vec<Tab>, active: Option<Tab> },
    /// Parts next to or below each other.
    Split { below: bool, shares: Vec<f32>, children: Vec<Node> },
}

impl Default for Node {
    fn default() -> Self {
        Self::Tabs { tabs: Tab::ALL.to_vec(), active: Some(Tab::default()) }
    }
}

impl Node {
    /// With `tab` in a separate tile at a side of all others, or behind the first of the others.
    pub(crate) fn moved(&self, tab: Tab, side: Side) -> Self {
        let mut seen = vec![tab];
        let Some(rest) = self.without(&mut seen) else { return self.clone() };
        let alone = Self::Tabs { tabs: vec![tab], active: Some(tab) };
        match side {
            Side::Right | Side::Below => rest.beside(alone, side == Side::Below),
            Side::Back => {
                let mut rest = rest;
                rest.first_tabs().insert(0, tab);
                rest.in_order()
            }
        }
    }

    /// With another part at its end: among several in a row all of them keep their proportions, and the new one gets
    /// as much as they have on average.
    fn beside(self, other: Self, other_below: bool) -> Self {
        match self {
            Self::Split { below, mut shares, mut children } if below == other_below => {
                shares.push(shares.iter().sum::<f32>() / shares.len() as f32);
                children.push(other);
                Self::Split { below, shares, children }
            }
            one => Self::Split { below: other_below, shares: vec![1.0, 1.0], children: vec![one, other] },
        }
    }

    /// With every page in it once, and nothing empty.
    pub(crate) fn fixed(&self) -> Self {
        let mut seen = Vec::new();
        let Some(mut node) = self.without(&mut seen) else { return Self::default() };
        let missing: Vec<Tab> = Tab::ALL.into_iter().filter(|tab| !seen.contains(tab)).collect();
        if missing.is_empty() {
            return node;
        }
        node.first_tabs().extend(missing);
        node.in_order()
    }

    /// Without the pages in `seen`, which gets those that are left; `None` if nothing is left.
    fn without(&self, seen: &mut Vec<Tab>) -> Option<Self> {
        match self {
            Self::Tabs { tabs, active } => {
                let mut kept = Vec::new();
                for tab in tabs {
                    if !seen.contains(tab) {
                        seen.push(*tab);
                        kept.push(*tab);
                    }
                }
                let active = active.filter(|tab| kept.contains(tab)).or(kept.first().copied());
                (!kept.is_empty()).then_some(Self::Tabs { tabs: kept, active })
            }
            Self::Split { below, shares, children } => {
                let share = |index: usize| {
                    shares.get(index).copied().filter(|share| (1e-3..1e3).contains(share)).unwrap_or(1.0)
                };
                let kept: Vec<(f32, Self)> = children
                    .iter()
                    .enumerate()
                    .filter_map(|(index, child)| Some((share(index), child.without(seen)?)))
                    .collect();
                let (shares, mut children): (Vec<f32>, Vec<Self>) = kept.into_iter().unzip();
                match children.len() {
                    0 => None,
                    1 => children.pop(),
                    _ => Some(Self::Split { below: *below, shares, children }),
                }
            }
        }
    }

    fn first_tabs(&mut self) -> &mut Vec<Tab> {
        match self {
            Self::Tabs { tabs, .. } => tabs,
            Self::Split { children, .. } => children[0].first_tabs(),
        }
    }

    /// The pages of the first tile in their usual order.
    fn in_order(mut self) -> Self {
        self.first_tabs().sort_by_key(|tab| *tab as usize);
        self
    }

    /// Returns whether only the front pages differ.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Tabs { tabs, .. }, Self::Tabs { tabs: others, .. }) => tabs == others,
            (
                Self::Split { below, shares, children },
                Self::Split { below: other_below, shares: other_shares, children: others },
            ) => {
                below == other_below
                    && shares == other_shares
                    && children.len() == others.len()
                    && children.iter().zip(others).all(|(child, other)| child.is_alike(other))
            }
            _ => false,
        }
    }

    /// For a file.
    pub(crate) fn to_value(&self) -> Value {
        match self {
            Self::Tabs { tabs, active } => json!({
                "tabs": tabs.iter().map(|tab| tab.key()).collect::<Vec<_>>(),
                "front": active.map(Tab::key),
            }),
            Self::Split { below, shares, children } => json!({
                "split": if *below { "below" } else { "beside" },
                "shares": shares,
                "parts": children.iter().map(Self::to_value).collect::<Vec<_>>(),
            }),
        }
    }

    /// From a file: what is of use of it, with every page once; `None` if nothing is.
    pub(crate) fn from_value(value: &Value) -> Option<Self> {
        let node = Self::read(value, DEEPEST)?;
        node.without(&mut Vec::new()).map(|node| node.fixed())
    }

    fn read(value: &Value, depth: usize) -> Option<Self> {
        let list = |key: &str| value.get(key).and_then(Value::as_array);
        if let Some(tabs) = list("tabs") {
            let tab = |value: &Value| Tab::from_key(value.as_str()?);
            let active = value.get("front").and_then(tab);
            return Some(Self::Tabs { tabs: tabs.iter().filter_map(tab).collect(), active });
        }
        let children = list("parts")?;
        let depth = depth.checked_sub(1)?;
        let share =
            |index: usize| list("shares").and_then(|all| all.get(index)?.as_f64()).unwrap_or(1.0) as f32;
        let read: Vec<(f32, Self)> = children
            .iter()
            .enumerate()
            .filter_map(|(index, child)| Some((share(index), Self::read(child, depth)?)))
            .collect();
        let (shares, children) = read.into_iter().unzip();
        Some(Self::Split {
            below: value.get("split").and_then(Value::as_str) == Some("below"),
            shares,
            children,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tabs_of(node: &Node) -> Vec<Tab> {
        match node {
            Node::Tabs { tabs, .. } => tabs.clone(),
            Node::Split { children, .. } => children.iter().flat_map(tabs_of).collect(),
        }
    }

    fn has_every_page_once(node: &Node) {
        let mut tabs = tabs_of(node);
        tabs.sort_by_key(|tab| *tab as usize);
        assert_eq!(tabs, Tab::ALL, "{node:?}");
    }

    #[test]
    fn a_page_goes_to_a_side_and_back() {
        let usual = Node::default();
        let beside = usual.moved(Tab::Robot, Side::Right);
        let below = beside.moved(Tab::Friction, Side::Below);
        for node in [&beside, &below] {
            has_every_page_once(node);
        }
        let Node::Split { below: true, children, .. } = &below else { panic!("{below:?}") };
        assert_eq!(tabs_of(&children[1]), [Tab::Friction]);
        let back = below.moved(Tab::Friction, Side::Back).moved(Tab::Robot, Side::Back);
        assert!(back.is_alike(&usual), "{back:?}");
    }

    #[test]
    fn a_third_page_in_a_row_is_as_wide_as_the_others() {
        let two = Node::default().moved(Tab::Robot, Side::Right);
        let three = two.moved(Tab::Runs, Side::Right);
        has_every_page_once(&three);
        let Node::Split { below: false, shares, children } = &three else { panic!("{three:?}") };
        assert_eq!((shares.as_slice(), tabs_of(&children[2])), ([1.0; 3].as_slice(), vec![Tab::Runs]));
        let Node::Split { below: true, shares, .. } = three.moved(Tab::Log, Side::Below) else { panic!() };
        assert_eq!(shares, [1.0; 2], "another direction");
    }

    #[test]
    fn a_layout_survives_its_file() {
        let node = Node::default().moved(Tab::Robot, Side::Right).moved(Tab::Tune, Side::Below);
        assert_eq!(Node::from_value(&node.to_value()), Some(node));
    }

    #[test]
    fn whatever_is_in_the_file_every_page_is_there_once() {
        let mut deep = json!({ "tabs": ["tune"] });
        for _ in 0..100 {
            deep = json!({ "parts": [deep, { "tabs": ["robot"] }] });
        }
        for (value, used) in [
            (json!({ "tabs": ["tune", "tune", "nonsense", 3], "front": "friction" }), true),
            (json!({ "parts": [{ "tabs": ["robot"] }, { "parts": [] }], "shares": [-1.0, null, "x"] }), true),
            (
                json!({ "split": "below", "parts": [{ "tabs": ["log"] }, { "tabs": ["tune"] }], "shares": [1e300] }),
                true,
            ),
            (deep, true),
            (json!(null), false),
            (json!({ "parts": 3 }), false),
            (json!({ "tabs": [] }), false),
        ] {
            let node = Node::from_value(&value);
            assert_eq!(node.is_some(), used, "{value}");
            has_every_page_once(&node.unwrap_or_default());
        }
    }
}
