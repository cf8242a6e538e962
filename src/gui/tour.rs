//! A first look at the window, on what is built in: five steps, each with something to do.

use egui::{Align2, Context, RichText, Window, vec2};

use crate::command::{Command, Commands};
use crate::tab::Tab;

/// Title, what to do, and the page it is on.
const STEPS: [(&str, &str, Tab); 5] = [
    (
        "The robot in the middle is simulated",
        "Press “Push” above the plots: the controller catches it. Then drag the slider of the pitch weight at the left and push again; the gains follow while you drag. Ctrl+Z takes a drag back.",
        Tab::Tune,
    ),
    (
        "Both controllers side by side",
        "Press the button that runs LQR and FLQR. The same robot stands twice, without and with friction compensation; the table says how much less it hunts. Space lets the time run.",
        Tab::Experiments,
    ),
    (
        "Friction from a measurement",
        "With a log of your motor: drop its CSV file here, or type its path (Ctrl+L), then “Start fit”. What was fitted goes into the model with one button.",
        Tab::Friction,
    ),
    (
        "A robot, or one that speaks like it",
        "Choose “emulated” as the source at the top and press Connect: the real bytes, without hardware. Nothing is sent before it is armed in two steps; Esc and Space always stop it.",
        Tab::Robot,
    ),
    (
        "Everything by name",
        "Ctrl+K finds any command, also the way to put pages beside each other. The session is kept by itself; “Save the model” writes it to a file of your own.",
        Tab::Tune,
    ),
];

/// Where the tour stands.
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
                            .on_hover_text("“Tour” in the menu brings it back")
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
