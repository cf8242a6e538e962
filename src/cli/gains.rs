//! `flqr gains`: LQR design of a model.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use flqr_core::control::{GainSchedule, ScheduleNode};
use flqr_core::lqr::{self, LqrDesign, Margins, SampledLoop};
use flqr_core::model::{LinearModel, RobotModel, Weights};
use serde::Serialize;

use super::input;
use super::output::{self, Failure, Output};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) with a [robot] and an [lqr] table
    model: PathBuf,
    /// Leg height, m, instead of the model's
    #[arg(long, value_name = "H")]
    leg_height: Option<f64>,
    /// Also compute the gains at N leg heights
    #[arg(long, value_name = "N")]
    schedule: Option<usize>,
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
    margins: MarginKeys,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    schedule: Vec<Scheduled>,
    warnings: Vec<String>,
}

/// Margins of the sampled loop; null if the margin is infinite.
#[derive(Clone, Copy, Serialize)]
struct MarginKeys {
    gain_up: Option<f64>,
    gain_down: f64,
    phase_rad: f64,
    delay_s: Option<f64>,
    crossover_rad_s: f64,
    stable: bool,
}

/// Gain at one leg height.
#[derive(Serialize)]
struct Scheduled {
    leg_height_m: f64,
    k: Vec<Vec<f64>>,
    margins: MarginKeys,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let model = input::load_model(&arguments.model)?;
    let (name, mut robot) = input::robot_of(&model, &arguments.model)?;
    let in_file = |problem: String| Failure::Message(format!("{}: {problem}", arguments.model.display()));
    if let Some(height) = arguments.leg_height {
        robot = robot.at_leg_height(height).map_err(|error| in_file(error.to_string()))?;
    }
    let design = design(&arguments.model, &robot)?;
    let schedule = match arguments.schedule {
        Some(nodes) => {
            GainSchedule::design(&robot, nodes).map_err(|error| in_file(error.to_string()))?.nodes().to_vec()
        }
        None => Vec::new(),
    };
    let mut gains = Gains::new(&robot, &design, &schedule)?;
    for warning in &gains.warnings {
        output::complain(&format!("warning: {warning}"));
    }
    gains.warnings.extend(input::warnings_of(&model));
    output.answer(&gains, |out| print(out, &name, &design, &gains))
}

/// Designs the controller of a loaded robot; the error names the file.
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
    fn new(robot: &RobotModel, design: &LqrDesign, schedule: &[ScheduleNode]) -> Result<Self, Failure> {
        let LinearModel { a, b } = robot.parameters.linear_model();
        let margins = lqr::margins(&LinearModel { a, b }, &design.gain, &SampledLoop::of(robot));
        let schedule: Vec<_> =
            schedule.iter().map(|node| Scheduled::new(robot, node)).collect::<Result<_, _>>()?;
        let mut warnings = Vec::new();
        if !margins.stable {
            warnings.push(unstable(robot, ""));
        }
        for node in schedule.iter().filter(|node| !node.margins.stable) {
            warnings.push(unstable(robot, &format!(" at a leg height of {:.4} m", node.leg_height_m)));
        }
        Ok(Self {
            a: rows(&a),
            b: rows(&b),
            k: rows(&design.gain),
            p: rows(&design.cost),
            poles: design.poles.iter().map(|pole| [pole.re, pole.im]).collect(),
            riccati_residual: design.riccati_residual,
            margins: margins.into(),
            schedule,
            warnings,
        })
    }
}

impl Scheduled {
    fn new(robot: &RobotModel, node: &ScheduleNode) -> Result<Self, Failure> {
        let raised = robot.at_leg_height(node.leg_height_m).map_err(Failure::from_error)?;
        let linear = raised.parameters.linear_model();
        let margins = lqr::margins(&linear, &node.gain, &SampledLoop::of(&raised));
        Ok(Self { leg_height_m: node.leg_height_m, k: rows(&node.gain), margins: margins.into() })
    }
}

impl From<Margins> for MarginKeys {
    fn from(margins: Margins) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        Self {
            gain_up: finite(margins.gain_up),
            gain_down: margins.gain_down,
            phase_rad: margins.phase_rad,
            delay_s: finite(margins.delay_s),
            crossover_rad_s: margins.crossover_rad_s,
            stable: margins.stable,
        }
    }
}

fn unstable(robot: &RobotModel, place: &str) -> String {
    format!(
        "the sampled closed loop is unstable{place} ({}): reduce q relative to r, or shorten the delay",
        timing(robot)
    )
}

/// Describes the loop that the margins are for.
fn timing(robot: &RobotModel) -> String {
    let (delay_s, imu) = (robot.torque_delay_s(), robot.with_effects_declared().sensors);
    let latency = match imu.imu_latency_s {
        0.0 => String::new(),
        age_s => format!(", {} ms old", short(1e3 * age_s)),
    };
    format!("control at 1000 Hz, delay {} ms, IMU at {} Hz{latency}", short(1e3 * delay_s), imu.imu_rate_hz)
}

fn short(value: f64) -> String {
    format!("{value:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Returns the rows of a matrix.
pub(crate) fn rows<R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<f64, R, C>>(
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn print(out: &mut dyn Write, name: &str, design: &LqrDesign, gains: &Gains) -> io::Result<()> {
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
    writeln!(out, "\nmargins of the sampled closed loop")?;
    print_margins(out, &gains.margins)?;
    if !gains.schedule.is_empty() {
        print_schedule(out, &gains.schedule)?;
    }
    writeln!(out, "\nRiccati residual {:.1e} (relative to P)", design.riccati_residual)
}

fn print_margins(out: &mut dyn Write, margins: &MarginKeys) -> io::Result<()> {
    if !margins.stable {
        return writeln!(out, "  none: unstable");
    }
    let MarginKeys { gain_up, gain_down, phase_rad, delay_s, crossover_rad_s, .. } = margins;
    let up = gain_up.map_or("any more".to_owned(), |factor| format!("{factor:.2}"));
    let delay = delay_s.map_or("any".to_owned(), |delay_s| format!("{:.1}", 1e3 * delay_s));
    writeln!(out, "  gain   {gain_down:.3} to {up} times")?;
    writeln!(out, "  phase  {:.1} deg at {crossover_rad_s:.1} rad/s", phase_rad.to_degrees())?;
    writeln!(out, "  delay  {delay} ms additional")
}

fn print_schedule(out: &mut dyn Write, schedule: &[Scheduled]) -> io::Result<()> {
    writeln!(out, "\ngains over leg height, m")?;
    writeln!(
        out,
        "{:10}{:8}{:>14}{:>14}{:>14}{:>14}{:>11}{:>11}",
        "height", "motor", "N m/m", "N m s/m", "N m/rad", "N m s/rad", "phase deg", "delay ms"
    )?;
    for node in schedule {
        for (motor, row) in ["left", "right"].iter().zip(&node.k) {
            write!(out, "{:<10.4}{motor:8}", node.leg_height_m)?;
            for entry in row {
                write!(out, "{entry:>14.6}")?;
            }
            let delay =
                node.margins.delay_s.map_or("any".to_owned(), |delay_s| format!("{:.1}", 1e3 * delay_s));
            writeln!(out, "{:>11.1}{delay:>11}", node.margins.phase_rad.to_degrees())?;
        }
    }
    Ok(())
}
