//! `flqr riccati`: solves a continuous-time algebraic Riccati equation.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use flqr_core::lqr::{self, CareInput, CareSolution};
use nalgebra::DMatrix;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::gains::rows;
use super::input;
use super::output::{Failure, Output};

#[derive(Args)]
pub(crate) struct Arguments {
    /// JSON object with `a` (n×n), `q` (n×n, symmetric) and either `b` (n×m) and `r` (m×m) or `g` = B R⁻¹ Bᵀ
    file: PathBuf,
}

type Rows = Vec<Vec<f64>>;

#[derive(Deserialize)]
struct Problem {
    a: Rows,
    q: Rows,
    b: Option<Rows>,
    r: Option<Rows>,
    g: Option<Rows>,
    /// Unknown keys, such as a cross term of the cost.
    #[serde(flatten)]
    unknown: BTreeMap<String, IgnoredAny>,
}

/// Keys of the JSON object; matrices as rows.
#[derive(Serialize)]
struct Solution {
    p: Rows,
    #[serde(skip_serializing_if = "Option::is_none")]
    k: Option<Rows>,
    poles: Vec<[f64; 2]>,
    riccati_residual: f64,
    warnings: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let path = &arguments.file;
    let problem: Problem = serde_json::from_str(&input::read_text(path)?)
        .map_err(|error| Failure::Message(format!("{}: {}", path.display(), unread(&error))))?;
    let ignored = problem.unknown.keys().map(|key| format!("key `{key}` is unknown and was ignored"));
    let ignored: Vec<_> = ignored.collect();
    let mut solution = solve(path, problem)?;
    solution.warnings.extend(ignored);
    let keys = Solution {
        p: rows(&solution.p),
        k: solution.gain.as_ref().map(rows),
        poles: solution.poles.iter().map(|pole| [pole.re, pole.im]).collect(),
        riccati_residual: solution.relative_residual,
        warnings: solution.warnings.clone(),
    };
    output.answer(&keys, |out| {
        writeln!(out, "P ={:.9e}", solution.p)?;
        if let Some(gain) = &solution.gain {
            writeln!(out, "K ={gain:.9e}")?;
        }
        writeln!(out, "closed-loop poles")?;
        for pole in &solution.poles {
            writeln!(out, "  {:+.6e} {:+.6e} i", pole.re, pole.im)?;
        }
        writeln!(out, "residual {:.1e} (relative to P)", solution.relative_residual)?;
        solution.warnings.iter().try_for_each(|warning| writeln!(out, "warning: {warning}"))
    })
}

fn unread(error: &serde_json::Error) -> String {
    let words = error.to_string().replace("struct Problem", "an object").replace("f64", "a number");
    format!("{words}: give one JSON object with the matrices a, q and either b and r, or g, as lists of rows")
}

fn solve(path: &Path, problem: Problem) -> Result<CareSolution, Failure> {
    let in_file = |error: String| Failure::Message(format!("{}: {error}", path.display()));
    let matrix = |key, rows| matrix(key, rows).map_err(in_file);
    let a = matrix("a", problem.a)?;
    let q = matrix("q", problem.q)?;
    let solved = match (problem.b, problem.r, problem.g) {
        (Some(b), Some(r), None) => {
            let (b, r) = (matrix("b", b)?, matrix("r", r)?);
            lqr::solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r })
        }
        (None, None, Some(g)) => {
            let g = matrix("g", g)?;
            lqr::solve_care(&a, &q, CareInput::Quadratic { g: &g })
        }
        _ => return Err(in_file("give either `b` and `r`, or `g` alone".to_owned())),
    };
    solved.map_err(|error| in_file(error.to_string()))
}

fn matrix(key: &str, rows: Rows) -> Result<DMatrix<f64>, String> {
    let columns = rows.first().map_or(0, Vec::len);
    if let Some((index, row)) = rows.iter().enumerate().find(|(_, row)| row.len() != columns) {
        return Err(format!(
            "`{key}` is not a matrix: row 1 has {columns} numbers and row {} has {}: give all rows the same length",
            index + 1,
            row.len()
        ));
    }
    Ok(DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]))
}
