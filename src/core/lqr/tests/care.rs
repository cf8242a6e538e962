//! The general solver: references of 32 digits, refusals, warnings.

use nalgebra::{Complex, DMatrix};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{decimal, relative_error};
use crate::lqr::{CareError, CareInput, CareSolution, solve_care};

/// A square matrix, row by row.
fn square(entries: &[f64]) -> DMatrix<f64> {
    let size = entries.len().isqrt();
    DMatrix::from_row_slice(size, size, entries)
}

fn solve(a: &[f64], b: &[f64], q: &[f64], r: &[f64]) -> Result<CareSolution, CareError> {
    let (a, r) = (square(a), square(r));
    let b = DMatrix::from_row_slice(a.nrows(), r.nrows(), b);
    solve_care(&a, &square(q), CareInput::Weighted { b: &b, r: &r })
}

fn solve_quadratic(a: &[f64], g: &[f64], q: &[f64]) -> Result<CareSolution, CareError> {
    solve_care(&square(a), &square(q), CareInput::Quadratic { g: &square(g) })
}

const ROBOT_A: [f64; 16] = [
    0.0,
    1.0,
    0.0,
    0.0,
    0.0,
    0.0,
    -16.096019417475723,
    0.0,
    0.0,
    0.0,
    0.0,
    1.0,
    0.0,
    0.0,
    79.2419417475728,
    0.0,
];
const ROBOT_B: [f64; 8] =
    [0.0, 0.0, 2.1553398058252418, 2.1553398058252418, 0.0, 0.0, -7.533980582524269, -7.533980582524269];

/// Name, A, B, Q, R and the upper triangle of P.
type Reference<'a> = (&'a str, &'a [f64], &'a [f64], Vec<f64>, &'a [f64], &'a [&'a str]);
/// A, B, Q, R and what is wrong with them.
type Refusal<'a> = (&'a [f64], &'a [f64], &'a [f64], &'a [f64], CareError);

/// Upper triangles of P by the matrix sign function with 120 digits (Python's mpmath) on these very doubles.
#[test]
fn p_is_the_exact_solution_rounded_to_double() {
    let diagonal = |entries: &[f64]| {
        DMatrix::from_diagonal(&nalgebra::DVector::from_column_slice(entries)).as_slice().to_vec()
    };
    #[rustfmt::skip]
    let cases: [Reference; 6] = [
        ("robot", &ROBOT_A, &ROBOT_B, diagonal(&[60.0, 30.0, 100.0, 5.0]), &[20.0, 0.0, 0.0, 20.0], &[
            "97.677118483163916886950301910815", "64.506828959783683997208709844137",
            "96.997079047870499381706119122003", "21.705528948632281473293649854128",
            "90.258720179758946071784331071652", "136.20105742936210279650778559452",
            "31.114326151597725733716437696948", "480.9890823106833238061611034257",
            "75.903611198490318524043199113122", "14.157301869699318683724145223583",
        ]),
        ("robot at the sliders' ends", &ROBOT_A, &ROBOT_B, diagonal(&[1e-4, 1e6, 1e5, 3e5]), &[0.01, 0.0, 0.0, 100.0], &[
            "10.000052666575426386423235702389", "5.266671411455516919421564471805",
            "9.0409297204383540717214767604901", "1.5068351136514314898547987402911",
            "526668.53960512422093529232733786", "904096.22675679217366766307172007",
            "150683.91150981964640802789903556", "2139559.9594734245091756971922585",
            "258692.05104952765596482529407792", "43120.025834045162558296293319047",
        ]),
        ("semidefinite q", &[4.0, 3.0, -4.5, -3.5], &[1.0, -1.0], vec![9.0, 6.0, 6.0, 4.0], &[1.0], &[
            "21.727922061357855439215198517887", "14.485281374238570292810132345258",
            "9.6568542494923801952067548968388",
        ]),
        ("indefinite q", &[0.0, 1.0, -1.0, 0.5], &[0.0, 1.0], vec![-0.25, 0.125, 0.125, 1.0], &[2.0], &[
            "2.3490761265465218247734086755708", "-0.12917130661302930720812563384173",
            "2.5758536650171178794597036530152",
        ]),
        ("r singular but for 1e-12", &[-0.1, 0.0, 0.0, -0.02], &[0.1, 0.0, 0.001, 0.01],
            vec![100.0, 1000.0, 1000.0, 10000.0], &[1.000000000001, 1.0, 1.0, 1.0], &[
            "74.684039801069366231777795205424", "829.82221718557317916731738411808",
            "9220.2431225609992394732501008627",
        ]),
        ("unstable mode that costs nothing", &[1.0, 2.0, 0.0, -1.0], &[1.0, 1.0], vec![0.0; 4], &[1.0],
            &["0.5", "0.5", "0.5"]),
    ];
    for (name, a, b, q, r, upper) in cases {
        let solution = solve(a, b, &q, r).unwrap();
        let n = solution.p.nrows();
        let upper_index = |i: usize, j: usize| i.min(j) * (2 * n - i.min(j) + 1) / 2 + i.abs_diff(j);
        let error = relative_error(&solution.p, |i, j| decimal(upper[upper_index(i, j)]));
        assert!(error <= 1.1e-16, "{name}: {error:e}");
        assert!(solution.warnings.is_empty(), "{name}: {:?}", solution.warnings);
        assert!(solution.poles.iter().all(|pole| pole.re < 0.0), "{name}: {:?}", solution.poles);
    }
}

/// Laub's chain of integrators (CAREX 4.1) has sqrt(q r) in the corner of P, and poles on the unit circle
/// at the angles of Butterworth's filter; with 36 states its condition is beyond 1e30.
#[test]
fn chain_of_integrators_has_butterworth_poles() {
    for n in [2, 21, 36] {
        let a = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i + 1 == j)));
        let b = DMatrix::from_fn(n, 1, |i, _| f64::from(u8::from(i + 1 == n)));
        let q = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i + j == 0)));
        let r = DMatrix::identity(1, 1);
        let solution = solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r }).unwrap();
        assert!((solution.p[(0, n - 1)] - 1.0).abs() <= 2.0 * f64::EPSILON);
        let slowest = solution.poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
        let expected = -(std::f64::consts::FRAC_PI_2 / n as f64).sin();
        assert!((slowest / expected - 1.0).abs() < 1e-9, "{n}: {slowest} {expected}");
    }
}

#[test]
fn g_in_place_of_b_and_r_gives_the_same_p_and_no_gain() {
    let weighted = solve(&[4.0, 3.0, -4.5, -3.5], &[1.0, -1.0], &[9.0, 6.0, 6.0, 4.0], &[0.5]).unwrap();
    let quadratic =
        solve_quadratic(&[4.0, 3.0, -4.5, -3.5], &[2.0, -2.0, -2.0, 2.0], &[9.0, 6.0, 6.0, 4.0]).unwrap();
    assert_eq!(weighted.p, quadratic.p);
    assert!(weighted.gain.is_some() && quadratic.gain.is_none());
}

/// Without inputs the equation is Lyapunov's: AᵀP + PA + Q = 0.
#[test]
fn no_input_at_all_leaves_lyapunovs_equation() {
    let solution = solve(&[-2.0], &[], &[8.0], &[]).unwrap();
    assert_eq!((solution.p[(0, 0)], solution.gain.map(|gain| gain.shape())), (2.0, Some((0, 1))));
}

#[test]
fn poles_on_the_axis_are_a_warning_with_p() {
    let oscillator = [0.0, 1.0, -1.0, 0.0];
    let cases: [[&[f64]; 4]; 4] = [
        [&[0.0], &[1.0], &[0.0], &[0.0]],
        [&oscillator, &[0.0, 1.0], &[0.0; 4], &[0.0; 4]],
        // A displacement that costs nothing, and a speed that does.
        [&[0.0, 1.0, 0.0, 0.0], &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0], &[0.0, 0.0, 0.0, 1.0]],
        // No input, no cost.
        [&oscillator, &[0.0, 0.0], &[0.0; 4], &[0.0; 4]],
    ];
    for [a, b, q, p] in cases {
        let solution = solve(a, b, q, &[1.0]).unwrap();
        assert!((&solution.p - square(p)).norm() < 1e-12, "{}", solution.p);
        assert_eq!(solution.warnings.len(), 1, "{:?}", solution.warnings);
        assert!(solution.warnings[0].contains("imaginary axis"), "{:?}", solution.warnings);
    }
}

#[test]
fn refusals_name_the_cause() {
    let zero = Complex::default();
    let cases: [Refusal; 12] = [
        (
            &[1.0, 0.0, 0.0, -1.0],
            &[0.0, 1.0],
            &[1.0, 0.0, 0.0, 1.0],
            &[1.0],
            CareError::NotStabilisable { eigenvalue: Complex::new(1.0, 0.0) },
        ),
        (&[0.0], &[0.0], &[1.0], &[1.0], CareError::NotStabilisable { eigenvalue: zero }),
        (
            &[0.0, 3.0, -3.0, 0.0],
            &[0.0, 0.0],
            &[1.0, 0.0, 0.0, 1.0],
            &[1.0],
            CareError::NotStabilisable { eigenvalue: Complex::new(0.0, 3.0) },
        ),
        (&[0.0], &[1.0], &[-1.0], &[1.0], CareError::NoSolution { eigenvalue: Complex::new(0.0, 1.0) }),
        (&[1.0], &[1.0], &[1.0], &[0.0], CareError::RNotPositiveDefinite),
        (&[1.0], &[1.0], &[1.0], &[-1.0], CareError::RNotPositiveDefinite),
        (&[1.0], &[1.0, 1.0], &[1.0], &[1.0, 1.0, 1.0, 1.0], CareError::RNotPositiveDefinite),
        (&[1.0], &[1.0, 1.0], &[1.0], &[1.0, 2.0, 2.0, 1.0], CareError::RNotPositiveDefinite),
        (
            &[0.0, 1.0, 0.0, 0.0],
            &[0.0, 1.0],
            &[1.0, 0.5, 0.4, 1.0],
            &[1.0],
            CareError::NotSymmetric { matrix: "q", row: 1, column: 2, upper: 0.5, lower: 0.4 },
        ),
        (
            &[0.0, 1.0, 0.0, 0.0],
            &[0.0, f64::INFINITY],
            &[1.0, 0.0, 0.0, 1.0],
            &[1.0],
            CareError::NonFinite { matrix: "b", row: 2, column: 1, value: f64::INFINITY },
        ),
        (
            &[0.0, 1.0, 0.0, 0.0],
            &[0.0, 1.0],
            &[1.0],
            &[1.0],
            CareError::Shape { matrix: "q", rows: 1, columns: 1, needed_rows: 2, needed_columns: 2 },
        ),
        (&[], &[], &[], &[1.0], CareError::NoStates),
    ];
    for (a, b, q, r, expected) in cases {
        let found = solve(a, b, q, r).unwrap_err();
        match (&found, &expected) {
            (CareError::NoSolution { eigenvalue: one }, CareError::NoSolution { eigenvalue: other }) => {
                assert!((one - other).norm() < 1e-7 || (one + other).norm() < 1e-7, "{one}");
            }
            _ => assert_eq!(found, expected),
        }
    }
    let nan = solve(&[1.0, 2.0, f64::NAN, 3.0], &[0.0, 1.0], &[1.0, 0.0, 0.0, 1.0], &[1.0]).unwrap_err();
    assert_eq!(nan.to_string(), "entry (2, 1) of matrix a is NaN: it must be a finite number");
}

/// Numbers at the ends of the range of doubles end in an error or a right answer, never in a panic or NaN.
#[test]
fn extreme_numbers_are_solved_or_refused() {
    for size in [1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300] {
        for (a, b, q, r) in
            [(size, 1.0, 1.0, 1.0), (1.0, size, 1.0, 1.0), (1.0, 1.0, size, 1.0), (1.0, 1.0, 1.0, size)]
        {
            if let Ok(solution) = solve(&[a], &[b], &[q], &[r]) {
                // The positive root of p² b²/r − 2ap − q = 0, by its larger term.
                let ratio = b / r.sqrt();
                let root = (a / ratio).hypot(q.sqrt());
                let expected = (a / ratio + root) / ratio;
                let found = solution.p[(0, 0)];
                assert!((found / expected - 1.0).abs() < 1e-14, "{a} {b} {q} {r}: {found} {expected}");
            }
        }
    }
}

/// Numbers so far apart that no double holds the products of them are named as such, not as a fault of the model.
#[test]
fn numbers_too_far_apart_are_named_and_no_mode_is_blamed() {
    let (a, identity) = ([0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 1.0]);
    for exponent in (-300..=300).step_by(5) {
        let size = 10.0_f64.powi(exponent);
        for (b, q, r) in [
            ([0.0, size], identity, 1.0),
            ([0.0, 1.0], identity.map(|entry| entry * size), 1.0),
            ([0.0, 1.0], identity, size),
            ([0.0, 1.0], [size, 0.0, 0.0, 1.0], 1.0),
        ] {
            match solve(&a, &b, &q, &[r]) {
                Ok(solution) => {
                    // The slower of two poles so far apart is known to the rounding of the faster one.
                    let fastest = solution.poles.iter().fold(0.0_f64, |most, pole| most.max(pole.re.abs()));
                    let stable = |re: f64| re <= 1e-13 * fastest;
                    assert!(solution.poles.iter().all(|pole| stable(pole.re)), "{b:?} {q:?} {r}");
                }
                Err(CareError::TooFarApart { value, .. }) => {
                    assert!((value / size - 1.0).abs() < 1e-9, "{value:e}")
                }
                Err(CareError::OutOfRange) => {}
                Err(other) => panic!("{b:?} {q:?} {r}: {other}"),
            }
        }
    }
    let error = solve(&a, &[0.0, 1e155], &identity, &[1.0]).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("matrix b has an entry of 1e155, too large or too small compared with the others"),
        "{error}"
    );
}

/// A mode that the input (`reached` false) or the cost (true) misses but for the rounding of a rotation.
fn with_lost_mode(generator: &mut ChaCha8Rng, n: usize, eigenvalue: f64, reached: bool) -> [DMatrix<f64>; 3] {
    let mut random = |rows: usize, columns: usize| {
        DMatrix::from_fn(rows, columns, |_, _| generator.random_range(-1.0..1.0))
    };
    let (turn, mut a, mut b, mut c) = (random(n, n).qr().q(), random(n, n), random(n, 1), random(1, n));
    for other in 1..n {
        a[if reached { (other, 0) } else { (0, other) }] = 0.0;
    }
    a[(0, 0)] = eigenvalue;
    *(if reached { &mut c[(0, 0)] } else { &mut b[(0, 0)] }) = 0.0;
    let c = c * turn.transpose();
    [&turn * a * turn.transpose(), &turn * b, c.transpose() * c]
}

/// Outcome first: what is returned is stable or says that it is not; what is refused is named.
#[test]
fn modes_lost_to_rounding_are_solved_warned_of_or_refused_but_never_silent() {
    let mut generator = ChaCha8Rng::seed_from_u64(5);
    for case in 0..80 {
        let (n, reached, eigenvalue) = (2 + case % 5, case % 2 == 0, if case < 40 { 0.5 } else { 0.0 });
        let [a, b, q] = with_lost_mode(&mut generator, n, eigenvalue, reached);
        let outcome = solve_care(&a, &q, CareInput::Weighted { b: &b, r: &DMatrix::identity(1, 1) });
        let stable = |solution: &CareSolution| solution.poles.iter().all(|pole| pole.re < 0.0);
        match outcome {
            // An unstable mode may cost nothing; the closed loop mirrors it.
            Ok(solution) if reached && eigenvalue > 0.0 => {
                assert!(stable(&solution) && solution.warnings.is_empty());
                assert!(solution.poles.iter().any(|pole| (pole + eigenvalue).norm() < 1e-9), "{case}");
            }
            Ok(solution) => {
                assert!(eigenvalue == 0.0, "{case}: an unstable mode out of reach was solved");
                assert!(solution.relative_residual < 1e-12, "{case}: {:e}", solution.relative_residual);
                assert!(!solution.warnings.is_empty() || (reached && stable(&solution)), "{case}");
            }
            Err(CareError::NotStabilisable { eigenvalue: found }) => {
                assert!(!reached && (found - eigenvalue).norm() < 1e-12, "{case}: {found}");
            }
            Err(other) => panic!("{case}: {other}"),
        }
    }
}
