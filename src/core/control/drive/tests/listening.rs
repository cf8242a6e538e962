//! Samples of a robot that somebody else drives.

use std::time::Duration;

use super::rig::paper;
use crate::control::drive::Listener;
use crate::link::{ImuReading, MotorEvent, MotorState};
use crate::model::Motor;
use crate::record::Sample;

fn at(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn states(ms: u64, angle_rad: f64, current_a: f64) -> [MotorEvent; 2] {
    Motor::BOTH.map(|motor| {
        let state = MotorState { time: at(ms), angle_rad, speed_rad_s: 2.0, current_a, temperature_c: 30.0 };
        MotorEvent::State(motor, state)
    })
}

fn imu(ms: u64, pitch_rad: f64) -> ImuReading {
    let (tilt_rad, yaw_rate_rad_s, temperature_c) = (None, None, None);
    ImuReading { time: at(ms), pitch_rad, pitch_rate_rad_s: 0.5, tilt_rad, yaw_rate_rad_s, temperature_c }
}

fn asked(ms: u64, motor: Motor, current_a: f64) -> MotorEvent {
    MotorEvent::Commanded { motor, time: at(ms), command: 0xA1, current_a: Some(current_a) }
}

#[test]
fn samples_count_from_the_first_and_carry_what_was_heard() {
    let mut listener = Listener::new(&paper());
    assert_eq!(listener.hear(at(0), &[], &[imu(0, 0.1)]), None);
    let first = listener.hear(at(1), &states(1, 7.0, 1.0), &[]).unwrap();
    let Sample { x_m, motor_angle_left_rad, torque_left_nm, .. } = first;
    assert!(x_m.abs() < 1e-15 && (motor_angle_left_rad + 0.1).abs() < 1e-15, "{first:?}");
    assert_eq!(torque_left_nm, 0.32);
    let next = listener.hear(at(2), &states(2, 8.0, 1.0), &[imu(2, 0.1)]).unwrap();
    assert!((next.x_m - 0.055).abs() < 1e-12 && (next.x_dot_m_s - 0.055 * 2.5).abs() < 1e-12, "{next:?}");
    // Another controller's command counts more than what is measured, for 50 ms.
    let commands = [asked(3, Motor::Left, 2.0), states(3, 8.0, 1.0)[0], states(3, 8.0, 1.0)[1]];
    let next = listener.hear(at(3), &commands, &[]).unwrap();
    assert_eq!([next.torque_left_nm, next.torque_right_nm], [0.64, 0.32]);
    for ms in 4..60 {
        let sample = listener.hear(at(ms), &states(ms, 8.0, 1.0), &[imu(ms, 0.1)]).unwrap();
        assert_eq!(sample.torque_left_nm, if ms <= 53 { 0.64 } else { 0.32 }, "{ms}");
    }
}

#[test]
fn there_is_at_most_one_sample_a_millisecond_and_none_without_news() {
    let mut listener = Listener::new(&paper());
    let mut samples = 0;
    for step in 0..1000_u64 {
        let now = Duration::from_micros(250 * step);
        let motors = Motor::BOTH.map(|motor| {
            let MotorEvent::State(_, state) = states(0, 1.0, 0.0)[0] else { unreachable!() };
            MotorEvent::State(motor, MotorState { time: now, ..state })
        });
        samples += usize::from(listener.hear(now, &motors, &[]).is_some());
    }
    assert_eq!(samples, 250);
    assert_eq!(listener.hear(at(260), &[], &[]), None);
}

#[test]
fn a_sensor_that_falls_silent_leaves_a_gap() {
    for (imu_silent, motors_silent) in [(100..200, 0..0), (0..0, 100..200)] {
        let mut listener = Listener::new(&paper());
        let missing: Vec<u64> = (1..300)
            .filter(|&ms| {
                let motors = if motors_silent.contains(&ms) { vec![] } else { states(ms, 1.0, 0.0).to_vec() };
                let readings = if imu_silent.contains(&ms) { vec![] } else { vec![imu(ms, 0.0)] };
                listener.hear(at(ms), &motors, &readings).is_none()
            })
            .collect();
        assert_eq!(missing, (150..200).collect::<Vec<_>>());
    }
}
