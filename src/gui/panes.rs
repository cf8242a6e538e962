//! The panes of a page: next to each other where there is room, some of them behind their names where there is not.

use std::ops::RangeInclusive;

use egui::{CentralPanel, Frame, Id, Margin, Panel, ScrollArea, Ui};

/// Space at the left and right of a pane's content, in points.
pub(crate) const MARGIN: f32 = 10.0;

/// Fills the remaining space is at least this high unless it says more: a lower page scrolls.
const LEAST_HEIGHT: f32 = 420.0;

/// One pane; `key` is what the page calls it.
pub(crate) struct Pane<K> {
    key: K,
    name: &'static str,
    place: Place,
    width: f32,
    least_height: f32,
    scrolls: bool,
    wanted: bool,
}

enum Place {
    Left(RangeInclusive<f32>),
    Middle,
    Right(RangeInclusive<f32>),
}

impl<K> Pane<K> {
    /// At the left, `width` wide until it is dragged within `widths`; scrolls.
    pub(crate) fn left(key: K, name: &'static str, width: f32, widths: RangeInclusive<f32>) -> Self {
        Self::new(key, name, Place::Left(widths), width)
    }

    /// Remaining width between the others, at least `width`.
    pub(crate) fn middle(key: K, name: &'static str, width: f32) -> Self {
        Self::new(key, name, Place::Middle, width)
    }

    /// As [`Self::left`], at the right.
    pub(crate) fn right(key: K, name: &'static str, width: f32, widths: RangeInclusive<f32>) -> Self {
        Self::new(key, name, Place::Right(widths), width)
    }

    fn new(key: K, name: &'static str, place: Place, width: f32) -> Self {
        Self { key, name, place, width, least_height: LEAST_HEIGHT, scrolls: true, wanted: false }
    }

    /// At a side without a scroll bar: it fills its room, or scrolls a part of itself.
    pub(crate) fn fixed(self) -> Self {
        Self { scrolls: false, ..self }
    }

    /// In the middle, at least `height` high.
    pub(crate) fn at_least(self, height: f32) -> Self {
        Self { least_height: height, ..self }
    }

    /// Brought to the front where `wanted`: something in it is about to take the keyboard.
    pub(crate) fn in_front(self, wanted: bool) -> Self {
        Self { wanted, ..self }
    }
}

/// Draws those of `panes` that have room, by `show`; where some have not, a row of all names chooses.
pub(crate) fn panes_ui<K: Copy>(
    ui: &mut Ui,
    page: &'static str,
    panes: &[Pane<K>],
    mut show: impl FnMut(K, &mut Ui),
) {
    let margin = Margin::symmetric(MARGIN as i8, 6);
    let side = Frame::side_top_panel(ui.style()).inner_margin(margin);
    let central = Frame::central_panel(ui.style()).inner_margin(margin);
    let id = Id::unique(("pane in front", page));
    let middle = panes.iter().position(|pane| matches!(pane.place, Place::Middle)).unwrap_or(0);
    // By its name: a page may have other panes in less room.
    let chosen = ui.data(|data| data.get_temp::<&'static str>(id));
    let mut front = panes.iter().position(|pane| Some(pane.name) == chosen).unwrap_or(middle);
    if let Some(wanted) = panes.iter().position(|pane| pane.wanted) {
        front = wanted;
        ui.data_mut(|data| data.insert_temp(id, panes[wanted].name));
    }
    let widths: Vec<f32> = panes.iter().map(|pane| pane.width).collect();
    let room = ui.available_width();
    let mut shown = in_view(&widths, front, room);
    if shown.contains(&false) {
        let chosen = Panel::top((page, "panes")).frame(side).show(ui, |ui| {
            let names = |ui: &mut Ui| {
                let clicked = |(pane, shown): (&Pane<K>, &bool)| {
                    let name = ui.selectable_label(*shown, pane.name);
                    name.on_hover_text("The window is too small for all panes of this page").clicked()
                };
                // All of them are drawn before one is chosen.
                let clicks: Vec<bool> = panes.iter().zip(&shown).map(clicked).collect();
                clicks.into_iter().position(|clicked| clicked)
            };
            ui.horizontal_wrapped(names).inner
        });
        if let Some(chosen) = chosen.inner {
            front = chosen;
            ui.data_mut(|data| data.insert_temp(id, panes[chosen].name));
            shown = in_view(&widths, front, room);
        }
    }
    let filling = if shown.get(middle) == Some(&true) { middle } else { front };
    for (index, pane) in panes.iter().enumerate() {
        let id = (page, pane.name);
        let (panel, widths) = match &pane.place {
            _ if index == filling || !shown[index] => continue,
            Place::Middle => continue,
            Place::Left(widths) => (Panel::left(id), widths),
            Place::Right(widths) => (Panel::right(id), widths),
        };
        panel.frame(side).resizable(true).default_size(pane.width).size_range(widths.clone()).show(
            ui,
            |ui| {
                if !pane.scrolls {
                    return show(pane.key, ui);
                }
                ScrollArea::vertical().show(ui, |ui| show(pane.key, ui));
            },
        );
    }
    CentralPanel::default().frame(central).show(ui, |ui| match panes.get(filling) {
        Some(Pane { key, place: Place::Middle, least_height, .. }) => {
            if ui.available_height() >= *least_height {
                return show(*key, ui);
            }
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                let size = egui::vec2(ui.available_width(), *least_height);
                ui.allocate_ui(size, |ui| show(*key, ui));
            });
        }
        Some(pane) if !pane.scrolls => show(pane.key, ui),
        Some(pane) => {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| show(pane.key, ui));
        }
        None => {}
    });
}

/// Which panes are drawn in `room`: the one in front, and of the others, in their order, each that still fits.
fn in_view(widths: &[f32], front: usize, room: f32) -> Vec<bool> {
    let mut left = room - widths.get(front).copied().unwrap_or(0.0);
    let fits = |(index, width): (usize, &f32)| {
        let fits = index == front || *width <= left;
        if fits && index != front {
            left -= width;
        }
        fits
    };
    widths.iter().enumerate().map(fits).collect()
}

#[cfg(test)]
mod tests {
    use super::in_view;

    #[test]
    fn the_pane_in_front_is_always_drawn_and_others_where_they_fit() {
        let widths = [350.0, 400.0, 250.0];
        for (front, room, shown) in [
            (1, 1000.0, [true, true, true]),
            (1, 999.0, [true, true, false]),
            (2, 999.0, [true, false, true]),
            (1, 700.0, [false, true, true]),
            (1, 640.0, [false, true, false]),
            (0, 100.0, [true, false, false]),
            (2, 0.0, [false, false, true]),
        ] {
            assert_eq!(in_view(&widths, front, room), shown, "{front} in front of {room}");
        }
    }
}
