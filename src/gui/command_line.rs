//! The command that does in a terminal what a page shows, ready to be pasted into a shell.

use std::path::Path;

use flqr_core::control::{ControllerKind, drive::Excitation};
use flqr_core::device::{SessionMode, SessionOptions, Source};
use flqr_core::identify::{Bounds, FitOptions, Method};
use flqr_core::model::Motor;
use flqr_core::record::Mapping;

use crate::shell_word::quoted;

/// A command that grows by words.
struct Line(String);

impl Line {
    fn new(command: &str) -> Self {
        Self(format!("flqr {command}"))
    }

    fn word(mut self, word: impl AsRef<str>) -> Self {
        self.0.push(' ');
        self.0 += &quoted(word.as_ref());
        self
    }

    fn flag(self, flag: &str, value: impl AsRef<str>) -> Self {
        self.word(flag).word(value)
    }

    /// The model's file; a name to be replaced where no file holds it.
    fn model(self, model: Option<&Path>) -> Self {
        self.word(model_name(model))
    }
}

fn model_name(model: Option<&Path>) -> String {
    model.map_or_else(|| "MODEL.toml".to_owned(), |path| path.display().to_string())
}

/// The gains of a model; `model` is the file that holds it.
pub fn gains(model: Option<&Path>) -> String {
    Line::new("gains").model(model).0
}

/// A fit of `log`; `model` is given where parameters are held at its values, with its file if one holds it.
pub fn fit(
    log: &Path,
    map: &[Mapping],
    motor: Motor,
    options: &FitOptions,
    model: Option<Option<&Path>>,
) -> String {
    let mut line = Line::new("fit").word(log.display().to_string());
    if let Some(model) = model {
        line = line.flag("--model", model_name(model));
    }
    if motor == Motor::Right {
        line = line.flag("--motor", "right");
    }
    if options.method == Method::Pso {
        line = line.flag("--method", "pso");
    }
    if options.bounds == Bounds::Paper {
        line = line.flag("--bounds", "paper");
    }
    if !options.estimate.is_empty() {
        line = line.flag("--estimate", options.estimate.join(","));
    }
    for mapping in map {
        line = line.flag("--map", mapping.to_string());
    }
    line.flag("--seed", options.seed.to_string()).0
}

/// Commands of a robot connection: monitor, or drive. Arming remains a separate step.
pub fn robot(
    options: &SessionOptions,
    signals: &[&str],
    controller: ControllerKind,
    model: Option<&Path>,
) -> String {
    let source = options.source.to_string();
    let line = match &options.mode {
        SessionMode::Listen => Line::new("monitor").word(source).flag("--model", model_name(model)),
        SessionMode::Drive { excitation, .. } => {
            let line = Line::new("drive").word(source).model(model);
            driven(line, excitation).flag(
                "--controller",
                match controller {
                    ControllerKind::Lqr => "lqr",
                    ControllerKind::Flqr => "flqr",
                },
            )
        }
    };
    let mut line = match &options.imu {
        Some(imu) => line.flag("--imu", imu.to_string()),
        None => line,
    };
    if let (Some(described), SessionMode::Listen) = (&options.dbc, &options.mode) {
        line = line.flag("--dbc", described.file.display().to_string());
        for signal in signals {
            line = line.flag("--signal", signal);
        }
    }
    if let Source::Replay { .. } = options.source {
        line = line.flag("--speed", options.replay_speed.to_string());
    }
    line.0
}

fn driven(line: Line, excitation: &Excitation) -> Line {
    match excitation {
        Excitation::Balance => line,
        Excitation::BalanceMultisine => line.flag("--run", "multisine"),
        Excitation::SpeedSweep { seconds } => {
            line.flag("--run", "friction-sweep").flag("--seconds", seconds.to_string())
        }
        Excitation::Multisine { seconds } => {
            line.flag("--run", "air-multisine").flag("--seconds", seconds.to_string())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_differs_from_the_usual_is_said_and_words_are_quoted() {
        assert_eq!(gains(None), "flqr gains MODEL.toml");
        assert_eq!(gains(Some(Path::new("a robot.toml"))), "flqr gains 'a robot.toml'");
        let map = ["torque_nm=Motor current*0.32".parse().unwrap()];
        let usual = FitOptions::default();
        let line = fit(Path::new("log.csv"), &[], Motor::Left, &usual, None);
        assert_eq!(line, format!("flqr fit log.csv --seed {}", usual.seed));
        let options = FitOptions {
            method: Method::Pso,
            bounds: Bounds::Paper,
            estimate: vec!["coulomb_nm".into(), "offset_nm".into()],
            seed: 9,
        };
        assert_eq!(
            fit(Path::new("it's.csv"), &map, Motor::Right, &options, Some(None)),
            "flqr fit 'it'\\''s.csv' --model MODEL.toml --motor right --method pso --bounds paper --estimate coulomb_nm,offset_nm --map 'torque_nm=Motor current*0.32' --seed 9"
        );
    }
}
