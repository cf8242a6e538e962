//! The balancing robot under a drive.

use super::rig::{Rig, controller, in_hand, leans_forward, paper};
use crate::control::{
    ControllerKind, Measurement, Odometry, Reference,
    drive::{Drive, DriveSettings, Excitation, StopReason},
};
use crate::model::{Ground, Payload, RobotModel, State};
use crate::simulate::{SimulatedRobot, SimulationSettings};

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
            twin.hold([0.0; 2], &in_hand(rig.hand, tick + 1));
        }
        let odometry = Odometry::new(&robot);
        let mut compared = 0;
        for sample in found {
            let measured = odometry.measurement(&twin.read());
            // The torque limit rises from 0 within 0.2 s.
            let limit = 2.42 * (f64::from(compared + 1) / 200.0).min(1.0);
            let asked = control.step(&measured, &Reference::default()).map(|nm| nm.clamp(-limit, limit));
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

/// Readings brought to the time at which the torque acts are nearer to the truth of then than the newest readings are.
#[test]
fn latency_compensation_brings_the_estimate_nearer_to_the_truth() {
    for (kind, compensated) in [ControllerKind::Lqr, ControllerKind::Flqr].into_iter().zip([true, false]) {
        let robot = calm();
        let settings = DriveSettings { latency_compensation: compensated, ..PLAIN };
        let drive = Drive::new(&robot, controller(&robot, kind), Excitation::Balance, settings).unwrap();
        let mut rig = Rig::new(&robot, drive, false, true, 3);
        rig.arm();
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
        // truths[i] is the truth a tick after step i; the model's delay is 4 ticks, one of them on the wire.
        let against = |estimates: &[Measurement]| {
            let pairs: Vec<_> = estimates.iter().copied().zip(truths[2..].iter().copied()).collect();
            errors(&pairs[4000..])
        };
        let (held, moved) = (against(&held), against(&moved));
        for (index, most) in [0.2, 0.95, 0.7, 0.95, 1.05].into_iter().enumerate() {
            assert!(moved[index] < most * held[index], "{kind:?}: {moved:.5?} for {held:.5?}");
        }
    }
}

/// Payloads, and friction that the model has and the robot lacks, do not pass for a wrong scale; the other sources'
/// scale and the other winding do not pass for a payload.
#[test]
fn a_wrong_torque_scale_is_told_from_a_payload() {
    let payload = |height_m| Some(Payload { mass_kg: 3.9, height_m, forward_m: 0.0 });
    let edits: [&dyn Fn(&mut RobotModel); 5] = [
        &|_| {},
        &|robot| robot.surroundings.payload = payload(0.1),
        &|robot| robot.surroundings.payload = payload(0.16),
        &|robot| robot.surroundings.payload = payload(0.3),
        &|robot| robot.friction = [None; 2],
    ];
    for (kind, edit) in [ControllerKind::Lqr, ControllerKind::Flqr].iter().flat_map(|k| edits.map(|e| (k, e)))
    {
        for scale in [1.0, 1.986, 1.0 / 1.986, 2.53, 1.0 / 2.53] {
            let robot = paper();
            let mut actual = robot.clone();
            edit(&mut actual);
            let control = controller(&robot, *kind);
            let drive = Drive::new(&robot, control, Excitation::Balance, DriveSettings::default()).unwrap();
            let mut rig = Rig::new(&actual, drive, false, true, 1);
            rig.torque_scale = scale;
            rig.hand = leans_forward;
            rig.arm();
            let stop = rig.run(3.0).map(|(_, reason)| reason);
            match stop {
                None => assert_eq!(scale, 1.0, "{kind:?}"),
                Some(StopReason::TorqueScale { factor }) => {
                    assert!(
                        scale != 1.0 && (factor / scale).ln().abs() < 0.45,
                        "{kind:?} {factor} for {scale}"
                    );
                }
                Some(other) => panic!("{kind:?} {scale}: {other}"),
            }
        }
    }
}
