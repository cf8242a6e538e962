//! Which pages are next to, below and behind each other.

mod node;

use egui::{CursorIcon, Response, ScrollArea, Ui, WidgetText};
use egui_tiles::{
    Behavior, Container, LinearDir, SimplificationOptions, Tabs, Tile, TileId, Tiles, Tree, UiResponse,
};

use crate::pages::Tab;
pub(crate) use node::{Node, Side};

/// Below this width nothing is of use, whatever scrolls.
const LEAST_WIDTH: f32 = 60.0;

/// The tiles of the window.
pub(crate) struct Layout {
    tree: Tree<Tab>,
    /// Pages that were drawn last.
    shown: Vec<Tab>,
}

impl Layout {
    /// All pages in one tile, `tab` in front.
    pub(crate) fn new(tab: Tab) -> Self {
        let mut layout = Self { tree: tree_of(&Node::default()), shown: vec![tab] };
        layout.select(tab);
        layout
    }

    /// Brings a page to the front of its tile.
    pub(crate) fn select(&mut self, tab: Tab) {
        self.tree.make_active(|_, tile| matches!(tile, Tile::Pane(pane) if *pane == tab));
    }

    /// Gives a page a separate tile, or takes it back to the others.
    pub(crate) fn move_tab(&mut self, tab: Tab, side: Side) {
        self.set_node(&self.node().moved(tab, side));
        self.select(tab);
    }

    /// The layout as data.
    pub(crate) fn node(&self) -> Node {
        self.tree.root().map_or_else(Node::default, |root| node_of(&self.tree.tiles, root)).fixed()
    }

    /// Takes over a layout; whatever is wrong with it, every page is in it once.
    pub(crate) fn set_node(&mut self, node: &Node) {
        self.tree = tree_of(&node.fixed());
    }

    /// Returns whether there is more than one tile.
    pub(crate) fn is_split(&self) -> bool {
        let is_tabs = |tile: &&Tile<Tab>| matches!(tile, Tile::Container(Container::Tabs(_)));
        self.tree.tiles.tiles().filter(is_tabs).count() > 1
    }

    /// Returns whether a page is in view.
    pub(crate) fn shows(&self, tab: Tab) -> bool {
        self.shown.contains(&tab)
    }

    /// Pages that are in view.
    pub(crate) fn shown(&self) -> &[Tab] {
        &self.shown
    }

    /// Draws the pages in view with `draw`; gives the one that the user turned to.
    pub(crate) fn ui(&mut self, ui: &mut Ui, draw: &mut dyn FnMut(Tab, &mut Ui)) -> Option<Tab> {
        let mut pages = Pages { draw, split: self.is_split(), shown: Vec::new(), turned_to: None };
        self.tree.ui(&mut pages, ui);
        let Pages { shown, turned_to, .. } = pages;
        self.shown = shown;
        turned_to
    }
}

/// Requests of the tiles while they are drawn.
struct Pages<'a> {
    draw: &'a mut dyn FnMut(Tab, &mut Ui),
    split: bool,
    shown: Vec<Tab>,
    turned_to: Option<Tab>,
}

impl Behavior<Tab> for Pages<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, tab: &mut Tab) -> UiResponse {
        let rect = ui.max_rect();
        self.shown.push(*tab);
        let pressed = ui.input(|input| input.pointer.any_pressed());
        if self.split && pressed && ui.rect_contains_pointer(rect) {
            self.turned_to = Some(*tab);
        }
        let least = tab.least_width();
        if self.split && (LEAST_WIDTH..least).contains(&rect.width()) {
            ScrollArea::horizontal().id_salt(("page", tab.key())).auto_shrink(false).show(ui, |ui| {
                ui.set_width(least);
                (self.draw)(*tab, ui);
            });
        } else {
            (self.draw)(*tab, ui);
        }
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, tab: &Tab) -> WidgetText {
        tab.title().into()
    }

    fn is_tab_bar_visible(&self, _: TileId, _: &Tabs) -> bool {
        self.split
    }

    fn tab_hover_cursor_icon(&self) -> CursorIcon {
        CursorIcon::PointingHand
    }

    fn on_tab_button(&mut self, tiles: &mut Tiles<Tab>, tile: TileId, response: Response) -> Response {
        if response.clicked() {
            self.turned_to = tiles.get_pane(&tile).copied();
        }
        response.on_hover_text("Drag to another tile, or to the edge of one")
    }

    fn gap_width(&self, _: &egui::Style) -> f32 {
        3.0
    }

    fn min_size(&self) -> f32 {
        80.0
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}

fn tree_of(node: &Node) -> Tree<Tab> {
    let mut tiles = Tiles::default();
    let root = insert(&mut tiles, node);
    Tree::new(egui::Id::unique("pages"), root, tiles)
}

fn insert(tiles: &mut Tiles<Tab>, node: &Node) -> TileId {
    match node {
        Node::Tabs { tabs, active } => {
            let children: Vec<_> = tabs.iter().map(|tab| tiles.insert_pane(*tab)).collect();
            let front =
                tabs.iter().position(|tab| Some(*tab) == *active).and_then(|index| children.get(index));
            let mut container = Tabs::new(children.clone());
            if let Some(front) = front {
                container.set_active(*front);
            }
            tiles.insert_container(container)
        }
        Node::Split { below, shares, children } => {
            let children: Vec<_> = children.iter().map(|child| insert(tiles, child)).collect();
            let direction = if *below { LinearDir::Vertical } else { LinearDir::Horizontal };
            let mut container = egui_tiles::Linear::new(direction, children.clone());
            for (child, share) in children.iter().zip(shares) {
                container.shares.set_share(*child, *share);
            }
            tiles.insert_container(container)
        }
    }
}

fn node_of(tiles: &Tiles<Tab>, tile: TileId) -> Node {
    let container = match tiles.get(tile) {
        None => return Node::Tabs { tabs: Vec::new(), active: None },
        Some(Tile::Pane(tab)) => return Node::Tabs { tabs: vec![*tab], active: Some(*tab) },
        Some(Tile::Container(container)) => container,
    };
    let children: Vec<TileId> = container.children().copied().collect();
    match container {
        Container::Tabs(tabs) => {
            let pane = |tile: &TileId| tiles.get_pane(tile).copied();
            let active = children.iter().find(|child| tabs.is_active(**child)).and_then(pane);
            Node::Tabs { tabs: children.iter().filter_map(pane).collect(), active }
        }
        Container::Linear(linear) => {
            let share = |child: &TileId| {
                linear.shares.iter().find(|(id, _)| *id == child).map_or(1.0, |(_, share)| *share)
            };
            Node::Split {
                below: linear.dir == LinearDir::Vertical,
                shares: children.iter().map(share).collect(),
                children: children.iter().map(|child| node_of(tiles, *child)).collect(),
            }
        }
        Container::Grid(_) => Node::Split {
            below: false,
            shares: vec![1.0; children.len()],
            children: children.iter().map(|child| node_of(tiles, *child)).collect(),
        },
    }
}
