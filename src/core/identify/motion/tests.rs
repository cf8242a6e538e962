use super::*;
use crate::identify::test_data::Noise;
use crate::shared::shared_log;

fn fit(logs: &[Log], axis: Axis, known: Option<&KnownAxis>, estimate: &[&str]) -> MotionFit {
    let names: Vec<String> = estimate.iter().map(|name| (*name).to_owned()).collect();
    fit_motion(logs, axis, known, &names, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Published: M 95.1089 kg, Fv 203.5034 N s/m, Fc 20.3935 N, OF −3.1648 N (A. Janot, M. Gautier, M. Brunot,
/// "Data Set and Reference Models of EMPS", 2019), relative error 4.03 to 4.07 % by the same procedure.
#[test]
fn published_values_of_the_positioning_system_are_found() {
    let Some(log) = shared_log("emps/emps_standard.csv", &[]) else { return };
    let found = fit(&[log], Axis::Linear, None, &["all"]);
    for (key, published, tolerance) in [
        ("mass_kg", 95.1089, 0.0005 * 95.1),
        ("viscous_n_s_m", 203.5034, 0.002 * 203.5),
        ("coulomb_n", 20.3935, 0.002 * 20.4),
        ("offset_n", -3.1648, 0.02),
    ] {
        let parameter = found.parameter(key).unwrap();
        assert!((parameter.value - published).abs() < tolerance, "{parameter:?} for {published}");
        let [lower, upper] = parameter.ci95.unwrap();
        assert!(lower < published && published < upper, "{parameter:?} for {published}");
    }
    assert!((0.0400..0.0415).contains(&found.relative_error), "{found:?}");
    assert_eq!((found.warnings, found.rmse_unit), (vec![], "N"));
}

/// The sliding friction that the simulated bench declares (Eq. 28), with its sticking stretches left out.
#[test]
fn a_bench_with_stribeck_friction_gives_back_its_declared_curve() {
    let Some(log) = shared_log("undeclared/example-bench/log.csv", &[]) else { return };
    let known = KnownAxis { inertia: 0.004, friction: Some(PAPER_LEFT), gravity_torque_nm: 0.0 };
    let found = fit(&[log], Axis::Rotary, Some(&known), &[]);
    for (key, declared) in [
        ("viscous_nm_s_rad", PAPER_LEFT.viscous_nm_s_rad),
        ("coulomb_nm", PAPER_LEFT.coulomb_nm),
        ("offset_nm", PAPER_LEFT.offset_nm),
    ] {
        let [lower, upper] = found.parameter(key).unwrap().ci95.unwrap();
        assert!(lower < declared && declared < upper, "{key}: {lower} to {upper} for {declared}");
    }
    // The cogging that the model lacks follows the acceleration a little.
    assert!((found.parameter("inertia_kg_m2").unwrap().value / 0.005 - 1.0).abs() < 0.07, "{found:?}");
    assert!(found.parameter("static_nm").unwrap().held);
}

/// Weight and arm of 0.150 m on a geared motor: inertia about the shaft from its parts, the rotor's part
/// published as 0.0109 kg m² with a torque scale of 0.912.
#[test]
fn measured_pendulums_give_weight_and_inertia_in_proportion() {
    let map = ["motor_angle_rad=angle_rad", "torque_nm=torque_nm*6.33"];
    let mut found = Vec::new();
    for mass in [1.0, 3.0] {
        let name = format!("go1_pendulum/go1_m{mass}kg_sin_sin.csv");
        let Some(log) = shared_log(&name, &map) else { return };
        let gravity_torque_nm = (mass + 0.039) * 9.81 * 0.15;
        let known = KnownAxis { inertia: 0.01, friction: None, gravity_torque_nm };
        let free = fit(&[log], Axis::Rotary, Some(&known), &["all", "gravity_torque_nm"]);
        let gravity = free.parameter("gravity_torque_nm").unwrap().value;
        assert!((gravity / gravity_torque_nm - 1.0).abs() < 0.13, "{gravity} for {gravity_torque_nm}");
        assert!(free.relative_error < 0.035, "{free:?}");
        found.push((gravity, free.parameter("inertia_kg_m2").unwrap().value));
    }
    let lever = (found[1].1 - found[0].1) / (found[1].0 - found[0].0) * 9.81;
    assert!((lever / 0.15 - 1.0).abs() < 0.15, "length of the arm {lever} m");
}

/// Clock that jitters between 0.2 and 7 ms; without a published value the two halves must agree.
#[test]
fn both_halves_of_a_jittered_log_give_the_same_motor() {
    let map = ["motor_angle_rad=angle_rad", "torque_nm=current_a"];
    let Some(log) = shared_log("laas_bldc/acc_current.csv", &map) else { return };
    let half = |from: usize, to: usize| {
        let columns = log.columns.iter();
        Log::from_columns("half", columns.map(|c| (c.name.clone(), c.values[from..to].to_vec())))
    };
    let (middle, end) = (log.rows() / 2, log.rows());
    let parts = [half(0, middle), half(middle, end)].map(|part| fit(&[part], Axis::Rotary, None, &[]));
    for (key, tolerance) in [("inertia_kg_m2", 0.01), ("coulomb_nm", 0.02), ("viscous_nm_s_rad", 0.1)] {
        let [first, second] = [0, 1].map(|part: usize| parts[part].parameter(key).unwrap().value);
        assert!((first / second - 1.0).abs() < tolerance, "{key}: {first} and {second}");
    }
}

/// A shaft that spins steadily: its inertia, 0.19 mA s²/rad by the log above, is not told, and is not told wrongly.
#[test]
fn a_steady_spin_with_a_jittered_clock_leaves_the_inertia_out() {
    let map = ["motor_angle_rad=angle_rad", "torque_nm=current_a"];
    let Some(log) = shared_log("laas_bldc/rolling_data1.csv", &map) else { return };
    let found = fit(&[log], Axis::Rotary, None, &[]);
    assert_eq!(found.parameter("inertia_kg_m2"), None, "{found:#?}");
    assert!(found.warnings.iter().any(|warning| warning.contains("small and noisy")), "{found:#?}");
}

/// Left motor of the paper's Table 4.
const PAPER_LEFT: StribeckParameters = StribeckParameters {
    coulomb_nm: 0.0338,
    static_nm: 0.0761,
    viscous_nm_s_rad: 4.9e-4,
    stribeck_speed_rad_s: 1.612,
    stribeck_exponent: 0.231,
    offset_nm: -0.0016,
};

/// Rows that come in pairs 1 µs apart: a usual step that says nothing of the number of rows.
#[test]
fn a_clock_in_bursts_needs_no_more_samples_than_a_few_for_each_row() {
    let plant = Plant { rate_hz: 500.0, ..SHAFT };
    let [time, angle, torque] = plant.run();
    for burst in [2, 3] {
        let repeat = |values: &[f64], later: f64| -> Vec<f64> {
            let copies = |value: &f64| (0..burst).map(|n| value + later * f64::from(n)).collect::<Vec<_>>();
            values.iter().flat_map(copies).collect()
        };
        let columns = [repeat(&time, 1e-6), repeat(&angle, 0.0), repeat(&torque, 0.0)];
        let [time, angle, torque] = &columns;
        let samples: usize =
            kinematics::stretches(time, angle, torque).iter().map(|s| s.position.len()).sum();
        assert!((1000..=5 * time.len()).contains(&samples), "{samples} samples of {} rows", time.len());
        let names = ["time_s", "motor_angle_rad", "torque_nm"];
        let log = Log::from_columns("bursts.csv", names.into_iter().zip(columns.clone()));
        let found = fit(&[log], Axis::Rotary, None, &[]);
        check(&found, &[("inertia_kg_m2", 0.005, 0.03), ("coulomb_nm", 0.05, 0.2)]);
    }
}

/// Rare fast passes in a noisy position: what is slow is noise.
#[test]
fn a_stribeck_curve_under_noise_is_refused_with_the_mend() {
    let mut noise = Noise::new(3);
    let time: Vec<f64> = (0..75_000).map(|row| f64::from(row) * 2e-3).collect();
    let pass = |t: f64| if t % 12.0 < 1.5 { 12.0 } else { 0.0 };
    let speed: Vec<f64> = time.iter().map(|&t| if t % 24.0 < 12.0 { pass(t) } else { -pass(t) }).collect();
    let mut angle = 0.0;
    let angles = speed.iter().map(|v| {
        angle += v * 2e-3;
        angle + 0.55 * noise.normal()
    });
    let columns = [time.clone(), angles.collect(), speed.iter().map(|v| 0.05 * v.signum()).collect()];
    let names = ["time_s", "motor_angle_rad", "torque_nm"];
    let log = Log::from_columns("noisy.csv", names.into_iter().zip(columns));
    let names = ["all".to_owned(), "static_nm".to_owned()];
    let result = fit_motion(&[log], Axis::Rotary, None, &names, &mut |_| ControlFlow::Continue(()));
    assert_eq!(result.unwrap_err(), MotionError::StribeckHidden { files: "noisy.csv".to_owned() });
}

/// A simulated axis, integrated here on its own.
#[derive(Clone, Copy)]
struct Plant {
    inertia: f64,
    viscous: f64,
    coulomb: f64,
    offset: f64,
    gravity: f64,
    /// Static level, speed and exponent of a Stribeck curve.
    stribeck: Option<[f64; 3]>,
    /// Torque at a time.
    drive: fn(f64) -> f64,
    rate_hz: f64,
    seconds: f64,
    /// Steps of the encoder.
    quantum: f64,
}

const SHAFT: Plant = Plant {
    inertia: 0.005,
    viscous: 0.002,
    coulomb: 0.05,
    offset: -0.01,
    gravity: 0.0,
    stribeck: None,
    drive: |t| 0.3 * (3.0 * t).sin() + 0.2 * (11.3 * t).sin() + 0.1 * (29.0 * t + 1.0).sin(),
    rate_hz: 1000.0,
    seconds: 12.0,
    quantum: 2.0 * std::f64::consts::PI / 65536.0,
};

impl Plant {
    fn level(&self, speed: f64) -> f64 {
        match self.stribeck {
            None => self.coulomb,
            Some([stick, knee, exponent]) => {
                self.coulomb + (stick - self.coulomb) * (-(speed.abs() / knee).powf(exponent)).exp()
            }
        }
    }

    /// Explicit steps of 1/40 sample; dry friction stops the axis where it would turn it round.
    fn run(&self) -> [Vec<f64>; 3] {
        const PARTS: u32 = 40;
        let step = 1.0 / (self.rate_hz * f64::from(PARTS));
        let (mut angle, mut speed) = (0.1, 0.0);
        let mut table = [vec![], vec![], vec![]];
        for row in 0..(self.seconds * self.rate_hz) as usize {
            let time = row as f64 / self.rate_hz;
            let seen = (angle / self.quantum).round() * self.quantum;
            for (column, value) in table.iter_mut().zip([time, seen, (self.drive)(time)]) {
                column.push(value);
            }
            for part in 0..PARTS {
                let now = time + (f64::from(part) + 0.5) * step;
                let push = (self.drive)(now) - self.offset - self.gravity * f64::sin(angle);
                let before: f64 = speed;
                let way = if before == 0.0 { push.signum() } else { before.signum() };
                let after =
                    before + step * (push - self.viscous * before - way * self.level(before)) / self.inertia;
                let blocked = before == 0.0 && push.abs() <= self.level(0.0);
                speed = if blocked || before * after < 0.0 { 0.0 } else { after };
                angle += 0.5 * (before + speed) * step;
            }
        }
        table
    }

    fn log(&self, axis: Axis) -> Log {
        let (position, effort) = axis.columns();
        Log::from_columns("made.csv", ["time_s", position, effort].into_iter().zip(self.run()))
    }
}

fn check(found: &MotionFit, expected: &[(&str, f64, f64)]) {
    for &(key, truth, tolerance) in expected {
        let value = found.parameter(key).unwrap().value;
        assert!((value - truth).abs() < tolerance * truth.abs(), "{key} = {value} for {truth}: {found:#?}");
    }
}

#[test]
fn a_made_shaft_gives_back_its_parameters() {
    let expected = [
        ("inertia_kg_m2", 0.005, 0.005),
        ("viscous_nm_s_rad", 0.002, 0.02),
        ("coulomb_nm", 0.05, 0.02),
        ("offset_nm", -0.01, 0.02),
    ];
    for rate_hz in [250.0, 1000.0, 5000.0] {
        let found = fit(&[Plant { rate_hz, ..SHAFT }.log(Axis::Rotary)], Axis::Rotary, None, &[]);
        check(&found, &expected);
        assert!(found.relative_error < 0.03 && found.warnings.is_empty(), "{rate_hz} Hz: {found:#?}");
    }
}

/// The drive is known and far slower than the filters, so that the filtered torque is the drive itself but for their
/// ripple of about one percent; a row later it would be up to 0.06 N m off.
#[test]
fn the_rows_of_a_fit_are_what_was_measured_and_what_the_model_makes_of_it() {
    let log = SHAFT.log(Axis::Rotary);
    let found = fit(&[log.clone(), log], Axis::Rotary, None, &[]);
    let MotionSeries { time_s, speed, measured, fitted } = &found.series;
    assert_eq!([speed.len(), measured.len(), fitted.len(), time_s.len()], [found.rows; 4]);
    for (time, torque) in time_s.iter().zip(measured) {
        assert!((torque - (SHAFT.drive)(*time)).abs() < 0.01, "{torque} N m at {time} s");
    }
    let squares: f64 = measured.iter().zip(fitted).map(|(is, model)| (is - model).powi(2)).sum();
    assert!(((squares / found.rows as f64).sqrt() / found.rmse - 1.0).abs() < 1e-9, "{}", found.rmse);
    let back = time_s.windows(2).filter(|pair| pair[1] <= pair[0]).count();
    assert_eq!(back, 1, "log after log");
    let power: f64 = speed.iter().zip(measured).map(|(speed, torque)| speed * torque).sum();
    assert!(power > 0.0, "friction takes power");
}

#[test]
fn a_made_carriage_gives_back_its_parameters() {
    let carriage = Plant {
        inertia: 40.0,
        viscous: 90.0,
        coulomb: 15.0,
        offset: 4.0,
        drive: |t| 80.0 * (2.0 * t).sin() + 60.0 * (7.1 * t).sin(),
        quantum: 1e-6,
        ..SHAFT
    };
    let found = fit(&[carriage.log(Axis::Linear)], Axis::Linear, None, &["all"]);
    let expected = [
        ("mass_kg", 40.0, 0.005),
        ("viscous_n_s_m", 90.0, 0.01),
        ("coulomb_n", 15.0, 0.02),
        ("offset_n", 4.0, 0.02),
    ];
    check(&found, &expected);
}

#[test]
fn a_slowly_sampled_pendulum_needs_its_gravity() {
    let pendulum = Plant {
        inertia: 0.034,
        viscous: 0.05,
        coulomb: 0.1,
        gravity: 1.5,
        rate_hz: 62.5,
        seconds: 24.0,
        drive: |t| 0.9 * (1.4 * t).sin() + 0.6 * (3.1 * t).sin(),
        quantum: 1e-4,
        ..SHAFT
    };
    let log = [pendulum.log(Axis::Rotary)];
    let model = AxisParameters::Rotary { inertia_kg_m2: 0.034, gravity_torque_nm: 1.5, friction: None };
    let known = KnownAxis::from(&AxisModel::new(model));
    let expected =
        [("inertia_kg_m2", 0.034, 0.03), ("viscous_nm_s_rad", 0.05, 0.1), ("coulomb_nm", 0.1, 0.1)];
    check(&fit(&log, Axis::Rotary, Some(&known), &["all"]), &expected);
    let wrong = KnownAxis { gravity_torque_nm: 0.0, ..known };
    let free = fit(&log, Axis::Rotary, Some(&wrong), &["all", "gravity_torque_nm"]);
    check(&free, &expected);
    check(&free, &[("gravity_torque_nm", 1.5, 0.02)]);
    assert!(!fit(&log, Axis::Rotary, Some(&wrong), &[]).warnings.is_empty());
}

#[test]
fn the_stribeck_three_are_found_when_asked_for() {
    let plant = Plant { stribeck: Some([0.12, 1.5, 1.0]), seconds: 40.0, ..SHAFT };
    let found = fit(&[plant.log(Axis::Rotary)], Axis::Rotary, None, &["static_nm"]);
    let expected = [
        ("inertia_kg_m2", 0.005, 0.01),
        ("coulomb_nm", 0.05, 0.1),
        ("static_nm", 0.12, 0.1),
        ("stribeck_speed_rad_s", 1.5, 0.2),
        ("stribeck_exponent", 1.0, 0.2),
    ];
    check(&found, &expected);
    assert!(fit(&[plant.log(Axis::Rotary)], Axis::Rotary, None, &[]).parameter("static_nm").is_none());
}

#[test]
fn parameters_that_are_not_named_keep_the_values_of_the_model() {
    let friction = StribeckParameters {
        coulomb_nm: 0.05,
        static_nm: 0.05,
        viscous_nm_s_rad: 0.002,
        offset_nm: -0.01,
        ..PAPER_LEFT
    };
    let known = KnownAxis { inertia: 1.0, friction: Some(friction), gravity_torque_nm: 0.0 };
    let found = fit(&[SHAFT.log(Axis::Rotary)], Axis::Rotary, Some(&known), &["inertia_kg_m2"]);
    check(&found, &[("inertia_kg_m2", 0.005, 0.005), ("viscous_nm_s_rad", 0.002, 1e-12)]);
    let held = |key: &str| found.parameter(key).unwrap().held;
    assert!(!held("inertia_kg_m2") && held("viscous_nm_s_rad") && held("coulomb_nm"));
}

#[test]
fn jitter_gaps_and_several_logs_change_little() {
    let log = SHAFT.log(Axis::Rotary);
    let column = |name: &str| log.column(name).unwrap().to_vec();
    let (time, angle, torque) = (column("time_s"), column("motor_angle_rad"), column("torque_nm"));
    // Rows lost in a fixed pattern up to 4 in a row, and half a second of gap.
    let kept: Vec<usize> =
        (0..time.len()).filter(|row| row * row % 17 > 4 && !(5000..5500).contains(row)).collect();
    let thin = |values: &[f64]| kept.iter().map(|&row| values[row]).collect::<Vec<_>>();
    let thinned = [("time_s", thin(&time)), ("motor_angle_rad", thin(&angle)), ("torque_nm", thin(&torque))];
    let found = fit(&[Log::from_columns("thin", thinned), log], Axis::Rotary, None, &[]);
    check(&found, &[("inertia_kg_m2", 0.005, 0.005), ("coulomb_nm", 0.05, 0.02), ("offset_nm", -0.01, 0.03)]);
}

/// Motion that does not tell: the value is left out and a sentence says what to record.
#[test]
fn what_the_motion_does_not_excite_is_said() {
    let made = |speed: fn(f64) -> f64| {
        let time: Vec<f64> = (0..8000).map(|row| f64::from(row) * 1e-3).collect();
        let mut random = 1_u32;
        let mut noise = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 8) / f64::from(1 << 24) - 0.5
        };
        let mut angle = 0.0;
        let angles: Vec<f64> = time
            .iter()
            .map(|&t| {
                angle += speed(t) * 1e-3;
                angle + 1e-4 * noise()
            })
            .collect();
        let torques =
            time.iter().map(|&t| 0.05 * speed(t).signum() + 0.002 * speed(t) + 0.001 * noise()).collect();
        Log::from_columns("made", [("time_s", time), ("motor_angle_rad", angles), ("torque_nm", torques)])
    };
    for (speed, lost, remedy) in [
        ((|_| 5.0) as fn(f64) -> f64, "inertia_kg_m2", "strong accelerations"),
        (|_| 5.0, "offset_nm", "both directions"),
        (|_| 5.0, "viscous_nm_s_rad", "several speeds"),
        (|t| 5.0 + 3.0 * (6.0 * t).sin(), "offset_nm", "both directions"),
    ] {
        let found = fit(&[made(speed)], Axis::Rotary, None, &[]);
        assert_eq!(found.parameter(lost), None, "{found:#?}");
        assert!(found.warnings.iter().any(|w| w.starts_with(lost) && w.contains(remedy)), "{found:#?}");
    }
}

#[test]
fn logs_that_cannot_be_fitted_say_why() {
    let still = [
        ("time_s", vec![0.0, 0.1, 0.2, 0.3, 0.4]),
        ("motor_angle_rad", vec![1.0; 5]),
        ("torque_nm", vec![0.0; 5]),
    ];
    let short = [
        ("time_s", vec![0.0, 0.1, 0.2, 0.3, 0.4]),
        ("motor_angle_rad", vec![0.0, 1.0, 2.0, 1.0, 0.0]),
        ("torque_nm", vec![0.0, 0.1, 0.0, -0.1, 0.0]),
    ];
    let idle = [short[0].clone(), short[1].clone(), still[2].clone()];
    let part = [("time_s", vec![0.0, 0.1]), ("torque_nm", vec![0.0; 2])];
    let empty: [(&str, Vec<f64>); 3] =
        [("time_s", vec![]), ("motor_angle_rad", vec![]), ("torque_nm", vec![])];
    for (log, estimate, expected) in [
        (Log::from_columns("a.csv", still), "all", "a.csv: column `motor_angle_rad` is constant: record"),
        (Log::from_columns("f.csv", idle), "all", "f.csv: column `torque_nm` is constant and carries"),
        (
            Log::from_columns("b.csv", short),
            "all",
            "rows in motion remain after filtering at 1.667 Hz, but 20",
        ),
        (
            Log::from_columns("c.csv", part.clone()),
            "all",
            "c.csv: a bench log needs `motor_angle_rad`, but the file has",
        ),
        (Log::from_columns("d.csv", empty), "all", "d.csv: 0 rows in motion"),
        (
            Log::from_columns("e.csv", part),
            "mass_kg",
            "`mass_kg` is not a parameter of this axis: estimate all or",
        ),
    ] {
        let result =
            fit_motion(
                &[log],
                Axis::Rotary,
                None,
                &[estimate.to_owned()],
                &mut |_| ControlFlow::Continue(()),
            );
        let message = result.unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    let none = fit_motion(&[], Axis::Rotary, None, &[], &mut |_| ControlFlow::Continue(()));
    assert_eq!(none, Err(MotionError::NoLog));
}

#[test]
fn a_fit_can_be_cancelled_at_any_report() {
    let log = [Plant { seconds: 6.0, ..SHAFT }.log(Axis::Rotary)];
    let mut reports = 0;
    let mut run = |stop_at: usize| {
        let mut count = 0;
        let result = fit_motion(&log, Axis::Rotary, None, &["static_nm".to_owned()], &mut |share| {
            assert!((0.0..=1.0).contains(&share));
            count += 1;
            if count == stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        reports = reports.max(count);
        result
    };
    assert!(run(usize::MAX).is_ok());
    for stop_at in [1, 2, 30] {
        assert_eq!(run(stop_at), Err(MotionError::Cancelled));
    }
    assert!(reports > 30);
}
