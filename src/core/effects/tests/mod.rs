//! Every kind at once: what all of them must do.

use super::*;
use crate::model::{AxisModel, AxisParameters, Effect, MachineKind, Model, Motor, Rig, RobotParameters};
use crate::model_file::presets;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MACHINES: [MachineKind; 3] = [MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];

fn machine(kind: MachineKind) -> Machine {
    let parameters = RobotParameters {
        body_mass_kg: 13.0,
        wheel_mass_kg: 1.0,
        wheel_inertia_kg_m2: 0.005,
        wheel_radius_m: 0.1,
        com_height_m: 0.25,
        body_inertia_kg_m2: 0.25,
        gravity_m_s2: 9.81,
    };
    Machine { kind, parameters }
}

/// Every kind on every machine that it can be on.
fn everywhere() -> impl Iterator<Item = (&'static EffectKind, MachineKind)> {
    KINDS
        .iter()
        .flat_map(|&kind| MACHINES.map(|machine| (kind, machine)))
        .filter(|(kind, on)| kind.is_on(*on))
}

/// A value within a range, more often small than large.
fn inside([lowest, highest]: [f64; 2], rng: &mut ChaCha8Rng) -> f64 {
    let share: f64 = rng.random_range(0.0..1.0);
    lowest + (highest - lowest) * share
}

/// Shape parameters of `members` members and amplitudes, drawn from their ranges.
fn drawn(kind: &EffectKind, on: MachineKind, members: usize, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
    let (mut shape, mut sizes) = (Vec::new(), Vec::new());
    for _ in 0..if kind.series() { members } else { 1 } {
        for parameter in kind.parameters {
            let value = inside(parameter.range(on), rng);
            let value = if parameter.whole && on != MachineKind::Linear { value.round() } else { value };
            if parameter.role == Role::Shape { shape.push(value) } else { sizes.push(value) }
        }
    }
    (shape, sizes)
}

fn moments(count: usize, rng: &mut ChaCha8Rng) -> Vec<MotionSample> {
    let mut draw = |size: f64| rng.random_range(-size..size);
    (0..count)
        .map(|tick| MotionSample {
            time_s: tick as f64 * 1e-3,
            dt_s: 1e-3,
            motor_angle_rad: draw(100.0),
            motor_speed_rad_s: draw(30.0),
            motor_accel_rad_s2: draw(300.0),
            torque_nm: draw(2.0),
            torque_sum_nm: draw(4.0),
            x_m: draw(2.0),
            x_dot_m_s: draw(2.0),
            x_accel_m_s2: draw(5.0),
            pitch_rad: draw(0.3),
            pitch_rate_rad_s: draw(1.0),
            pitch_accel_rad_s2: draw(10.0),
        })
        .collect()
}

fn actions(law: &mut dyn Law, moments: &[MotionSample]) -> Vec<Action> {
    moments.iter().map(|moment| law.act(moment)).collect()
}

#[test]
fn ids_are_unique_and_every_kind_tells_about_itself() {
    for (at, kind) in KINDS.iter().enumerate() {
        assert!(KINDS[..at].iter().all(|other| other.id != kind.id), "{}", kind.id);
        assert!(kind.id.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{}", kind.id);
        assert!(kind.summary.len() > 20 && kind.separated_by.len() > 10, "{}", kind.id);
        assert!(!kind.machines.is_empty() && !kind.parameters.is_empty(), "{}", kind.id);
        assert_eq!(super::kind(kind.id), Some(*kind));
        if let Feedforward::Never(reason) = kind.feedforward {
            assert!(reason.len() > 10, "{}", kind.id);
        }
        let numbered = kind.parameters.iter().all(|p| MACHINES.iter().all(|&on| p.key(on).contains('#')));
        assert_eq!(numbered, kind.series(), "{}", kind.id);
    }
}

#[test]
fn terms_answer_to_the_amplitudes_in_their_order() {
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    for (kind, on) in everywhere() {
        let (shape, sizes) = drawn(kind, on, 3, rng);
        let terms = kind.terms(&machine(on), &shape);
        let effect = Effect::estimated(kind, on, None, &shape, &sizes).unwrap();
        let keys: Vec<&str> = terms.iter().filter_map(|term| term.amplitude.as_deref()).collect();
        let given: Vec<f64> = keys.iter().map(|key| effect.get(key).unwrap()).collect();
        if kind.place == Place::Sensor {
            assert!(terms.is_empty(), "{}", kind.id);
            continue;
        }
        assert_eq!(given, sizes, "{} on {on:?}", kind.id);
        assert_eq!(effect.values(Role::Shape), shape, "{}", kind.id);
        // Where there is nothing to multiply, the law is there all the same.
        assert!(terms.len() > keys.len() || !keys.is_empty(), "{}", kind.id);
    }
}

#[test]
fn laws_are_finite_and_linear_in_their_amplitudes() {
    let rng = &mut ChaCha8Rng::seed_from_u64(2);
    for (kind, on) in everywhere() {
        for _ in 0..5 {
            let (shape, sizes) = drawn(kind, on, 2, rng);
            let moments = moments(200, rng);
            let machine = machine(on);
            let effect = Effect::estimated(kind, on, None, &shape, &sizes).unwrap();
            let whole = actions(&mut effect.law(&machine), &moments);
            assert!(whole.iter().all(Action::is_finite), "{effect:?}");
            assert_eq!(whole, actions(&mut effect.law(&machine), &moments), "{effect:?} is not repeatable");
            let mut sum = vec![Action::default(); moments.len()];
            let mut amplitudes = sizes.iter();
            for mut term in kind.terms(&machine, &shape) {
                let size = term.amplitude.as_ref().map_or(1.0, |_| *amplitudes.next().unwrap());
                for (sum, column) in sum.iter_mut().zip(actions(&mut *term.law, &moments)) {
                    *sum = sum.plus(size, &column);
                }
            }
            assert_eq!(sum, whole, "{effect:?}");
        }
    }
}

#[test]
fn a_copy_of_a_law_goes_on_with_its_memory() {
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    for (kind, on) in everywhere() {
        let (shape, sizes) = drawn(kind, on, 2, rng);
        let moments = moments(60, rng);
        let mut law = Effect::estimated(kind, on, None, &shape, &sizes).unwrap().law(&machine(on));
        actions(&mut law, &moments[..30]);
        let mut copy = law.clone();
        assert_eq!(actions(&mut law, &moments[30..]), actions(&mut copy, &moments[30..]), "{}", kind.id);
    }
}

#[test]
fn every_key_names_its_unit() {
    for (kind, on) in everywhere() {
        for parameter in kind.parameters {
            let (key, unit) = (parameter.key(on), parameter.unit(on));
            let pure = parameter.role == Role::Shape && key.starts_with("order")
                || ["cos_#", "sin_#", "gain", "coefficient", "fraction", "damping_ratio"].contains(&key);
            assert_eq!(unit == "1" || key.starts_with("order"), pure, "{}: {key} has unit {unit}", kind.id);
            let rotary = [" m", "N"].iter().any(|part| unit.contains(part)) || !unit.contains("rad");
            assert!(on != MachineKind::Linear || rotary, "{}: {key} [{unit}] on a linear axis", kind.id);
            let [lowest, highest] = parameter.range(on);
            assert!(lowest < highest && lowest.is_finite() && highest.is_finite(), "{}: {key}", kind.id);
            assert!(parameter.description.len() > 5, "{}: {key}", kind.id);
        }
    }
}

#[test]
fn every_kind_survives_the_round_trip_through_a_model_file() {
    let rng = &mut ChaCha8Rng::seed_from_u64(6);
    for (kind, on) in everywhere().filter(|(kind, _)| kind.feedforward != Feedforward::Declared) {
        let (shape, sizes) = drawn(kind, on, 3, rng);
        let on_one = kind.per_motor() && on == MachineKind::Robot;
        for motor in [None, on_one.then_some(Motor::Left), on_one.then_some(Motor::Right)] {
            let effect = Effect::estimated(kind, on, motor, &shape, &sizes).unwrap();
            let mut model = presets::paper();
            let axis = |parameters| AxisModel { effects: vec![effect.clone()], ..AxisModel::new(parameters) };
            match (&mut model.rig, on) {
                (Rig::Robot(robot), MachineKind::Robot) => robot.effects.push(effect.clone()),
                (rig, MachineKind::Linear) => {
                    *rig = Rig::Axis(axis(AxisParameters::Linear { mass_kg: 95.0, friction: None }));
                }
                (rig, _) => {
                    let parameters = AxisParameters::Rotary {
                        inertia_kg_m2: 0.01,
                        gravity_torque_nm: 0.0,
                        friction: None,
                    };
                    *rig = Rig::Axis(axis(parameters));
                }
            }
            let text = model.to_toml();
            assert_eq!(Model::from_toml(&text, "again").unwrap(), model, "{text}");
        }
    }
}

#[test]
fn the_manual_lists_every_kind_with_its_parameters() {
    let manual = include_str!("../../../../assets/manual/files.md");
    for kind in KINDS {
        let start = format!("| `{}` | {} | ", kind.id, kind.summary.replace('|', "\\|"));
        let row = manual.lines().find_map(|line| line.strip_prefix(&*start));
        let row = row.unwrap_or_else(|| panic!("the manual has no row {start}"));
        for (parameter, &on) in
            kind.parameters.iter().flat_map(|p| kind.machines.iter().map(move |on| (p, on)))
        {
            let key = format!("`{}`", parameter.key(on).replace('#', "1"));
            assert!(row.contains(&key), "{}: {key} is not in {row}", kind.id);
        }
        let fed = match kind.feedforward {
            Feedforward::Causal => "| yes |",
            Feedforward::Declared => "| by the parameter |",
            Feedforward::Never(_) => "| no |",
        };
        assert!(row.ends_with(fed), "{}: {row}", kind.id);
    }
}

#[test]
fn values_that_no_machine_has_are_refused_with_the_mend() {
    let robot = MachineKind::Robot;
    let cogging = [("order_1", 14.0), ("cos_1_nm", 0.01), ("sin_1_nm", 0.0)];
    let with = |key: &'static str, value: f64| {
        let others = cogging.into_iter().filter(move |&(other, _)| other != key);
        others.chain([(key, value)]).collect::<Vec<_>>()
    };
    for (id, motor, parameters, key, part) in [
        ("coging", None, cogging.to_vec(), Some("id"), "use one of cogging, torque_ripple"),
        ("cogging", None, with("order_1", 1.5), Some("order_1"), "whole number"),
        ("cogging", None, with("order_1", 0.0), Some("order_1"), "from 1 to 20000"),
        ("cogging", None, with("cos_1_nm", f64::NAN), Some("cos_1_nm"), "out of range"),
        ("cogging", None, with("cos_1", 0.1), Some("cos_1"), "use order_1, cos_1_nm, sin_1_nm and so on"),
        ("cogging", None, with("order_2", 2.0), None, "lacks cos_2_nm"),
        ("cogging", None, with("order_99999999999", 2.0), Some("order_99999999999"), "no parameter"),
    ] {
        let error = Effect::new(id, robot, motor, parameters).unwrap_err();
        assert!(error.key.as_deref() == key && error.problem.contains(part), "{error:?}");
    }
    assert!(Effect::new("cogging", MachineKind::Linear, None, cogging).is_err());
}

mod bench;
mod feedforward;
mod robot;

#[test]
fn an_effect_that_is_turned_is_the_same_at_angles_that_count_from_elsewhere() {
    let rng = &mut ChaCha8Rng::seed_from_u64(8);
    for (kind, on) in everywhere().filter(|(kind, on)| kind.series() && *on != MachineKind::Linear) {
        let (shape, sizes) = drawn(kind, on, 3, rng);
        let effect = Effect::estimated(kind, on, None, &shape, &sizes).unwrap();
        for turn_rad in [-2.0, 0.0, 0.3] {
            let moments = moments(50, rng);
            let elsewhere = |moment: &MotionSample| MotionSample {
                motor_angle_rad: moment.motor_angle_rad + turn_rad,
                ..*moment
            };
            let shifted: Vec<MotionSample> = moments.iter().map(elsewhere).collect();
            let mut turned = effect.turned(turn_rad).law(&machine(on));
            let mut law = effect.law(&machine(on));
            let size = sizes.iter().map(|size| size.abs()).sum::<f64>();
            for (moment, shifted) in moments.iter().zip(&shifted) {
                let off = turned.act(moment).plus(-1.0, &law.act(shifted));
                // Orders up to 20,000 make much of the last digit of an angle.
                assert!(off.motor_nm.abs() + off.friction_nm.abs() < 1e-8 * size, "{} {off:?}", kind.id);
            }
        }
    }
}
