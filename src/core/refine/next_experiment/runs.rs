//! The runs that a machine can do, each with the command that starts it.

use super::Context;
use crate::model::{AxisParameters, Model, Motor, Payload, Rig};
use crate::simulate::{ControllerChoice, Experiment, Scenario};

/// Length of a run, s.
const SECONDS: f64 = 30.0;
/// Load that is put on a body, as a fraction of it.
const LOAD: f64 = 0.15;

/// A run that a machine can do.
pub(super) struct Run {
    pub(super) words: &'static str,
    pub(super) experiment: Experiment,
    flags: String,
}

impl Run {
    pub(super) fn command(&self, model: &Model, context: &Context<'_>) -> String {
        let Experiment { scenario, controller, seconds, .. } = &self.experiment;
        let file = match context.file {
            "" => "MODEL".to_owned(),
            plain if plain.chars().all(|c| c.is_ascii_alphanumeric() || "/._-+=".contains(c)) => {
                plain.to_owned()
            }
            spaced => format!("'{}'", spaced.replace('\'', "'\\''")),
        };
        let controller = controller.name();
        // On the ground a log holds both motors.
        let of_right =
            context.motor == Motor::Right && model.robot().is_some() && !self.experiment.on_ground();
        let motor = if of_right { " --motor right" } else { "" };
        format!(
            "flqr simulate {file} --scenario {scenario} --controller {controller} --seconds {seconds}{} --seed {}{motor} --log next.csv",
            self.flags, context.seed
        )
    }
}

/// Runs that the simulated machine can do; none for a carriage.
pub(super) fn runs(model: &Model) -> Vec<Run> {
    let run = |words, scenario, controller| {
        let experiment = Experiment::new(scenario, controller);
        let seconds = if scenario == Scenario::FrictionSweep { 120.0 } else { SECONDS };
        Run { words, experiment: Experiment { seconds, ..experiment }, flags: String::new() }
    };
    let air = |words, scenario| run(words, scenario, ControllerChoice::Pi);
    let turning = |words, target_speed_rad_s: f64| {
        let plain = air(words, Scenario::SpeedTracking);
        let flags = format!(" --target-speed {target_speed_rad_s}");
        Run { experiment: Experiment { target_speed_rad_s, ..plain.experiment.clone() }, flags, ..plain }
    };
    let mut found = vec![
        air("wheels in the air at 33 constant speeds in both directions", Scenario::FrictionSweep),
        air("wheels in the air with multisine torques", Scenario::Multisine),
        turning("one wheel in the air, slowly forward", 1.0),
        turning("one wheel in the air, slowly backward", -1.0),
        turning("one wheel in the air, fast", 20.0),
    ];
    match &model.rig {
        Rig::Axis(axis) => {
            match axis.parameters {
                AxisParameters::Linear { .. } => found.clear(),
                // A load that swings cannot turn at a constant speed.
                AxisParameters::Rotary { gravity_torque_nm, .. } if gravity_torque_nm != 0.0 => {
                    found.retain(|run| run.experiment.scenario == Scenario::Multisine);
                    found
                        .iter_mut()
                        .for_each(|run| run.words = "multisine torques around the hanging equilibrium");
                    return found;
                }
                AxisParameters::Rotary { .. } => {}
            }
            for (run, words) in found.iter_mut().zip([
                "33 constant speeds in both directions",
                "multisine torques",
                "slowly forward",
                "slowly backward",
                "fast forward",
            ]) {
                run.words = words;
            }
        }
        Rig::Robot(robot) if robot.weights.is_some() => {
            let fed = robot.friction.iter().any(Option::is_some);
            let controller = if fed { ControllerChoice::Flqr } else { ControllerChoice::Lqr };
            let ground = |words, scenario| run(words, scenario, controller);
            let scaled = |words, torque_scale: f64| {
                let plain = ground(words, Scenario::Multisine);
                let flags = format!(" --torque-scale {torque_scale}");
                Run { experiment: Experiment { torque_scale, ..plain.experiment.clone() }, flags, ..plain }
            };
            let sloped = |words, slope_rad: f64| {
                let plain = ground(words, Scenario::Cruise);
                let flags = format!(" --slope {slope_rad}");
                Run { experiment: Experiment { slope_rad, ..plain.experiment.clone() }, flags, ..plain }
            };
            let loaded = |words, scenario| {
                let plain = ground(words, scenario);
                // As it is written in the command.
                let mass_kg = (10.0 * LOAD * robot.parameters.body_mass_kg).round() / 10.0;
                let height_m = robot.parameters.com_height_m;
                let payload = Some(Payload { mass_kg, height_m, forward_m: 0.0 });
                let flags = format!(" --payload {mass_kg}");
                Run { experiment: Experiment { payload, ..plain.experiment.clone() }, flags, ..plain }
            };
            found.extend([
                ground("standing still", Scenario::Station),
                ground("driving out and back", Scenario::Cruise),
                sloped("driving out and back up a slope", 0.05),
                sloped("driving out and back down a slope", -0.05),
                loaded("driving out and back with a payload", Scenario::Cruise),
                ground("multisine torques while balancing", Scenario::Multisine),
                scaled("multisine torques twice as large while balancing", 2.0),
                scaled("multisine torques four times larger while balancing", 4.0),
                loaded("multisine torques while balancing, with a payload", Scenario::Multisine),
            ]);
        }
        Rig::Robot(_) => {}
    }
    found
}
