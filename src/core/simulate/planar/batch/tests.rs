use super::*;
use crate::friction::{Stribeck, StribeckParameters};
use crate::model::{RobotParameters, State};

/// Robots that differ in everything: every fifth without any friction, every seventh without a level at standstill.
fn robots(count: usize) -> Vec<PlanarPlant> {
    let robot = |index: usize| {
        let part = |period: usize| (index % period) as f64 / period as f64;
        let parameters = RobotParameters {
            body_mass_kg: 12.0 + part(11),
            wheel_mass_kg: 1.2 - 0.1 * part(3),
            wheel_inertia_kg_m2: 0.0025 + 0.001 * part(4),
            wheel_radius_m: 0.065 + 0.01 * part(5),
            com_height_m: 0.12 + 0.05 * part(9),
            body_inertia_kg_m2: 0.12 + 0.03 * part(2),
            gravity_m_s2: 9.81,
        };
        let friction = |coulomb_nm: f64, stribeck_speed_rad_s| {
            let levels = if index % 7 == 6 { 0.0 } else { 1.0 };
            Stribeck::new(StribeckParameters {
                coulomb_nm: coulomb_nm * (1.0 + part(6)),
                static_nm: levels * 0.07 * (1.0 + part(8)),
                viscous_nm_s_rad: 4.9e-4,
                stribeck_speed_rad_s,
                stribeck_exponent: 0.2 + 0.3 * part(10),
                offset_nm: 0.003 * part(3),
            })
            .ok()
            .filter(|_| index % 5 != 4)
        };
        let start =
            State { pitch_rad: 0.04 * (part(13) - 0.5), x_dot_m_s: 0.1 * part(2), ..State::default() };
        PlanarPlant::new(&parameters, [friction(0.0338, 1.6), friction(0.0406, 2.3)], &start)
    };
    (0..count).map(robot).collect()
}

/// State feedback and an excitation with its own phase for each robot, and a push now and then.
fn forcing(index: usize, tick: u32, state: &State) -> Forcing {
    let torque_nm = -0.5
        * (-1.3 * state.x_m - 2.2 * state.x_dot_m_s - 17.0 * state.pitch_rad - 2.0 * state.pitch_rate_rad_s
            + 0.4 * (0.025 * f64::from(tick) + index as f64).sin());
    let push_n = if (tick / 100 + index as u32).is_multiple_of(9) { 3.0 } else { 0.0 };
    Forcing { torque_nm: [torque_nm; 2], push_n, push_height_m: 0.1 }
}

fn bits(plant: &PlanarPlant) -> [u64; 4] {
    plant.state().to_vector().map(f64::to_bits).into()
}

/// Paths for 2 s: all bits of the motion at every tick; and the number of changes between phases.
fn paths(count: usize, advance: impl Fn(&mut [PlanarPlant], &[Forcing])) -> (Vec<[u64; 4]>, usize) {
    let mut plants = robots(count);
    let mut path = Vec::new();
    let mut changes = 0;
    for tick in 0..2000 {
        let forcings: Vec<_> =
            plants.iter().enumerate().map(|(index, plant)| forcing(index, tick, &plant.state())).collect();
        let before: Vec<_> = plants.iter().map(|plant| plant.phase).collect();
        advance(&mut plants, &forcings);
        changes += plants.iter().zip(before).filter(|(plant, before)| plant.phase != *before).count();
        path.extend(plants.iter().map(bits));
    }
    (path, changes)
}

#[test]
fn a_robot_takes_the_same_path_to_the_last_bit_in_a_batch_as_alone() {
    for count in [1, 2, 7, 8, 19] {
        let alone = paths(count, |plants, forcings| {
            for (plant, forcing) in plants.iter_mut().zip(forcings) {
                plant.advance(forcing, 1e-3, 10);
            }
        });
        assert!(alone.1 >= 7 * count, "{} changes of {count} robots", alone.1);
        let batch = paths(count, |plants, forcings| advance_batch(plants, forcings, 1e-3, 10));
        assert_eq!(batch, alone, "{count} robots");
        let narrow = paths(count, |plants, forcings| {
            advance_batch_on(pulp::Arch::Scalar, plants, forcings, 1e-3, 10);
        });
        assert_eq!(narrow, alone, "{count} robots");
    }
}

/// Both vector widths of x86, where the processor has them.
#[cfg(target_arch = "x86_64")]
#[test]
fn every_width_of_vectors_gives_the_same_path() {
    let on =
        |arch: pulp::Arch| paths(19, |plants, forcings| advance_batch_on(arch, plants, forcings, 1e-3, 10));
    let narrow = on(pulp::Arch::Scalar);
    if let Some(simd) = pulp::x86::V3::try_new() {
        assert_eq!(on(pulp::Arch::V3(simd)), narrow);
    }
    if let Some(simd) = pulp::x86::V4::try_new() {
        assert_eq!(on(pulp::Arch::V4(simd)), narrow);
    }
}

#[test]
fn a_robot_that_tumbles_or_is_no_number_leaves_its_neighbours_alone() {
    let mut plants = robots(8);
    let tumbling = State { pitch_rate_rad_s: 60.0, ..State::default() };
    let nothing = State { pitch_rad: f64::NAN, ..State::default() };
    for (lane, state) in [(2, tumbling), (5, nothing)] {
        plants[lane].motion.pitch = state.pitch_rad;
        plants[lane].motion.pitch_rate = state.pitch_rate_rad_s;
    }
    let mut alone = plants.clone();
    for _ in 0..300 {
        advance_batch(&mut plants, &[Forcing::default(); 8], 1e-3, 4);
        for plant in &mut alone {
            plant.advance(&Forcing::default(), 1e-3, 4);
        }
    }
    for (lane, (plant, alone)) in plants.iter().zip(&alone).enumerate() {
        assert!(lane == 5 || bits(plant) == bits(alone), "robot {lane}");
    }
    let [tumbled, nothing] = [2, 5].map(|lane| plants[lane].state().pitch_rad);
    assert!(tumbled.abs() > 3.0 && nothing.is_nan(), "{tumbled} {nothing}");
}
