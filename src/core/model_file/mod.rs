//! Model files: TOML to a checked model, and back.
//!
//! A file describes a wheel-legged robot (`[robot]`) or a single motor or axis (`[axis]`). Every error names the
//! file, the line, the key and the remedy. An unknown key is an error, because a misspelt key would silently leave
//! its default.

mod axis_schema;
mod changes;
mod effects_schema;
mod entries;
mod persistence;
mod phrases;
mod plausibility;
pub mod presets;
mod refusal;
mod renamed_keys;
mod robot_schema;
mod tolerance;

use std::borrow::Cow;

use serde::Deserialize;

use crate::model::{Model, Rig};
use axis_schema::AxisFile;
pub use changes::Change;
pub use entries::Entry;
pub use plausibility::ModelWarning;
use refusal::Refusal;
pub use renamed_keys::{RenamedKey, renamed_keys};
use robot_schema::RobotFile;

/// Reason why a model file could not be loaded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}:{column}: {problem}")]
pub struct ModelFileError {
    /// The file as the user named it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in bytes, from 1.
    pub column: usize,
    /// Problem and remedy.
    pub problem: String,
}

impl Model {
    /// Loads a model from the text of a file; `file` is only for messages.
    ///
    /// # Errors
    /// Text that is not TOML, a missing or unknown key, a value of the wrong type or out of range.
    ///
    /// ```
    /// use flqr_core::model::Model;
    ///
    /// let text = "name = \"motor\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.01\n";
    /// let model = Model::from_toml(text, "motor.toml")?;
    /// assert!(model.robot().is_none());
    ///
    /// let error = Model::from_toml(&text.replace("inertia_kg_m2", "inertia"), "motor.toml").unwrap_err();
    /// assert!(error.to_string().starts_with("motor.toml:2:1: unknown key `inertia`"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str, file: &str) -> Result<Self, ModelFileError> {
        let error = |byte, problem| {
            let (line, column) = position_at(text, byte);
            ModelFileError { file: file.to_owned(), line, column, problem }
        };
        let start = |e: &toml::de::Error| e.span().map_or(0, |span| span.start);
        let not_toml = |e: toml::de::Error| error(start(&e), phrases::not_toml(e.message(), text, start(&e)));
        let unread = |e: toml::de::Error| error(start(&e), phrases::unread(e.message(), text, start(&e)));
        let mut document = toml::de::DeTable::parse(text).map_err(not_toml)?;
        renamed_keys::rename(document.get_mut()).map_err(|(byte, problem)| error(byte, problem))?;
        let has = |table: &str| document.get_ref().contains_key(table);
        let reader = || toml::de::Deserializer::from(document.clone());
        let model = match (has("robot"), has("axis")) {
            (true, false) => RobotFile::deserialize(reader()).map_err(unread)?.into_model(),
            (false, true) => AxisFile::deserialize(reader()).map_err(unread)?.into_model(),
            (true, true) => Err(Refusal::new(
                &["axis"],
                "a model describes either a [robot] or an [axis]: remove one table",
            )),
            (false, false) => Err(Refusal::new(
                &[],
                "a model needs a [robot] table, or an [axis] table for a single motor or carriage: add one",
            )),
        };
        model.map_err(|refusal| error(start_of(document.get_ref(), &refusal.path), refusal.problem))
    }

    /// The model as TOML that [`Model::from_toml`] reads back to an equal model.
    ///
    /// ```
    /// use flqr_core::model::Model;
    /// use flqr_core::model_file::presets;
    ///
    /// let model = presets::paper();
    /// assert_eq!(Model::from_toml(&model.to_toml(), "copy.toml")?, model);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_toml(&self) -> String {
        let text = match &self.rig {
            Rig::Robot(robot) => toml::to_string(&RobotFile::from_model(self, robot)),
            Rig::Axis(axis) => toml::to_string(&AxisFile::from_model(self, axis)),
        };
        text.expect("plain numbers and strings always have a TOML form")
    }
}

/// Line and column, from 1, of a byte.
fn position_at(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |newline| newline + 1);
    (1 + before.iter().filter(|&&b| b == b'\n').count(), 1 + before.len() - line_start)
}

/// First byte of the deepest key of `path` that the document has; 0 where it has none. The key of a list is followed by
/// a number from 0.
fn start_of(document: &toml::de::DeTable<'_>, path: &[Cow<'static, str>]) -> usize {
    let mut table = document;
    let mut start = 0;
    let mut path = path.iter();
    while let Some(key) = path.next() {
        let Some((name, value)) = table.get_key_value(&**key) else { break };
        start = name.span().start;
        let value = value.get_ref();
        let member = value.as_array().and_then(|array| array.get(path.next()?.parse::<usize>().ok()?));
        let Some(inner) = member.map_or(value, |member| member.get_ref()).as_table() else { break };
        table = inner;
    }
    start
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{AxisParameters, Effect, RobotParameters, Weights};

    const ROBOT: &str = r#"name = "test"
[robot]
body_mass_kg = 13.0
wheel_mass_kg = 1.0
wheel_inertia_kg_m2 = 0.005
wheel_radius_m = 0.1
com_height_m = 0.25
body_inertia_kg_m2 = 0.25
[friction.left]
coulomb_nm = 0.0338
static_nm = 0.0761
viscous_nm_s_rad = 0.00049
stribeck_speed_rad_s = 1.612
stribeck_exponent = 0.231
offset_nm = -0.0016
[lqr]
q_diagonal = [60.0, 30.0, 100.0, 5.0]
r_diagonal = [20.0, 20.0]
"#;

    const RAIL: &str = r#"name = "rail"
[axis]
kind = "linear"
mass_kg = 95.0
[friction]
coulomb_n = 20.4
viscous_n_s_m = 203.5
offset_n = -3.2
"#;

    #[test]
    fn robot_and_axis_survive_the_round_trip() {
        let full = ROBOT.replace(
            "q_diagonal = [60.0, 30.0, 100.0, 5.0]",
            "q = [[60.0,1.0,0.0,0.0],[1.0,30.0,0.0,0.0],[0.0,0.0,100.0,0.0],[0.0,0.0,0.0,5.0]]",
        );
        for text in [ROBOT, RAIL, &full] {
            let model = Model::from_toml(text, "m.toml").unwrap();
            assert_eq!(Model::from_toml(&model.to_toml(), "again").unwrap(), model, "{}", model.to_toml());
        }
    }

    /// Every table that is not needed, and legs.
    const WHOLE: &str = r#"name = "whole"
[robot]
body_mass_kg = 13.0
wheel_mass_kg = 1.0
wheel_inertia_kg_m2 = 0.005
wheel_radius_m = 0.1
leg_height_m = 0.37
com_height_m = { leg_height_m = [0.32, 0.42], com_height_m = [0.10, 0.14] }
body_inertia_kg_m2 = { leg_height_m = [0.32, 0.37, 0.42], body_inertia_kg_m2 = [0.08, 0.1, 0.13] }
[chassis]
track_width_m = 0.36
[yaw_hold]
stiffness_nm_rad = 1.5
damping_nm_s_rad = 0.3
[limits]
torque_nm = 2.42
rated_speed_rad_s = 51.3
no_load_speed_rad_s = 60.0
[actuation]
delay_s = 0.006
[sensors]
imu_rate_hz = 200.0
[surroundings]
slope_rad = 0.05
tether = { stiffness_n_m = 12.0, anchor_m = -0.05 }
payload = { mass_kg = 1.0, height_m = 0.2 }
ground = [{}, { points_m = [[0.5, 0.0], [0.8, 0.03]] }]
"#;

    #[test]
    fn legs_and_every_further_table_survive_the_round_trip() {
        let model = Model::from_toml(WHOLE, "m.toml").unwrap();
        assert_eq!(Model::from_toml(&model.to_toml(), "again").unwrap(), model, "{}", model.to_toml());
        let robot = model.robot().unwrap();
        assert!((robot.parameters.com_height_m - 0.12).abs() < 1e-15);
        assert_eq!(robot.parameters.body_inertia_kg_m2, 0.1);
        let raised = robot.at_leg_height(0.42).unwrap();
        assert_eq!((raised.parameters.com_height_m, raised.parameters.body_inertia_kg_m2), (0.14, 0.13));
        assert_eq!(robot.at_leg_height(0.5).unwrap_err().name, "leg_height_m");
        let mut corrected = robot.clone();
        corrected.set_parameters(RobotParameters { com_height_m: 0.06, ..robot.parameters });
        assert!((corrected.at_leg_height(0.42).unwrap().parameters.com_height_m - 0.07).abs() < 1e-15);
        assert_eq!(robot.sensors.imu_period_ticks(), 5);
        assert_eq!(robot.surroundings.tether.unwrap().stiffness_n_m, 12.0);
        // Files from before there was a choice of protocols mean its default, which is not written.
        let named = Model::from_toml(&format!("{WHOLE}[link]\nprotocol = \"lk\"\n"), "m.toml").unwrap();
        assert!(named == model && !model.to_toml().contains("protocol"));
    }

    #[test]
    fn each_mistake_in_a_further_table_is_named_with_its_line() {
        for (old, new, line, part) in [
            ("leg_height_m = 0.37\n", "", 7, "needs the present leg_height_m"),
            ("leg_height_m = 0.37", "leg_height_m = 0.5", 7, "leg_height_m = 0.5 is out of range"),
            ("com_height_m = [0.10, 0.14]", "com_height_m = [0.10]", 8, "has 2 values and com_height_m 1"),
            ("[0.32, 0.42]", "[0.42, 0.32]", 8, "0.32 follows 0.42"),
            ("com_height_m = [0.10, 0.14] }", "com_hight_m = [0.10, 0.14] }", 8, "a table with the lists"),
            ("imu_rate_hz = 200.0", "imu_rate_hz = 300.0", 22, "divides 1000"),
            ("no_load_speed_rad_s = 60.0", "no_load_speed_rad_s = 50.0", 18, "above rated_speed_rad_s"),
            ("slope_rad = 0.05", "slope_rad = 2.0", 24, "slope_rad = 2 is out of range"),
            ("[sensors]", "[link]\nprotocol = \"can\"\n[sensors]", 22, "`lk`"),
            ("delay_s = 0.006", "delay = 0.006", 20, "unknown key `delay`: write `delay_s`"),
        ] {
            let error = Model::from_toml(&WHOLE.replacen(old, new, 1), "m.toml").unwrap_err();
            assert!(
                error.line == line && error.problem.contains(part),
                "{error} (expected line {line}, {part})"
            );
        }
    }

    const COGGING: &str = r#"
[[effects]]
id = "cogging"
motor = "left"
order_1 = 14
cos_1_nm = 0.002
sin_1_nm = -0.008
order_2 = 7
cos_2_nm = 0.001
sin_2_nm = 0.0

[[effects]]
id = "tether_spring"
stiffness_n_m = 12.0
"#;
    const RAIL_EFFECTS: &str = r#"
[[effects]]
id = "cogging"
period_1_m = 0.01
cos_1_n = 2.0
sin_1_n = 0.5
"#;

    #[test]
    fn effects_survive_the_round_trip_in_their_order() {
        for (text, ids) in [
            (format!("{ROBOT}{COGGING}"), vec!["cogging", "tether_spring"]),
            (format!("{RAIL}{RAIL_EFFECTS}"), vec!["cogging"]),
        ] {
            let model = Model::from_toml(&text, "m.toml").unwrap();
            let written = model.to_toml();
            assert_eq!(Model::from_toml(&written, "again").unwrap(), model, "{written}");
            let effects = match &model.rig {
                Rig::Robot(robot) => &robot.effects,
                Rig::Axis(axis) => &axis.effects,
            };
            assert_eq!(effects.iter().map(Effect::id).collect::<Vec<_>>(), ids);
            assert!(written.contains("[[effects]]\nid = \"cogging\""), "{written}");
        }
        let model = Model::from_toml(&format!("{ROBOT}{COGGING}"), "m.toml").unwrap();
        let [cogging, tether] = &model.robot().unwrap().effects[..] else { panic!("{model:?}") };
        assert_eq!((cogging.get("order_2"), cogging.motor()), (Some(7.0), Some(crate::model::Motor::Left)));
        assert_eq!((tether.get("pull_n"), tether.motor()), (Some(0.0), None));
        assert!(
            model.to_toml().contains("order_1 = 14.0\ncos_1_nm = 0.002\nsin_1_nm = -0.008\norder_2 = 7.0")
        );
    }

    #[test]
    fn errors_of_declared_numbers_put_these_right() {
        let added = |id: &str, key: &str, value: f64| {
            let text = format!("{ROBOT}[[effects]]\nid = \"{id}\"\n{key} = {value}\n");
            let model = Model::from_toml(&text, "m.toml").unwrap();
            assert_eq!(model.robot().unwrap().effects, [], "{id}");
            model.robot().unwrap().clone()
        };
        assert_eq!(added("mass_error", "mass_kg", 0.5).parameters.body_mass_kg, 13.5);
        assert_eq!(added("com_height_error", "height_m", -0.05).parameters.com_height_m, 0.2);
        assert_eq!(added("body_inertia_error", "inertia_kg_m2", 0.25).parameters.body_inertia_kg_m2, 0.5);
        assert_eq!(added("inertia_error", "inertia_kg_m2", 0.005).parameters.wheel_inertia_kg_m2, 0.01);
        let [left, right] = added("viscous_error", "viscous_nm_s_rad", 0.001).friction;
        assert!((left.unwrap().parameters().viscous_nm_s_rad - 0.00149).abs() < 1e-15);
        assert_eq!(right.unwrap().parameters().viscous_nm_s_rad, 0.001);
        let rail = format!("{RAIL}[[effects]]\nid = \"inertia_error\"\nmass_kg = 5.0\n");
        let Rig::Axis(axis) = Model::from_toml(&rail, "m.toml").unwrap().rig else { panic!("no axis") };
        assert!(matches!(axis.parameters, AxisParameters::Linear { mass_kg: 100.0, .. }), "{axis:?}");
    }

    #[test]
    fn each_mistake_in_an_effect_is_named_with_its_line() {
        let lines = ROBOT.lines().count();
        let robot = |old: &str, new: &str| format!("{ROBOT}{}", COGGING.replacen(old, new, 1));
        for (text, line, part) in [
            (robot("\"cogging\"", "\"coging\""), lines + 3, "unknown effect coging: use one of cogging,"),
            (robot("\"cogging\"", "3"), lines + 3, "id = 3 is not a name"),
            (robot("\"left\"", "\"middle\""), lines + 4, "use \"left\", \"right\" or \"both\""),
            (robot("order_1 = 14", "order_1 = 14.5"), lines + 5, "must be a whole number"),
            (robot("cos_1_nm", "cos_1"), lines + 6, "no parameter cos_1: use order_1, cos_1_nm, sin_1_nm"),
            (robot("0.002", "\"much\""), lines + 6, "cos_1_nm = \"much\" is not a number"),
            (robot("sin_2_nm = 0.0", ""), lines + 3, "cogging lacks sin_2_nm (sine part): add it"),
            (robot("12.0", "nan"), lines + 14, "stiffness_n_m = NaN of tether_spring is out of range"),
            (robot("12.0", "12.0\nmotor = \"left\""), lines + 15, "does not act on one motor"),
            (format!("{ROBOT}[[effects]]\nstiffness_n_m = 1.0\n"), lines + 2, "an effect needs its id"),
            (format!("{ROBOT}[[effects]]\n"), lines + 1, "an effect needs its id"),
            (
                format!("{ROBOT}[[effects]]\nid = \"mass_error\"\nmass_kg = -20.0\n"),
                lines + 2,
                "physically impossible",
            ),
            (format!("{RAIL}[[effects]]\nid = \"tether_spring\"\n"), 10, "does not apply to a linear axis"),
            (
                format!("{RAIL}{}", RAIL_EFFECTS.replace("period_1_m", "order_1")),
                12,
                "use period_1_m, cos_1_n",
            ),
        ] {
            let error = Model::from_toml(&text, "m.toml").unwrap_err();
            assert!(
                error.line == line && error.problem.contains(part),
                "{error} (expected line {line}, {part})"
            );
        }
    }

    #[test]
    fn values_arrive_where_they_belong() {
        let model = Model::from_toml(ROBOT, "m.toml").unwrap();
        let robot = model.robot().unwrap();
        assert_eq!(robot.parameters.gravity_m_s2, 9.81);
        assert_eq!(robot.friction[0].unwrap().parameters().static_nm, 0.0761);
        assert_eq!(robot.friction[1], None);
        assert_eq!(robot.weights.unwrap(), Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0, 20.0]));
        let Rig::Axis(axis) = Model::from_toml(RAIL, "r").unwrap().rig else {
            panic!("an axis was read as something else");
        };
        let AxisParameters::Linear { mass_kg, friction } = axis.parameters else {
            panic!("a linear axis was read as a rotary one");
        };
        // Without the Stribeck keys the curve is plain Coulomb friction at every speed.
        assert_eq!((mass_kg, friction.unwrap().amplitude_nm(0.01)), (95.0, 20.4));
    }

    #[test]
    fn each_mistake_is_named_with_its_line() {
        for (text, line, part) in [
            (
                ROBOT.replace("com_height_m", "com_hight_m"),
                7,
                "unknown key `com_hight_m`: write `com_height_m`, the most similar key, or remove it; known keys: ",
            ),
            (
                ROBOT.replace("body_mass_kg = 13.0", "body_mass_kg = -13.0"),
                3,
                "body_mass_kg = -13 is out of range",
            ),
            (ROBOT.replace("static_nm = 0.0761", "static_nm = nan"), 11, "static_nm = NaN is out of range"),
            (ROBOT.replace("wheel_radius_m = 0.1\n", ""), 2, "missing key `wheel_radius_m`: add it here"),
            (ROBOT.replace("13.0", "\"heavy\""), 3, "`body_mass_kg = \"heavy\"`"),
            (ROBOT.replace("[lqr]", "[lqr]\nr = [[1.0, 0.0], [0.0, 1.0]]"), 17, "remove one"),
            (ROBOT.replace("r_diagonal = [20.0, 20.0]", ""), 16, "r_diagonal"),
            (ROBOT.replace("r_diagonal = [20.0, 20.0]", "r_diagonal = [20.0]"), 18, "length"),
            (ROBOT.replace("[lqr]", "[lqr"), 16, "in `[lqr`"),
            (ROBOT.replace("13.0", "13,0"), 3, "in `body_mass_kg = 13,0`"),
            ("name = \"x\"\n".to_owned(), 1, "[robot]"),
            (
                ROBOT.replace("[friction.left]", "[axis]\nkind = \"linear\"\nmass_kg = 1.0\n[friction.left]"),
                9,
                "either",
            ),
            (RAIL.replace("coulomb_n ", "coulomb_nm "), 6, "coulomb_nm"),
            (RAIL.replace("coulomb_n = 20.4", "static_n = 20.4"), 5, "coulomb_n"),
        ] {
            let error = Model::from_toml(&text, "m.toml").unwrap_err();
            assert!(
                error.line == line && error.problem.contains(part),
                "{error} (expected line {line}, {part})"
            );
            assert!(!error.to_string().contains('\n') && !error.problem.contains("f64"), "{error}");
        }
    }

    /// The last line of a file without a line feed is wrong, and not cut.
    #[test]
    fn a_wrong_last_line_is_not_told_as_a_cut() {
        for (last, part) in
            [("gravity_m_s2 = 9,81", "9,81"), ("name = \"a\"", "duplicate key"), ("q_diagonal = 1 2", "1 2")]
        {
            let error = Model::from_toml(&format!("name = \"a\"\n{last}"), "m.toml").unwrap_err();
            assert!(error.problem.contains(part) && !error.problem.contains("ends"), "{error}");
        }
    }

    /// A cut within a word, within a list, behind a value and within a table.
    #[test]
    fn a_file_that_was_cut_off_is_told_as_one() {
        for (last, line, part) in [
            ("wheel_ra", 6, "the file ends in the middle of `wheel_ra`: complete the line"),
            ("q_diagonal = [60.0, 30", 17, "the file ends in the middle of `q_diagonal = [60.0, 30`"),
            (
                "wheel_inertia_kg_m2 = 0.00",
                2,
                "missing key `wheel_radius_m`: add it here; the file ends in this table",
            ),
            ("static_nm = 0.0761\n", 9, "truncated, use the complete file"),
        ] {
            let (before, _) = ROBOT.split_once(last).unwrap();
            let error = Model::from_toml(&format!("{before}{last}"), "m.toml").unwrap_err();
            assert!(
                error.line == line && error.problem.contains(part),
                "{error} (expected line {line}, {part})"
            );
        }
    }
}
