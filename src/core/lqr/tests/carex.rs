//! The CAREX collection (Abels, Benner) against references of 22 or 40 digits and against the best of scipy,
//! slycot and drake on the same doubles.

use nalgebra::DMatrix;
use serde_json::Value;

use super::{decimal, relative_error};
use crate::lqr::{CareInput, solve_care};
use crate::shared::shared_text;

/// The peers' best is taken as no better than half a unit in the last place.
const ROUNDING: f64 = 1.1e-16;

#[test]
fn no_example_is_ten_times_worse_than_the_best_peer_and_the_mean_is_below_5e_15() {
    let Some(text) = shared_text("carex/carex.json") else { return };
    let collection: Value = serde_json::from_str(&text).unwrap();
    let examples = collection["examples"].as_array().unwrap();
    let mut logarithms = 0.0;
    for example in examples {
        let (error, peer) = (error_of(example), best_peer(example));
        let name = example["id"].as_str().unwrap();
        println!(
            "{name:<11} ours {error:.1e}  best peer {peer:.1e}  ratio {:.2}",
            error / peer.max(ROUNDING)
        );
        assert!(error <= 10.0 * peer.max(ROUNDING), "{name}: {error:e} against {peer:e}");
        // An exact result counts as a tenth of a rounding.
        logarithms += error.max(0.1 * ROUNDING).ln();
    }
    let mean = (logarithms / examples.len() as f64).exp();
    println!("geometric mean {mean:.1e} over {} examples", examples.len());
    assert!(examples.len() == 19 && mean <= 5e-15, "{mean:e}");
}

/// ‖P − P_ref‖_F / ‖P_ref‖_F.
fn error_of(example: &Value) -> f64 {
    let [a, b, q, r] = ["A", "B", "Q", "R"].map(|name| matrix(&example[name]));
    let weighted = solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r }).unwrap();
    let axis = example["closed_loop_max_real"] == 0.0;
    assert_eq!(weighted.warnings.len(), usize::from(axis), "{:?}", weighted.warnings);
    assert!(axis || weighted.poles.iter().all(|pole| pole.re < 0.0));
    let reference = &example["P_ref"];
    relative_error(&weighted.p, |i, j| decimal(reference[i][j].as_str().unwrap()))
}

fn best_peer(example: &Value) -> f64 {
    let errors =
        example["peers"].as_object().unwrap().values().map(|peer| peer["rel_error"].as_f64().unwrap());
    errors.fold(f64::INFINITY, f64::min)
}

fn matrix(rows: &Value) -> DMatrix<f64> {
    let rows = rows.as_array().unwrap();
    let columns = rows[0].as_array().unwrap().len();
    DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j].as_f64().unwrap())
}
