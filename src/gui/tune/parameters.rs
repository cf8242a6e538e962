//! Parameters of the model. A field keeps what was typed; only what the core accepts reaches the session.

use std::sync::LazyLock;

use egui::{CollapsingHeader, Grid, Ui};
use flqr_core::ParameterError;
use flqr_core::friction::{Stribeck, StribeckParameters};
use flqr_core::model::{ModelParameter, RobotParameters};
use flqr_core::model_file::presets;

use crate::command::Command;
use crate::context::ViewContext;
use crate::quantity::MOTORS;
use crate::session::Session;
use crate::widgets::{error_ui, hint_ui, number_ui, section_ui};

/// Initial values for a motor without friction or limit: the left motor of the paper's preset.
struct FirstValues {
    curve: StribeckParameters,
    torque_limit_nm: f64,
}

static FIRST_VALUES: LazyLock<FirstValues> = LazyLock::new(|| {
    let paper = presets::paper();
    let values = paper.robot().and_then(|robot| {
        let [left, _] = robot.friction;
        Some(FirstValues { curve: *left?.parameters(), torque_limit_nm: robot.limits.torque_nm? })
    });
    values.expect("the paper's preset has friction and a torque limit, as a test of this page finds")
});

/// Typed text.
pub(super) struct ParameterEditor {
    robot: Option<RobotParameters>,
    friction: [Option<StribeckParameters>; 2],
    torque_limit_nm: Option<f64>,
}

impl ParameterEditor {
    pub(super) fn new(session: &Session) -> Self {
        let curve = |motor| session.friction(motor).map(|curve| *curve.parameters());
        Self {
            robot: session.robot().map(|robot| robot.parameters),
            friction: [curve(0), curve(1)],
            torque_limit_nm: session.robot().and_then(|robot| robot.limits.torque_nm),
        }
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        if self.robot.is_none() {
            return;
        }
        section_ui(ui, "Robot", |_| {});
        self.robot_ui(context, ui);
        self.limit_ui(context, ui);
        ui.add_space(4.0);
        CollapsingHeader::new("Friction of the motors").default_open(true).show(ui, |ui| {
            self.friction_ui(context, ui);
        });
    }

    fn robot_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some(robot) = &mut self.robot else { return };
        let before = *robot;
        let refused = robot.validate().err();
        Grid::new("robot").num_columns(3).spacing([8.0, 3.0]).show(ui, |ui| {
            for (ModelParameter { key, name, unit, help, .. }, place) in ModelParameter::of_robot() {
                ui.label(*name).on_hover_text(*help);
                let field = number_ui(ui, place(robot), &format!("{name} value"), 64.0);
                field.on_hover_text(*help);
                ui.label(*unit);
                ui.end_row();
                problem_row_ui(ui, refused.as_ref(), key);
            }
        });
        if *robot != before && robot.validate().is_ok() {
            context.commands.send(Command::SetParameters(*robot));
        }
    }

    fn limit_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let before = self.torque_limit_nm;
        ui.horizontal(|ui| {
            let mut limited = self.torque_limit_nm.is_some();
            let help = "Torque limit of one motor; without it, the simulated motors are unlimited";
            if ui.checkbox(&mut limited, "torque limit").on_hover_text(help).changed() {
                self.torque_limit_nm = limited.then(|| FIRST_VALUES.torque_limit_nm);
            }
            if let Some(limit) = &mut self.torque_limit_nm {
                number_ui(ui, limit, "torque limit value", 64.0);
                ui.label("N m");
            }
        });
        let valid = self.torque_limit_nm.is_none_or(|limit| limit > 0.0);
        if !valid {
            error_ui(ui, "the torque limit must be above 0; the last valid value remains active");
        } else if self.torque_limit_nm != before {
            context.commands.send(Command::SetTorqueLimit(self.torque_limit_nm));
        }
    }

    fn friction_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let before = self.friction;
        Grid::new("friction").num_columns(3).spacing([6.0, 3.0]).show(ui, |ui| {
            ui.label("");
            for (motor, name) in MOTORS.into_iter().enumerate() {
                let mut present = self.friction[motor].is_some();
                let help = format!("Friction of the {name} motor");
                if ui.checkbox(&mut present, name).on_hover_text(help).changed() {
                    self.friction[motor] = present.then(|| FIRST_VALUES.curve);
                }
            }
            ui.end_row();
            for (ModelParameter { name, unit, help, .. }, place) in ModelParameter::of_motor_friction() {
                ui.label(*name).on_hover_text(format!("{help} [{unit}]"));
                for (motor, side) in MOTORS.into_iter().enumerate() {
                    match &mut self.friction[motor] {
                        Some(curve) => {
                            let accessible = format!("{name} friction {side}");
                            let field = number_ui(ui, place(curve), &accessible, 54.0);
                            field.on_hover_text(format!("{help}, {side} motor [{unit}]"));
                        }
                        None => {
                            ui.weak("–");
                        }
                    }
                }
                ui.end_row();
            }
        });
        hint_ui(ui, "N m, rad/s and N m s/rad");
        self.send_friction(context, ui, before);
    }

    fn send_friction(&self, context: &ViewContext<'_>, ui: &mut Ui, before: [Option<StribeckParameters>; 2]) {
        let curves = self.friction.map(|parameters| parameters.map(Stribeck::new));
        for (curve, side) in curves.iter().zip(MOTORS) {
            if let Some(Err(problem)) = curve {
                error_ui(ui, format!("{side} motor: {problem}; the last valid curve remains active"));
            }
        }
        let good = curves.iter().all(|curve| !matches!(curve, Some(Err(_))));
        if good && self.friction != before {
            context.commands.send(Command::SetFriction(curves.map(|curve| curve.and_then(Result::ok))));
        }
    }
}

/// The refusal, below the field that caused it.
fn problem_row_ui(ui: &mut Ui, refused: Option<&ParameterError>, key: &str) {
    let Some(problem) = refused.filter(|problem| problem.name == key) else { return };
    ui.label("");
    error_ui(ui, format!("must be {}", problem.allowed))
        .on_hover_text(format!("{problem}; the last valid value remains active"));
    ui.end_row();
}
