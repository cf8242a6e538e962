//! The manual in the window: pages, links between them and search.

mod blocks;
mod markdown;
mod pages;

use egui::{Align, Context, Key, Modifiers, Rect, RichText, ScrollArea, TextEdit, Ui, Window, vec2};

use crate::command::{Command, Commands};
use crate::pages::Tab;
use crate::theme::palette;
use crate::widgets::hint_ui;
use blocks::{Columns, block_ui};
use markdown::Link;
use pages::{PAGES, Place, place_of, search, target};

const SIZE: egui::Vec2 = vec2(980.0, 640.0);
/// Width of the list of pages, and minimum width of the window that shows the list and a page side by side.
const LIST_WIDTH: f32 = 210.0;
const WIDTH_WITH_LIST: f32 = 620.0;
const MOST_HITS: usize = 60;
/// Length of the text of a hit, characters.
const HIT_LENGTH: usize = 90;

/// Scroll target of the page.
#[derive(Clone, Copy)]
enum Jump {
    Place(Place),
    Offset(f32),
}

/// The open manual.
pub(crate) struct Help {
    page: usize,
    /// Previous pages with their scroll offsets.
    history: Vec<(usize, f32)>,
    offset: f32,
    jump: Option<Jump>,
    /// Place of the selected hit.
    marked: Option<Place>,
    filter: String,
    has_focus: bool,
    /// Whether the search field requests the focus in the next frame.
    wants_focus: bool,
    /// Height of each block at `width`; `None` until it is drawn.
    heights: Vec<Option<f32>>,
    width: f32,
    columns: Vec<Columns>,
}

impl Help {
    /// Opens the manual at the description of a page of the window.
    pub(crate) fn open(tab: Tab) -> Self {
        let mut help = Self {
            page: 0,
            history: Vec::new(),
            offset: 0.0,
            jump: None,
            marked: None,
            filter: String::new(),
            has_focus: false,
            wants_focus: true,
            heights: Vec::new(),
            width: 0.0,
            columns: Vec::new(),
        };
        help.turn_to(place_of(tab).page, Jump::Place(place_of(tab)));
        help
    }

    /// Goes to the description of a page of the window.
    pub(crate) fn show(&mut self, tab: Tab) {
        self.wants_focus = true;
        self.go(place_of(tab));
    }

    /// Page and scroll offset, for scripts.
    pub(crate) fn snapshot(&self) -> serde_json::Value {
        let page = &PAGES[self.page];
        serde_json::json!({ "page": page.file, "title": page.title, "offset": self.offset.round() })
    }

    fn go(&mut self, place: Place) {
        if place.page != self.page || self.offset > 0.0 {
            self.history.push((self.page, self.offset));
        }
        self.marked = None;
        self.turn_to(place.page, Jump::Place(place));
    }

    fn turn_to(&mut self, page: usize, jump: Jump) {
        if page != self.page || self.heights.is_empty() {
            let blocks = PAGES[page].blocks.len();
            self.heights = vec![None; blocks];
            self.columns = vec![Columns::new(); blocks];
        }
        self.page = page;
        self.jump = Some(jump);
    }

    /// Draws the manual within an area of the window; returns whether it stays open.
    pub(crate) fn ui(&mut self, area: Rect, commands: &Commands, ctx: &Context) -> bool {
        let mut open = true;
        let most = (area.size() - vec2(24.0, 48.0)).max(vec2(120.0, 80.0));
        Window::new("Manual")
            .id(egui::Id::unique("manual"))
            .open(&mut open)
            .constrain_to(area)
            .default_size(SIZE.min(most))
            .max_size(most)
            .default_pos(area.center() - 0.5 * SIZE.min(most) - vec2(0.0, 16.0))
            .show(ctx, |ui| self.content_ui(commands, ui));
        open && !self.closes(ctx)
    }

    /// Handles Esc: clears the search, or closes the manual if the search is empty.
    fn closes(&mut self, ctx: &Context) -> bool {
        let types_elsewhere = ctx.text_edit_focused() && !self.has_focus;
        if types_elsewhere || !ctx.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Escape)) {
            return false;
        }
        self.wants_focus = true;
        std::mem::take(&mut self.filter).is_empty()
    }

    fn content_ui(&mut self, commands: &Commands, ui: &mut Ui) {
        let wide = ui.available_width() >= WIDTH_WITH_LIST;
        let scrolled = ui.horizontal(|ui| self.head_ui(wide, ui)).inner;
        ui.separator();
        let height = ui.available_height();
        if wide {
            ui.horizontal_top(|ui| {
                ui.allocate_ui(vec2(LIST_WIDTH, height), |ui| {
                    ui.set_min_size(vec2(LIST_WIDTH, height));
                    ui.vertical(|ui| self.list_ui(ui));
                });
                ui.separator();
                ui.vertical(|ui| self.page_ui(scrolled, commands, ui));
            });
        } else if self.filter.trim().is_empty() {
            self.page_ui(scrolled, commands, ui);
        } else {
            self.list_ui(ui);
        }
    }

    /// Draws the search field; returns the distance that keys scroll the page, points.
    fn head_ui(&mut self, wide: bool, ui: &mut Ui) -> f32 {
        let back = ui.add_enabled(!self.history.is_empty(), egui::Button::new("Back"));
        if back.on_hover_text("To the previous place").clicked()
            && let Some((page, offset)) = self.history.pop()
        {
            self.marked = None;
            self.turn_to(page, Jump::Offset(offset));
        }
        if !wide {
            ui.menu_button("Pages", |ui| {
                if self.pages_ui(ui) {
                    ui.close();
                }
            });
        }
        let pressed = |ui: &Ui, key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let mut scrolled = 0.0;
        let mut enter = false;
        if self.has_focus {
            for (key, points) in
                [(Key::ArrowDown, -40.0), (Key::ArrowUp, 40.0), (Key::PageDown, -400.0), (Key::PageUp, 400.0)]
            {
                if pressed(ui, key) {
                    scrolled += points;
                }
            }
            enter = pressed(ui, Key::Enter);
        }
        let field = TextEdit::singleline(&mut self.filter)
            .hint_text("search the manual")
            .desired_width(if wide { LIST_WIDTH - 60.0 } else { ui.available_width() - 8.0 });
        let field = ui.add(field).accessible_name("search the manual");
        if std::mem::take(&mut self.wants_focus) {
            field.request_focus();
        }
        self.has_focus = field.has_focus();
        if enter && let Some(hit) = search(&self.filter).first() {
            self.choose(hit.place);
        }
        if wide {
            ui.label(RichText::new(&PAGES[self.page].title).strong());
        }
        scrolled
    }

    fn choose(&mut self, place: Place) {
        self.go(place);
        self.marked = Some(place);
    }

    /// Draws the hits of the search, or all pages.
    fn list_ui(&mut self, ui: &mut Ui) {
        ScrollArea::vertical().id_salt("list").auto_shrink([false, false]).show(ui, |ui| {
            if self.filter.trim().is_empty() {
                self.pages_ui(ui);
                return;
            }
            let hits = search(&self.filter);
            if hits.is_empty() {
                hint_ui(ui, "No page contains these words.");
            }
            let mut page = None;
            let mut chosen = None;
            for hit in hits.iter().take(MOST_HITS) {
                if page.replace(hit.place.page) != Some(hit.place.page) {
                    ui.label(RichText::new(&PAGES[hit.place.page].title).strong());
                }
                let is_marked = self.marked == Some(hit.place);
                let text: String = hit.text.chars().take(HIT_LENGTH).collect();
                let button = egui::Button::selectable(is_marked, RichText::new(text).small()).wrap();
                if ui.add(button).clicked() {
                    chosen = Some(hit.place);
                }
            }
            if hits.len() > MOST_HITS {
                hint_ui(ui, format!("{} more: add a word to the search.", hits.len() - MOST_HITS));
            }
            if let Some(place) = chosen {
                self.choose(place);
                if ui.available_width() > LIST_WIDTH {
                    // The list covers the page.
                    self.filter.clear();
                }
            }
        });
    }

    /// Draws the list of pages; returns whether one was selected.
    fn pages_ui(&mut self, ui: &mut Ui) -> bool {
        let mut chosen = None;
        for (number, page) in PAGES.iter().enumerate() {
            if ui.selectable_label(number == self.page, &page.title).clicked() {
                chosen = Some(Place { page: number, ..Place::default() });
            }
        }
        chosen.inspect(|place| self.go(*place)).is_some()
    }

    fn page_ui(&mut self, scrolled: f32, commands: &Commands, ui: &mut Ui) {
        let mut area = ScrollArea::vertical().id_salt("page").auto_shrink([false, false]);
        let jump = self.jump.take();
        if let Some(Jump::Offset(offset)) = jump {
            area = area.vertical_scroll_offset(offset);
        }
        let place = match jump {
            Some(Jump::Place(place)) => Some(place),
            _ => None,
        };
        let output = area.show(ui, |ui| {
            if scrolled != 0.0 {
                ui.scroll_with_delta(vec2(0.0, scrolled));
            }
            self.blocks_ui(place, ui)
        });
        self.offset = output.state.clamped_offset().y;
        match output.inner {
            Some(Link::Web(address)) => {
                ui.ctx().copy_text(address.clone());
                commands.send(Command::Say(format!("Copied {address}.")));
            }
            Some(link) => {
                if let Some(place) = target(self.page, &link) {
                    self.go(place);
                }
            }
            None => {}
        }
    }

    /// Draws the blocks in view and the one to scroll to; returns the link that was clicked.
    fn blocks_ui(&mut self, place: Option<Place>, ui: &mut Ui) -> Option<Link> {
        let width = ui.available_width();
        if (width - self.width).abs() > 0.5 {
            self.heights.fill(None);
            self.width = width;
        }
        ui.spacing_mut().item_spacing.y = 7.0;
        let mut clicked = None;
        for (number, block) in PAGES[self.page].blocks.iter().enumerate() {
            let is = |place: Option<Place>| {
                place.filter(|place| place.page == self.page && place.block == number).map(|place| place.row)
            };
            let (wanted, marked) = (is(place), is(self.marked));
            let top = ui.cursor().top();
            if let Some(height) = self.heights[number]
                && wanted.is_none()
                && !ui.clip_rect().y_range().intersects(egui::Rangef::new(top, top + height))
            {
                ui.allocate_space(vec2(1.0, height));
                continue;
            }
            let drawn =
                ui.push_id(number, |ui| block_ui(block, &mut self.columns[number], wanted.or(marked), ui));
            self.heights[number] = Some(drawn.response.rect.height());
            let rect = drawn.inner.row.unwrap_or(drawn.response.rect);
            clicked = drawn.inner.clicked.or(clicked);
            if marked.is_some() {
                let bar = Rect::from_min_max(rect.left_top(), egui::pos2(rect.left() + 3.0, rect.bottom()));
                ui.painter().rect_filled(bar, 1.0, palette(ui.visuals()).accent);
            }
            if wanted.is_some() {
                // The first block shows the page from its top.
                let align = if number == 0 || wanted == Some(0) { Align::TOP } else { Align::Center };
                ui.scroll_to_rect_animation(rect, Some(align), egui::style::ScrollAnimation::none());
            }
        }
        clicked
    }
}
