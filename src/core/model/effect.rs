//! An effect of a certain size, as `[[effects]]` of a model file has it. [`crate::effects`] makes it and knows its
//! physics.

use super::Motor;

/// An effect as in `[[effects]]` of a model file; its parameters have been checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    pub(crate) id: &'static str,
    pub(crate) motor: Option<Motor>,
    pub(crate) parameters: Vec<(String, f64)>,
    /// True if a controller may cancel it, where its kind can be.
    pub(crate) fed: bool,
}

impl Effect {
    /// Its name.
    pub fn id(&self) -> &'static str {
        self.id
    }

    /// The motor that it is in; none for both, and for effects that are in no motor.
    pub fn motor(&self) -> Option<Motor> {
        self.motor
    }

    /// Keys, units included, and values, in the order of the model file.
    pub fn parameters(&self) -> &[(String, f64)] {
        &self.parameters
    }

    /// A parameter's value; none for a key that it does not have.
    pub fn get(&self, key: &str) -> Option<f64> {
        self.parameters.iter().find(|(name, _)| name == key).map(|&(_, value)| value)
    }
}
