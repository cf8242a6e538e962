//! Motors with their wheels in the air at the cursor's time: one disc a motor, turned as the encoder says.

use egui::{Align2, Color32, FontId, Sense, Stroke, Ui, Vec2, pos2, vec2};

use super::run::Recorded;
use super::scene::spoke;
use crate::plot::{Unit, UnitChoice};
use crate::quantity::to_scale;

/// Dials larger than this show no more.
pub(super) const GREATEST_HEIGHT: f32 = 160.0;

/// One picture of a run's motors.
pub(super) struct Dials<'a> {
    pub(super) title: &'a str,
    pub(super) color: Color32,
    pub(super) run: &'a Recorded,
    /// Names and columns of the speeds.
    pub(super) speeds: &'a [(&'static str, usize)],
    pub(super) time_s: f64,
}

impl Dials<'_> {
    pub(super) fn ui(&self, ui: &mut Ui, size: Vec2) {
        let (response, painter) = ui.allocate_painter(size.max(Vec2::splat(1.0)), Sense::hover());
        let rect = response.accessible_name(format!("motors under {}", self.title)).rect;
        painter.rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
        let top = rect.left_top() + vec2(8.0, 5.0);
        painter.text(top, Align2::LEFT_TOP, self.title, FontId::proportional(13.0), self.color);
        let index = self.run.time_s.partition_point(|time| *time <= self.time_s).saturating_sub(1);
        let Some(angles) = self.run.motor_angles_rad(index) else { return };
        let ink = ui.visuals().text_color();
        let radius = (0.36 * rect.height() - 6.0).min(0.2 * rect.width()).max(1.0);
        let count = self.speeds.len() as f32;
        let (unit, scale) = Unit::AngularSpeed.shown(UnitChoice::of(ui.ctx()));
        for (place, ((name, column), angle)) in self.speeds.iter().zip(angles).enumerate() {
            let x = rect.left() + rect.width() * (place as f32 + 0.5) / count;
            let center = pos2(x, rect.center().y - 4.0);
            painter.circle(center, radius, self.color.gamma_multiply(0.18), Stroke::new(2.0, self.color));
            for number in 1..6 {
                let rim = spoke(0.85 * radius, angle + f64::from(number) * std::f64::consts::FRAC_PI_3);
                painter.line_segment([center, center + rim], Stroke::new(1.0, ink.gamma_multiply(0.4)));
            }
            painter.line_segment([center, center + spoke(0.85 * radius, angle)], Stroke::new(2.5, ink));
            let speed = self.run.columns[*column].get(index).copied().unwrap_or(f64::NAN);
            let text = format!("{name} {} {unit}", to_scale(scale * speed, 0.1 * scale));
            let below = pos2(x, rect.bottom() - 5.0);
            painter.text(below, Align2::CENTER_BOTTOM, text, FontId::proportional(11.5), ink);
        }
    }
}
