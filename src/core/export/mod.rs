//! A controller in the forms that a robot's firmware or a script takes over.

mod c_header;
mod tree;

use serde::Serialize;

use crate::control::BalanceController;
use crate::friction::{Compensation, Feedforward, StribeckParameters};

/// Forms of an exported controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// C99 header with the numbers and the control law as inline functions.
    CHeader,
    /// One JSON object.
    Json,
    /// YAML with the same tree as the JSON object.
    Yaml,
    /// `key,value` rows, keys joined by dots.
    Csv,
}

/// Everything that the control law u = −K X + friction feedforward needs, SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controller {
    /// Name of the model.
    pub name: String,
    /// Columns of the gain.
    pub state: [&'static str; 4],
    /// K of either motor, N m per unit of the state.
    pub gain: Motors<[f64; 4]>,
    /// Largest torque of one motor, N m; absent if unlimited.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
    /// Friction feedforward; absent where no motor has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feedforward: Option<Motors<Option<FeedforwardNumbers>>>,
}

/// One value for each motor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Motors<T> {
    /// Left motor.
    pub left: T,
    /// Right motor.
    pub right: T,
}

/// Numbers of one motor's friction feedforward (Eq. 29).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FeedforwardNumbers {
    /// Ratio and smoothing speed.
    #[serde(flatten)]
    pub compensation: Compensation,
    /// The friction that is fed forward.
    #[serde(flatten)]
    pub friction: StribeckParameters,
}

impl From<Feedforward> for FeedforwardNumbers {
    fn from(feedforward: Feedforward) -> Self {
        Self { compensation: *feedforward.compensation(), friction: *feedforward.curve().parameters() }
    }
}

impl Controller {
    /// Gathers the numbers of a controller under the name of its model.
    pub fn new(name: &str, controller: &BalanceController) -> Self {
        let row = |motor| std::array::from_fn(|state| controller.gain[(motor, state)]);
        let [left, right] =
            controller.feedforward.map(|feedforward| feedforward.map(FeedforwardNumbers::from));
        let limit = controller.torque_limit_nm;
        Self {
            name: name.to_owned(),
            state: ["x_m", "x_dot_m_s", "pitch_rad", "pitch_rate_rad_s"],
            gain: Motors { left: row(0), right: row(1) },
            torque_limit_nm: limit.is_finite().then_some(limit),
            feedforward: (left.is_some() || right.is_some()).then_some(Motors { left, right }),
        }
    }

    /// The controller as text.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::CHeader => c_header::render(self),
            Format::Json => tree::json(self),
            Format::Yaml => tree::yaml(self),
            Format::Csv => tree::csv(self),
        }
    }
}
