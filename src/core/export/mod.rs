//! A controller in the forms that a robot's firmware or a script takes over.

mod c_header;
mod tree;

use nalgebra::Matrix2x4;
use serde::Serialize;

use crate::control::{BalanceController, GainSchedule, ScheduleNode};
use crate::friction::{Compensation, Feedforward, StribeckParameters};
use crate::model::{Effect, YawHold};

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

/// Everything that the control law u = K (X̃ − X) + yaw hold + friction feedforward needs, SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controller {
    /// Name of the model.
    pub name: String,
    /// Columns of the gain.
    pub state: [&'static str; 4],
    /// K of either motor, N m per unit of the state.
    pub gain: Motors<[f64; 4]>,
    /// Gains over leg height; absent for a robot of one height.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub schedule: Vec<Scheduled>,
    /// Heading control: torque of one motor, opposite to the other's.
    pub yaw_hold: YawHold,
    /// r in x = r (q + pitch), m.
    pub wheel_radius_m: f64,
    /// In yaw = r (q_right − q_left) / track, m.
    pub track_width_m: f64,
    /// Largest torque of one motor, N m; absent if unlimited.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_limit_nm: Option<f64>,
    /// Friction feedforward; absent where no motor has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feedforward: Option<Motors<Option<FeedforwardNumbers>>>,
    /// Effects inside the motors that the controller feeds forward, as in the model file; the C header names them and
    /// leaves them out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
}

/// The gain at one leg height.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scheduled {
    /// Height, m; between heights the gain is linear, beyond them that of the end.
    pub leg_height_m: f64,
    /// K of either motor at that height.
    pub gain: Motors<[f64; 4]>,
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

impl From<&Matrix2x4<f64>> for Motors<[f64; 4]> {
    fn from(gain: &Matrix2x4<f64>) -> Self {
        let row = |motor| std::array::from_fn(|state| gain[(motor, state)]);
        Self { left: row(0), right: row(1) }
    }
}

impl Controller {
    /// Gathers the numbers of a controller under the name of its model; with the schedule of a robot whose legs
    /// have several heights.
    pub fn new(name: &str, controller: &BalanceController, schedule: Option<&GainSchedule>) -> Self {
        let [left, right] =
            controller.feedforward.map(|feedforward| feedforward.map(FeedforwardNumbers::from));
        let limit = controller.torque_limit_nm;
        Self {
            name: name.to_owned(),
            state: ["x_m", "x_dot_m_s", "pitch_rad", "pitch_rate_rad_s"],
            gain: Motors::from(&controller.gain),
            schedule: schedule.map_or(&[][..], GainSchedule::nodes).iter().map(scheduled).collect(),
            yaw_hold: controller.yaw_hold,
            wheel_radius_m: controller.odometry.wheel_radius_m,
            track_width_m: controller.odometry.track_width_m,
            torque_limit_nm: limit.is_finite().then_some(limit),
            feedforward: (left.is_some() || right.is_some()).then_some(Motors { left, right }),
            effects: controller.effects.as_ref().map_or(Vec::new(), |effects| effects.effects().to_vec()),
        }
    }

    /// The controller as text.
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// # let linear = robot.parameters.linear_model();
    /// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
    /// # use flqr_core::control::{BalanceController, ControllerKind};
    /// use flqr_core::export::{Controller, Format};
    ///
    /// let controller = BalanceController::new(ControllerKind::Flqr, robot, gain)?;
    /// let header = Controller::new("robot", &controller, None).render(Format::CHeader);
    /// assert!(header.contains("#include <math.h>"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::CHeader => c_header::render(self),
            Format::Json => tree::json(self),
            Format::Yaml => tree::yaml(self),
            Format::Csv => tree::csv(self),
        }
    }
}

fn scheduled(node: &ScheduleNode) -> Scheduled {
    Scheduled { leg_height_m: node.leg_height_m, gain: Motors::from(&node.gain) }
}
