//! The time that plots, side views and readings show, and its keys.

use egui::{Button, ComboBox, Context, Key, Modifiers, Slider, Ui, vec2};

use crate::plot::Marks;
use crate::widgets::mono;

const SPEEDS: [(f64, &str); 7] = [
    (0.1, "0.1 ×"),
    (0.25, "0.25 ×"),
    (0.5, "0.5 ×"),
    (1.0, "1 ×"),
    (2.0, "2 ×"),
    (5.0, "5 ×"),
    (10.0, "10 ×"),
];
/// Steps of the arrow keys: plain, with Shift, with Alt, s.
const STEPS_S: [(Modifiers, f64); 3] =
    [(Modifiers::SHIFT, 1.0), (Modifiers::ALT, 0.001), (Modifiers::NONE, 0.1)];
/// A frame that took longer than this lets the time jump no further, s.
const LONGEST_FRAME_S: f32 = 0.25;
/// Between two pictures while playing.
const FRAME: std::time::Duration = std::time::Duration::from_millis(16);

/// True if and how fast the time runs.
pub(super) struct Playback {
    pub(super) playing: bool,
    pub(super) speed: f64,
}

impl Default for Playback {
    fn default() -> Self {
        Self { playing: false, speed: 1.0 }
    }
}

impl Playback {
    /// Plays on from where the cursor is, from the start if it is at the end.
    fn toggle(&mut self, marks: &mut Marks) {
        self.playing = !self.playing;
        if self.playing && marks.cursor >= marks.limits[1] {
            marks.cursor = marks.limits[0];
        }
    }

    /// Lets the time of one frame pass.
    pub(super) fn advance(&mut self, ctx: &Context, marks: &mut Marks) {
        if !self.playing {
            return;
        }
        let passed = ctx.input(|input| input.stable_dt).min(LONGEST_FRAME_S);
        self.step(marks, self.speed * f64::from(passed));
        if self.playing {
            ctx.request_repaint_after(FRAME);
        }
    }

    fn step(&mut self, marks: &mut Marks, by_s: f64) {
        marks.cursor = (marks.cursor + by_s).clamp(marks.limits[0], marks.limits[1]);
        self.playing &= marks.cursor < marks.limits[1];
    }

    /// Space and, if they are free, the arrows, unless a control has the keyboard.
    pub(super) fn keys(&mut self, ui: &Ui, arrows: bool, marks: &mut Marks) {
        if ui.ctx().egui_wants_keyboard_input() {
            return;
        }
        // A slow frame may bring several presses.
        let presses = |modifiers, key| ui.input_mut(|input| input.count_and_consume_key(modifiers, key));
        if presses(Modifiers::NONE, Key::Space) % 2 == 1 {
            self.toggle(marks);
        }
        for (modifiers, step_s) in STEPS_S.into_iter().filter(|_| arrows) {
            for (key, sign) in [(Key::ArrowLeft, -1.0), (Key::ArrowRight, 1.0)] {
                let count = presses(modifiers, key);
                if count > 0 {
                    self.playing = false;
                    self.step(marks, sign * step_s * count as f64);
                }
            }
        }
        for (key, place) in [(Key::Home, 0), (Key::End, 1)] {
            if presses(Modifiers::NONE, key) > 0 {
                self.playing = false;
                marks.cursor = marks.limits[place];
            }
        }
    }

    /// Play, speed and the time as a slider.
    pub(super) fn ui(&mut self, ui: &mut Ui, marks: &mut Marks) {
        ui.horizontal(|ui| {
            let (name, help) =
                if self.playing { ("Pause", "Pause playback (Space)") } else { ("Play", "Play (Space)") };
            if ui.add(Button::new(name).min_size(vec2(52.0, 0.0))).on_hover_text(help).clicked() {
                self.toggle(marks);
            }
            self.speed_ui(ui);
            let reading = mono(format!("{:>8.3} s", marks.cursor));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(reading).on_hover_text("Time of the cursor");
                ui.spacing_mut().slider_width = (ui.available_width() - 4.0).max(10.0);
                let slider = Slider::new(&mut marks.cursor, marks.limits[0]..=marks.limits[1])
                    .show_value(false)
                    .trailing_fill(true);
                let slider = ui.add(slider).accessible_name("time");
                let help = "Drag, or use ← and → (0.1 s; Shift 1 s, Alt 1 ms), Home and End";
                if slider.on_hover_text(help).changed() {
                    self.playing = false;
                }
            });
        });
    }

    fn speed_ui(&mut self, ui: &mut Ui) {
        let shown = SPEEDS.iter().find(|(speed, _)| *speed == self.speed).map_or("", |(_, name)| name);
        let combo = ComboBox::from_id_salt("speed").selected_text(shown).width(60.0).show_ui(ui, |ui| {
            for (speed, name) in SPEEDS {
                ui.selectable_value(&mut self.speed, speed, name);
            }
        });
        combo.response.on_hover_text("Playback speed").accessible_name("playback speed");
    }
}
