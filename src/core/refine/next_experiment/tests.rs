use std::ops::ControlFlow;

use super::*;
use crate::effects::{self};
use crate::model::{Effect, MachineKind, Model};
use crate::model_file::presets;
use crate::refine::verdict::{Channels, Errors, Quantity, Verdict};
use crate::simulate::{self, ControllerChoice, Experiment};

fn found(id: &str, parameters: &[(&str, f64)], rival: &str) -> Refinement {
    let effect = Effect::new(id, MachineKind::Robot, None, parameters.iter().copied()).unwrap();
    let mut model = presets::paper();
    if let Rig::Robot(robot) = &mut model.rig {
        robot.effects.push(effect.clone());
    }
    let floor = |name, value, unit| (name, Quantity::new(value, unit));
    let floors =
        vec![floor("combined", 0.3, "N"), floor("translation", 0.3, "N"), floor("pitch", 0.03, "N m")];
    let errors = Errors { noise_floor: Channels(floors), ..Errors::default() };
    let effect = Found {
        ci95: vec![None; effect.parameters().len()],
        units: vec!["1"; effect.parameters().len()],
        error_drop_percent: 50.0,
        error_drop_ci95: None,
        ambiguous_with: vec![effects::kind(rival).unwrap()],
        effect,
    };
    Refinement {
        verdict: Verdict::EffectsFound,
        effects: vec![effect],
        before: errors.clone(),
        after: errors,
        unexplained: Unexplained::default(),
        candidates: Vec::new(),
        closed_loop: None,
        next_experiment: None,
        data_health: Vec::new(),
        transfer: Vec::new(),
        parameters: Vec::new(),
        model,
        explorer: Default::default(),
        document: Default::default(),
    }
}

fn context(found: &Refinement, scenario: Scenario) -> NextExperiment {
    let experiment = Experiment { seconds: 12.0, ..Experiment::new(scenario, ControllerChoice::Flqr) };
    let watch = &mut |_| ControlFlow::Continue(());
    let log = simulate::run(&experiment, &presets::paper(), &found.model, watch).unwrap().log(Motor::Left);
    let context = Context { logs: &[log], motor: Motor::Left, seed: 1, file: "my robot.toml" };
    next_experiment(found, &context).unwrap()
}

/// A slope pulls at the ground alone: with the wheels in the air an asymmetry of the friction stays.
#[test]
fn slope_and_asymmetry_are_told_apart_by_a_run_that_can_be_started() {
    let found = found("ground_slope", &[("slope_rad", 0.01)], "friction_asymmetry");
    let next = context(&found, Scenario::Cruise);
    assert_eq!(next.separates, ["ground_slope", "friction_asymmetry"]);
    assert!(next.separation > WORTH, "{next:?}");
    let command = next.command.unwrap();
    assert!(command.starts_with("flqr simulate 'my robot.toml' --scenario "), "{command}");
    assert!(next.scenario.is_some_and(|scenario| command.contains(&scenario)));
    assert!(command.contains(" --seed 1 ") && !command.contains("--motor"), "{command}");
}

#[test]
fn a_load_that_swings_is_not_asked_to_turn_at_a_constant_speed() {
    let model = |gravity: &str| {
        let text = format!(
            "name = \"arm\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.03\n{gravity}[friction]\n\
             coulomb_nm = 0.1\nviscous_nm_s_rad = 0.01\n"
        );
        Model::from_toml(&text, "arm.toml").unwrap()
    };
    let scenarios =
        |model: &Model| -> Vec<Scenario> { runs(model).iter().map(|run| run.experiment.scenario).collect() };
    assert_eq!(scenarios(&model("gravity_torque_nm = 1.5\n")), [Scenario::Multisine]);
    assert_eq!(scenarios(&model("")).len(), 5);
}

#[test]
fn a_command_names_the_motor_of_the_right_wheel_and_a_word_for_a_file_without_a_name() {
    let model = presets::paper();
    let context = Context { logs: &[], motor: Motor::Right, seed: 7, file: "" };
    let commands: Vec<String> = runs(&model).iter().map(|run| run.command(&model, &context)).collect();
    let sweep =
        "flqr simulate MODEL --scenario friction-sweep --controller pi --seconds 120 --seed 7 --motor right";
    assert_eq!(commands[0], format!("{sweep} --log next.csv"));
    let still = commands.iter().find(|command| command.contains("station")).unwrap();
    assert!(!still.contains("--motor"), "{still}");
}

/// Nothing that a robot can do tells a lag of the IMU: there is no force to compare.
#[test]
fn what_no_run_tells_apart_is_told_in_words() {
    let found = found("command_delay", &[("delay_s", 0.004)], "imu_delay");
    let next = context(&found, Scenario::Station);
    assert!(next.command.is_none() && next.summary.contains("30 Hz"), "{next:?}");
}
