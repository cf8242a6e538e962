//! `flqr gains`: the LQR design of a model.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use flqr_core::lqr::{self, LqrDesign, Weights};
use flqr_core::model_file::RobotModel;
use flqr_core::robot::LinearModel;
use serde::Serialize;

use super::input;
use super::output::{Failure, Output};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) with a [robot] and an [lqr] table
    model: PathBuf,
}

/// Keys of the JSON object; matrices as rows.
#[derive(Serialize)]
struct Gains {
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    k: Vec<Vec<f64>>,
    p: Vec<Vec<f64>>,
    poles: Vec<[f64; 2]>,
    riccati_residual: f64,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (name, robot) = input::load_robot(&arguments.model)?;
    let linear = robot.parameters.linear_model();
    let design = design(&arguments.model, &robot)?;
    output.result(&Gains::new(&linear, &design), |out| print(out, &name, &design))
}

/// The design of a loaded robot; the error names the file.
pub(crate) fn design(path: &Path, robot: &RobotModel) -> Result<LqrDesign, Failure> {
    let weights = weights(path, robot)?;
    lqr::design(&robot.parameters.linear_model(), &weights)
        .map_err(|error| Failure::Message(format!("{}: {error}", path.display())))
}

fn weights(path: &Path, robot: &RobotModel) -> Result<Weights, Failure> {
    robot.weights.ok_or_else(|| {
        Failure::Message(format!(
            "{}: the model has no [lqr] table: add q_diagonal = [4 numbers] and r_diagonal = [2 numbers]",
            path.display()
        ))
    })
}

impl Gains {
    fn new(linear: &LinearModel, design: &LqrDesign) -> Self {
        Self {
            a: rows(&linear.a),
            b: rows(&linear.b),
            k: rows(&design.gain),
            p: rows(&design.cost),
            poles: design.poles.iter().map(|pole| [pole.re, pole.im]).collect(),
            riccati_residual: design.riccati_residual,
        }
    }
}

/// A matrix as its rows.
pub(crate) fn rows<R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<f64, R, C>>(
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn print(out: &mut dyn Write, name: &str, design: &LqrDesign) -> io::Result<()> {
    writeln!(out, "{name}: u = -K X, X = [x, x_dot, pitch, pitch_rate], u = [left, right] in N m\n")?;
    writeln!(out, "{:8}{:>14}{:>14}{:>14}{:>14}", "gain K", "N m/m", "N m s/m", "N m/rad", "N m s/rad")?;
    for (motor, row) in ["left", "right"].iter().zip(design.gain.row_iter()) {
        write!(out, "{motor:8}")?;
        for entry in row.iter() {
            write!(out, "{entry:>14.6}")?;
        }
        writeln!(out)?;
    }
    writeln!(out, "\nclosed-loop poles, rad/s")?;
    for pole in &design.poles {
        match pole.im {
            0.0 => writeln!(out, "  {:.4}", pole.re)?,
            im => writeln!(out, "  {:.4} {} {:.4} i", pole.re, if im < 0.0 { '-' } else { '+' }, im.abs())?,
        }
    }
    writeln!(out, "\nRiccati residual {:.1e} (relative to P)", design.riccati_residual)
}
