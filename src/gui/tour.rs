//! A first look at the window, on what is built in: five steps, each with something to do.

use egui::{Align2, Context, RichText, Window, vec2};

use crate::command::{Command, Commands};
use crate::pages::Tab;

/// Title, what to do, and the page it is on.
const STEPS: [(&str, &str, Tab); 5] = [
    (
        "The robot in the middle is simulated",
        "Press “Push” above the plots: the controller recovers. Then drag the slider of the pitch weight on the left and push again; the gains are updated while you drag. Ctrl+Z undoes it.",
        Tab::Tune,
    ),
    (
        "Both controllers side by side",
        "Press the button that runs LQR and FLQR. The table compares the same robot without and with friction compensation. Space plays the run.",
        Tab::Experiments,
    ),
    (
        "Friction from a measurement",
        "Drop the CSV log of your motor here, or type its path (Ctrl+L), then press “Start fit”. One button uses the result in the model.",
        Tab::Friction,
    ),
    (
        "A real or an emulated robot",
        "Choose “emulated” as the source at the top and press Connect to use the real protocols without hardware. Nothing is sent before it is armed in two steps; Esc and Space always stop it.",
        Tab::Robot,
    ),
    (
        "All commands by name",
        "Ctrl+K finds any command, for example to arrange pages side by side. The session is saved automatically; “Save the model” writes the model to a file.",
        Tab::Tune,
    ),
];

/// Step of the tour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tour {
    step: usize,
}

impl Tour {
    /// Number of the step, from 1.
    pub(crate) fn number(self) -> usize {
        self.step + 1
    }

    /// Draws the step; gives where the tour stands then, none when it has ended.
    pub(crate) fn ui(self, commands: &Commands, ctx: &Context) -> Option<Self> {
        let (title, text, _) = STEPS[self.step];
        let mut next = Some(self.step);
        Window::new("tour")
            .title_bar(false)
            .resizable(false)
            .anchor(Align2::RIGHT_BOTTOM, vec2(-16.0, -40.0))
            .default_width(360.0)
            .show(ctx, |ui| {
                ui.set_max_width(360.0);
                ui.label(RichText::new(title).heading().strong());
                ui.label(text);
                ui.add_space(6.0);
                ui.horizontal(|ui| {
                    ui.weak(format!("{} of {}", self.number(), STEPS.len()));
                    if self.step > 0 && ui.button("Step back").clicked() {
                        next = Some(self.step - 1);
                    }
                    let last = self.step + 1 == STEPS.len();
                    if ui.button(if last { "End the tour" } else { "Next step" }).clicked() {
                        next = (!last).then_some(self.step + 1);
                    }
                    if !last
                        && ui
                            .button("Skip the tour")
                            .on_hover_text("“Tour” in the menu shows it again")
                            .clicked()
                    {
                        next = None;
                    }
                });
            });
        let step = next?;
        if step != self.step {
            commands.send(Command::SelectTab(STEPS[step].2));
        }
        Some(Self { step })
    }
}
