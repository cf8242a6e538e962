use super::*;
use crate::control::ControllerKind;
use crate::friction::{Stribeck, StribeckParameters};
use crate::lqr;
use crate::model::{Actuation, Effect, MachineKind, MotorLimits, SensorSettings};
use crate::model_file::presets;
use crate::simulate::{Simulation, SimulationSettings};

const ONE_THREAD: NonZeroUsize = NonZeroUsize::MIN;

/// Robots about the paper's, under controllers that were made for the paper's; every third is FLQR, and
/// robot 5 starts too far over to be caught.
fn trials(count: usize) -> Vec<Trial> {
    let mut paper = presets::paper().robot().unwrap().clone();
    // Motors that only delay and ripple, whatever the preset says.
    paper.actuation = Actuation { delay_s: 0.004, torque_noise_nm: 0.02, torque_step_nm: 0.0 };
    paper.limits = MotorLimits {
        torque_nm: Some(2.42),
        torque_slew_nm_s: None,
        rated_speed_rad_s: None,
        no_load_speed_rad_s: None,
    };
    let gain = lqr::design(&paper.parameters.linear_model(), &paper.weights.unwrap()).unwrap().gain;
    let trial = |index: usize| {
        let part = |period: usize| (index % period) as f64 / period as f64 - 0.5;
        let mut robot = paper.clone();
        robot.parameters.body_mass_kg *= 1.0 + 0.04 * part(7);
        robot.parameters.com_height_m *= 1.0 + 0.02 * part(5);
        robot.friction = robot.friction.map(|curve| {
            let p = *curve.unwrap().parameters();
            let scale = 1.0 + 0.2 * part(9);
            let levels =
                StribeckParameters { coulomb_nm: scale * p.coulomb_nm, static_nm: scale * p.static_nm, ..p };
            Stribeck::new(levels).ok()
        });
        let kind = if index % 3 == 2 { ControllerKind::Flqr } else { ControllerKind::Lqr };
        let (pitch_rad, pitch_rate_rad_s) =
            if index == 5 { (0.7, 3.0) } else { (0.05 + 0.01 * part(4), 0.0) };
        Trial {
            controller: BalanceController::new(kind, &paper, gain).unwrap(),
            robot,
            initial: State { pitch_rad, pitch_rate_rad_s, ..State::default() },
            seed: index as u64,
        }
    };
    (0..count).map(trial).collect()
}

/// The same loop with one plant, and every state kept.
fn alone(trial: &Trial, ticks: usize) -> (Vec<State>, Option<f64>) {
    let Trial { robot, controller, initial, seed } = trial;
    let mut plant = PlanarPlant::new(&robot.parameters, robot.friction, initial);
    let mut noise = [0, 1].map(|motor| Noise::new(*seed, motor));
    let delay = (robot.actuation.delay_s / TICK_S).round() as usize;
    let mut asked = vec![[0.0; 2]; delay];
    let mut states = Vec::new();
    for tick in 0..ticks {
        states.push(plant.state());
        let motor_speed_rad_s = [plant.motor_speed_rad_s(); 2];
        let measurement = Measurement { state: plant.state(), motor_speed_rad_s, ..Measurement::default() };
        asked.push(controller.step(&measurement, &Reference::default()));
        let torque_nm =
            [0, 1].map(|motor| asked[tick][motor] + noise[motor].normal(robot.actuation.torque_noise_nm));
        plant.advance(&Forcing { torque_nm, ..Forcing::default() }, TICK_S, SUBSTEPS);
        if plant.state().pitch_rad.abs() > FALL_PITCH_RAD {
            return (states, Some((tick + 1) as f64 / 1000.0));
        }
    }
    (states, None)
}

#[test]
fn each_trial_is_the_loop_of_one_plant() {
    let trials = trials(11);
    let ticks = 2500;
    let outcomes = monte_carlo(&trials, 2.5, ONE_THREAD).unwrap();
    for (index, (trial, outcome)) in trials.iter().zip(&outcomes).enumerate() {
        let (states, fall) = alone(trial, ticks);
        assert_eq!(outcome.fall.map(|fall| fall.time_s), fall, "trial {index}");
        assert_eq!((outcome.statistics.fell, index == 5), (fall.is_some(), fall.is_some()), "trial {index}");
        let mut running = RunningStatistics::new(ticks as u64);
        states.iter().for_each(|state| running.push(state));
        assert_eq!(outcome.statistics, running.finish(fall.is_some()), "trial {index}");
    }
}

#[test]
fn outcomes_depend_neither_on_the_threads_nor_on_the_neighbours() {
    let trials = trials(70);
    let all = monte_carlo(&trials, 0.3, ONE_THREAD).unwrap();
    assert_eq!(monte_carlo(&trials, 0.3, NonZeroUsize::new(3).unwrap()).unwrap(), all);
    assert_eq!(monte_carlo(&trials[17..20], 0.3, ONE_THREAD).unwrap(), all[17..20]);
}

#[test]
fn seeds_and_noise_make_the_difference_between_equal_robots() {
    let [first, ..] = &trials(1)[..] else { unreachable!() };
    let other = Trial { seed: 99, ..first.clone() };
    let outcomes = monte_carlo(&[first.clone(), other, first.clone()], 1.0, ONE_THREAD).unwrap();
    assert_eq!(outcomes[0], outcomes[2]);
    assert_ne!(outcomes[0], outcomes[1]);
}

#[test]
fn what_cannot_run_is_refused_by_name() {
    let mut trials = trials(2);
    assert!(monte_carlo(&trials, 0.0, ONE_THREAD).unwrap_err().to_string().contains("seconds"));
    trials[1].robot.parameters.body_mass_kg = -1.0;
    assert!(monte_carlo(&trials, 1.0, ONE_THREAD).unwrap_err().to_string().contains("body_mass_kg"));
    assert_eq!(monte_carlo(&[], 1.0, ONE_THREAD).unwrap(), []);
}

/// A tether and cogging, as many robots at once and by the simulation that has all of the robot.
#[test]
fn effects_of_the_model_act_as_they_do_in_the_whole_robot() {
    let effect = |id: &str, parameters: &[(&str, f64)]| {
        Effect::new(id, MachineKind::Robot, None, parameters.iter().copied()).unwrap()
    };
    let effects = [
        effect("tether_spring", &[("stiffness_n_m", 12.0), ("pull_n", 2.0)]),
        effect("mass_error", &[("mass_kg", 1.5)]),
        effect("cogging", &[("order_1", 7.0), ("cos_1_nm", 0.05), ("sin_1_nm", 0.03)]),
    ];
    let plain = trials(3).remove(2);
    for effect in effects {
        let mut trial = plain.clone();
        trial.robot.effects = vec![effect.clone()];
        trial.robot.actuation.torque_noise_nm = 0.0;
        trial.robot.sensors = SensorSettings { imu_rate_hz: 1000.0, ..SensorSettings::default().exact() };
        let settings = SimulationSettings { initial: trial.initial, ..SimulationSettings::default() };
        let mut whole = Simulation::new(&trial.robot, trial.controller.clone(), settings).unwrap();
        let [found, without] = &monte_carlo(&[trial, plain.clone()], 3.0, ONE_THREAD).unwrap()[..] else {
            unreachable!()
        };
        let mut running = RunningStatistics::new(3000);
        for _ in 0..3000 {
            running.push(&whole.state());
            whole.step();
        }
        let expected = running.finish(false);
        let apart = (found.statistics.x_m.std / expected.x_m.std - 1.0).abs();
        assert!(apart < 0.02, "{}: {} for {}", effect.id(), found.statistics.x_m.std, expected.x_m.std);
        assert_ne!(found.statistics, without.statistics, "{}", effect.id());
    }
}
