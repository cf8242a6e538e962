//! Colours and spacing, for a light and a dark window.

use egui::{
    Color32, Context, CornerRadius, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, Theme, Visuals,
    vec2,
};

/// Colours with a meaning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Palette {
    /// Active values: new gains, the fitted curve.
    pub(crate) accent: Color32,
    /// Reference.
    pub(crate) reference: Color32,
    /// Curves of displacement, velocity and pitch.
    pub(crate) channels: [Color32; 3],
    /// Runs that are compared: without and with friction compensation; the colours of reports.
    pub(crate) runs: [Color32; 2],
    /// Measured points.
    pub(crate) measured: Color32,
    pub(crate) good: Color32,
    pub(crate) warning: Color32,
    pub(crate) error: Color32,
}

const DARK: Palette = Palette {
    accent: Color32::from_rgb(92, 172, 255),
    reference: Color32::from_rgb(150, 156, 168),
    channels: [
        Color32::from_rgb(92, 172, 255),
        Color32::from_rgb(92, 208, 158),
        Color32::from_rgb(245, 178, 92),
    ],
    runs: [Color32::from_rgb(92, 184, 238), Color32::from_rgb(242, 149, 90)],
    measured: Color32::from_rgb(227, 156, 203),
    good: Color32::from_rgb(92, 208, 158),
    warning: Color32::from_rgb(245, 186, 92),
    error: Color32::from_rgb(255, 122, 112),
};

const LIGHT: Palette = Palette {
    accent: Color32::from_rgb(18, 96, 200),
    reference: Color32::from_rgb(130, 136, 148),
    channels: [Color32::from_rgb(18, 96, 200), Color32::from_rgb(14, 128, 84), Color32::from_rgb(186, 98, 8)],
    runs: [Color32::from_rgb(0, 114, 178), Color32::from_rgb(213, 94, 0)],
    measured: Color32::from_rgb(176, 87, 143),
    good: Color32::from_rgb(14, 128, 84),
    warning: Color32::from_rgb(164, 92, 0),
    error: Color32::from_rgb(196, 40, 36),
};

/// Width of a scroll bar.
const SCROLL_BAR: f32 = 8.0;

/// The colours of the present theme.
pub(crate) fn palette(visuals: &Visuals) -> Palette {
    if visuals.dark_mode { DARK } else { LIGHT }
}

/// Gives boxes to tick an edge, so that they are seen while they are empty.
pub(crate) fn outline_boxes(visuals: &mut Visuals) {
    visuals.widgets.inactive.bg_stroke = Stroke::new(1.0, palette(visuals).reference);
    visuals.widgets.inactive.bg_fill = visuals.extreme_bg_color;
}

/// Gives both themes their look.
pub(crate) fn apply(ctx: &Context) {
    ctx.set_fonts(fonts());
    ctx.set_visuals_of(Theme::Dark, dark());
    ctx.set_visuals_of(Theme::Light, light());
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = vec2(8.0, 5.0);
        style.spacing.button_padding = vec2(8.0, 3.0);
        style.spacing.interact_size.y = 22.0;
        style.spacing.slider_width = 96.0;
        style.spacing.combo_width = 60.0;
        // Bars have room of their own, so that they never lie over what they scroll.
        style.spacing.scroll.floating_allocated_width = SCROLL_BAR;
        style.spacing.scroll.bar_width = SCROLL_BAR;
        style.text_styles.insert(TextStyle::Heading, FontId::new(14.5, FontFamily::Proportional));
        style.text_styles.insert(TextStyle::Body, FontId::new(13.0, FontFamily::Proportional));
        style.text_styles.insert(TextStyle::Button, FontId::new(13.0, FontFamily::Proportional));
        style.text_styles.insert(TextStyle::Small, FontId::new(11.5, FontFamily::Proportional));
        style.text_styles.insert(TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace));
    });
}

/// The default fonts, with the monospace one as a second source of signs: messages carry arrows and Greek.
fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let others = fonts.families.get(&FontFamily::Monospace).cloned().unwrap_or_default();
    let proportional = fonts.families.entry(FontFamily::Proportional).or_default();
    for font in others {
        if !proportional.contains(&font) {
            proportional.push(font);
        }
    }
    fonts
}

fn dark() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = Color32::from_rgb(27, 29, 34);
    visuals.window_fill = Color32::from_rgb(34, 37, 43);
    visuals.extreme_bg_color = Color32::from_rgb(19, 21, 25);
    visuals.faint_bg_color = Color32::from_rgb(34, 37, 43);
    visuals.widgets.noninteractive.fg_stroke.color = Color32::from_rgb(206, 210, 218);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(48, 52, 60));
    visuals.widgets.inactive.fg_stroke.color = Color32::from_rgb(216, 220, 228);
    visuals.selection.bg_fill = Color32::from_rgb(30, 84, 148);
    visuals.selection.stroke.color = Color32::from_rgb(224, 238, 255);
    rounded(visuals)
}

fn light() -> Visuals {
    let mut visuals = Visuals::light();
    visuals.panel_fill = Color32::from_rgb(246, 247, 249);
    visuals.window_fill = Color32::from_rgb(252, 252, 253);
    visuals.extreme_bg_color = Color32::WHITE;
    visuals.faint_bg_color = Color32::from_rgb(236, 238, 242);
    visuals.widgets.noninteractive.fg_stroke.color = Color32::from_rgb(48, 52, 60);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(214, 218, 226));
    visuals.widgets.inactive.fg_stroke.color = Color32::from_rgb(36, 40, 48);
    visuals.selection.bg_fill = Color32::from_rgb(196, 220, 252);
    visuals.selection.stroke.color = Color32::from_rgb(10, 62, 140);
    rounded(visuals)
}

fn rounded(mut visuals: Visuals) -> Visuals {
    let widgets = &mut visuals.widgets;
    for widget in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        widget.corner_radius = CornerRadius::same(4);
    }
    visuals.slider_trailing_fill = true;
    visuals
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contrast of two colours as WCAG 2 defines it.
    fn contrast(colors: [Color32; 2]) -> f32 {
        let luminance = |color: Color32| {
            let [red, green, blue, _] = egui::Rgba::from(color).to_array();
            0.2126 * red + 0.7152 * green + 0.0722 * blue
        };
        let [a, b] = colors.map(luminance);
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn an_empty_box_is_seen_in_both_themes() {
        for mut visuals in [dark(), light()] {
            outline_boxes(&mut visuals);
            let edge = visuals.widgets.inactive.bg_stroke.color;
            for behind in [visuals.panel_fill, visuals.faint_bg_color, visuals.extreme_bg_color] {
                assert!(contrast([edge, behind]) >= 3.0, "{edge:?} on {behind:?}");
            }
        }
    }
}
