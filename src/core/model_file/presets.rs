//! The models that come with the program, compiled in so that it starts without any file.

use crate::model::Model;

/// Name and TOML text of each preset; the text says where every number comes from.
pub const ALL: [(&str, &str); 3] = [
    ("paper", include_str!("../../../presets/paper.toml")),
    ("light", include_str!("../../../presets/light.toml")),
    ("tall", include_str!("../../../presets/tall.toml")),
];

/// The robot of the paper.
pub fn paper() -> Model {
    let [(name, text), ..] = ALL;
    Model::from_toml(text, name).expect("a test loads every preset")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_loads_and_carries_weights_friction_and_compensation() {
        for (name, text) in ALL {
            let model = Model::from_toml(text, name).unwrap();
            let robot = model.robot().unwrap();
            assert!(robot.weights.is_some() && robot.compensation.is_some(), "{name}");
            assert!(robot.friction.iter().all(Option::is_some), "{name}");
        }
        assert_eq!(ALL[0].0, "paper");
    }

    #[test]
    fn only_the_papers_robot_is_called_so() {
        assert_eq!(ALL.iter().filter(|(name, _)| name.contains("paper")).count(), 1);
    }
}
