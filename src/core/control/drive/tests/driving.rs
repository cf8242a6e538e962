//! The balancing robot under a drive.

use super::rig::{Rig, controller, paper};
use crate::control::drive::{Drive, DriveSettings, Excitation};
use crate::control::{ControllerKind, Measurement, Odometry, Reference};
use crate::model_file::RobotModel;
use crate::robot::State;
use crate::simulate::{Ground, SimulatedRobot, SimulationSettings, Statistics};

const PLAIN: DriveSettings = DriveSettings { latency_compensation: false, torque_scale_check: false };

/// Without pitch noise the robot counts exactly from where it stands.
fn calm() -> RobotModel {
    let mut robot = paper();
    robot.sensors.pitch_noise_rad = 0.0;
    robot
}

#[test]
fn without_compensation_it_is_the_simulated_loop_to_the_last_bit() {
    for (kind, seed) in [(ControllerKind::Lqr, 1), (ControllerKind::Flqr, 2)] {
        let robot = calm();
        let control = controller(&robot, kind);
        let drive = Drive::new(&robot, control.clone(), Excitation::Balance, PLAIN).unwrap();
        let mut rig = Rig::new(&robot, drive, false, false, seed);
        let armed = rig.arm();
        rig.run(5.0);
        let found = rig
            .outputs
            .iter()
            .filter_map(|(_, output)| output.sample)
            .skip_while(|sample| sample.time_s < armed as f64 / 1000.0);

        let settings = SimulationSettings { seed, ..SimulationSettings::default() };
        let mut twin = SimulatedRobot::on_ground(&robot, &settings, &[const { Ground::flat() }; 2]).unwrap();
        for tick in 0..armed {
            twin.read();
            let pitch_rad = (rig.hand)(1e-3 * (tick + 1) as f64);
            twin.hold([0.0; 2], &State { pitch_rad, ..State::default() });
        }
        let odometry = Odometry::new(&robot);
        let mut compared = 0;
        for sample in found {
            let measured = odometry.measurement(&twin.read());
            let asked = control.step(&measured, &Reference::default());
            assert_eq!(
                [sample.torque_left_nm, sample.torque_right_nm],
                asked,
                "{kind:?} at {}",
                sample.time_s
            );
            assert_eq!((sample.x_m, sample.pitch_rad), (measured.state.x_m, measured.state.pitch_rad));
            twin.advance(asked);
            compared += 1;
        }
        assert!(compared > 4900, "{compared}");
    }
}

/// Root mean squares of the errors of an estimate against the truth, in x, ẋ, θ, θ̇, mean motor speed.
fn errors(pairs: &[(Measurement, [f64; 5])]) -> [f64; 5] {
    let mut sums = [0.0; 5];
    for (estimate, truth) in pairs {
        let State { x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s } = estimate.state;
        let speed = f64::midpoint(estimate.motor_speed_rad_s[0], estimate.motor_speed_rad_s[1]);
        for ((sum, estimate), truth) in
            sums.iter_mut().zip([x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s, speed]).zip(truth)
        {
            *sum += (estimate - truth) * (estimate - truth);
        }
    }
    sums.map(|sum| (sum / pairs.len() as f64).sqrt())
}

fn truth(robot: &SimulatedRobot) -> [f64; 5] {
    let State { x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s } = robot.state();
    let [left, right] = robot.motor_speed_rad_s();
    [x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s, f64::midpoint(left, right)]
}

#[test]
fn explore() {
    for wire in [false, true] {
        for kind in [ControllerKind::Lqr, ControllerKind::Flqr] {
            for compensated in [false, true] {
                let robot = calm();
                let settings = DriveSettings { latency_compensation: compensated, ..PLAIN };
                let drive =
                    Drive::new(&robot, controller(&robot, kind), Excitation::Balance, settings).unwrap();
                let mut rig = Rig::new(&robot, drive, false, wire, 3);
                rig.arm();
                let delay = 4 - usize::from(wire);
                let (mut held, mut moved, mut truths) = (vec![], vec![], vec![]);
                for _ in 0..8000 {
                    rig.step(&[]);
                    // The step was at the tick before.
                    let now = std::time::Duration::from_millis(rig.tick - 1);
                    let readings = rig.drive.estimator.readings().unwrap();
                    held.push(rig.drive.estimator.held(&readings));
                    moved.push(rig.drive.estimator.at_action(now, &readings));
                    truths.push(truth(&rig.robot));
                }
                // truths[i] is the truth a tick after step i.
                let pair = |estimates: &[Measurement]| -> Vec<_> {
                    estimates.iter().copied().zip(truths[delay - 1..].iter().copied()).collect()
                };
                let (h, m) = (pair(&held), pair(&moved));
                println!("wire {wire} {kind:?} comp {compensated}: stage {:?}", rig.drive.stage());
                println!("  push  held {:.5?}\n       moved {:.5?}", errors(&h[..2000]), errors(&m[..2000]));
                println!("  quiet held {:.5?}\n       moved {:.5?}", errors(&h[4000..]), errors(&m[4000..]));
                let samples: Vec<_> = rig.outputs.iter().filter_map(|o| o.1.sample).skip(6000).collect();
                let s = Statistics::of(&samples).unwrap();
                println!("  std x {:.4} v {:.4} p {:.5}", s.x_m.std, s.x_dot_m_s.std, s.pitch_rad.std);
            }
        }
    }
}

#[test]
fn explore_scale() {
    for kind in [ControllerKind::Lqr, ControllerKind::Flqr] {
        for (payload, height) in [(0.0, 0.1), (3.9, 0.1), (3.9, 0.16), (3.9, 0.3), (-1.0, 0.0)] {
            for scale in [1.0, 1.986, 1.0 / 1.986, 2.53, 1.0 / 2.53] {
                let mut text = String::new();
                for seed in 1..4 {
                    let robot = paper();
                    let mut actual = robot.clone();
                    if payload > 0.0 {
                        actual.surroundings.payload = Some(crate::robot::Payload {
                            mass_kg: payload,
                            height_m: height,
                            forward_m: 0.0,
                        });
                    } else if payload < 0.0 {
                        actual.friction = [None; 2];
                    }
                    let drive = Drive::new(
                        &robot,
                        controller(&robot, kind),
                        Excitation::Balance,
                        DriveSettings::default(),
                    )
                    .unwrap();
                    let mut rig = Rig::new(&actual, drive, false, true, seed);
                    rig.torque_scale = scale;
                    rig.hand = |time| if time < 4.0 { super::rig::rock(time) } else { 0.03 };
                    let armed = rig.arm();
                    let stop = rig.run(8.0);
                    let est = rig
                        .drive
                        .torque_scale
                        .estimate()
                        .map(|e| format!("{:.2}±{:.2}", e.0, e.1))
                        .unwrap_or_default();
                    text += &format!(
                        " [{} {est}]",
                        stop.map_or("-".into(), |(t, r)| format!(
                            "{} {:.1}s",
                            r.name(),
                            t.as_secs_f64() - armed as f64 / 1e3
                        ))
                    );
                }
                println!("{kind:?} payload {payload} at {height} scale {scale:.3}:{text}");
            }
        }
    }
}
