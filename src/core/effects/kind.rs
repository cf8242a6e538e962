//! Kinds of effects.

use super::law::{Action, MotionSample, Term};
use super::machine::Machine;
use crate::model::Effect;
use crate::model::MachineKind;
use crate::model::{AxisModel, RobotModel};

/// Location of an effect in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Torque inside one motor.
    Motor,
    /// Horizontal force on the robot.
    Translation,
    /// Torque on the body.
    Pitch,
    /// Between the commanded torque and the shaft torque.
    Actuator,
    /// Sensors.
    Sensor,
    /// Declared parameter.
    Parameter,
}

/// True if a controller can cancel an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// From current measurements.
    Causal,
    /// By the corrected parameter, which the controller uses.
    Declared,
    /// Impossible, with the reason.
    Never(&'static str),
}

/// Role of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Nonlinear: an order, a delay, a time constant, a knee, a speed scale.
    Shape,
    /// Linear: the factor of a term.
    Amplitude,
}

/// A parameter of an effect. Of a series (see [`EffectKind::series`]) the key's `#` is a number from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Key as in the model file, unit included, on a robot and on a rotary axis.
    key: &'static str,
    /// Key on a linear axis.
    linear_key: &'static str,
    /// Description.
    pub description: &'static str,
    /// Role.
    pub role: Role,
    /// Lowest and highest value that a machine can have, on a robot and on a rotary axis.
    range: [f64; 2],
    linear_range: [f64; 2],
    /// Value where a model file leaves it out; `None` if it is required.
    pub default: Option<f64>,
    /// True if it is a whole number on a robot and on a rotary axis.
    pub whole: bool,
    /// True if it is against the motion, or pulls back: such an amplitude is not below 0.
    pub opposing: bool,
    /// True if the effect is nearly in proportion to it, though it is a shape.
    pub sized: bool,
    /// Initial values of a search.
    pub grid: Grid,
    /// See `grid`.
    pub step: Step,
}

/// Values of a shape parameter at which a search begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grid {
    /// Its default; nowhere without one.
    Default,
    /// Integers from 1 up to this one, as far as the speeds of a log resolve them.
    Orders(u32),
    /// These.
    Values(&'static [f64]),
    /// Geometric sequence: first value, factor, count.
    Geometric(f64, f64, u32),
    /// Fractions of the length of the log.
    OfLog(&'static [f64]),
    /// Fractions of the largest torque in the log.
    OfTorque(&'static [f64]),
    /// Fractions of the height of the centre of mass.
    OfHeight(&'static [f64]),
    /// Fraction of the inertia of a wheel.
    OfWheelInertia(f64),
    /// Positions along the distance travelled, spaced by the next parameter.
    Distance,
}

/// Refinement of a shape parameter in a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Not.
    Fixed,
    /// By a factor.
    Factor(f64),
    /// By a sum.
    Sum(f64),
    /// By a fraction of the height of the centre of mass.
    OfHeight(f64),
    /// By a fraction of the next parameter.
    OfNext(f64),
}

/// Form of an effect in the equations of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As its law says.
    Law,
    /// Only where the motors turn forward: half of it, and half of the error of the same in both directions.
    Forward(&'static EffectKind),
    /// Mode of the body excited by its rotation.
    Driven,
    /// Periodic ground (a row of bumps) with the second shape parameter as wavelength.
    Wave,
    /// Log with delayed IMU readings.
    Late,
}

/// Signal that the column of an effect is computed from, on a log of one motor or axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// The speed alone.
    Speed,
    /// The acceleration, and its noise.
    Acceleration,
    /// Measured torque, which then explains itself.
    MeasuredTorque,
    /// Torque of the model, for a scale error of the measured torque.
    WantedTorque,
    /// Anything else: position, direction, time.
    Other,
}

/// Search settings of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// Required significance relative to a plain effect; larger for effects that others are easily mistaken for.
    pub caution: f64,
    /// True if a machine can have several, each of a separate shape; those of a series can anyway.
    pub repeats: bool,
    /// True if it is there for a moment only, of which no other part of a log tells.
    pub brief: bool,
    /// Forms in the equations.
    pub forms: &'static [Form],
    /// Signal that its column is computed from.
    pub signal: Signal,
}

impl Trial {
    /// Settings of an ordinary effect.
    pub(super) const PLAIN: Self =
        Self { caution: 1.0, repeats: false, brief: false, forms: &[Form::Law], signal: Signal::Other };
    /// Settings of an effect that is easily mimicked by noise or other effects.
    pub(super) const fn cautious(caution: f64) -> Self {
        Self { caution, ..Self::PLAIN }
    }

    /// Sets the signal of its column.
    pub(super) const fn of(self, signal: Signal) -> Self {
        Self { signal, ..self }
    }
}

impl Parameter {
    /// A shape parameter from `lowest` to `highest`.
    pub(super) const fn shape(key: &'static str, range: [f64; 2], description: &'static str) -> Self {
        Self {
            key,
            linear_key: key,
            description,
            role: Role::Shape,
            range,
            linear_range: range,
            default: None,
            whole: false,
            opposing: false,
            sized: false,
            grid: Grid::Default,
            step: Step::Fixed,
        }
    }

    /// An amplitude from `lowest` to `highest`.
    pub(super) const fn amplitude(key: &'static str, range: [f64; 2], description: &'static str) -> Self {
        Self { role: Role::Amplitude, ..Self::shape(key, range, description) }
    }

    /// Sets key and range on a linear axis.
    pub(super) const fn linear(self, linear_key: &'static str, linear_range: [f64; 2]) -> Self {
        Self { linear_key, linear_range, ..self }
    }

    /// Sets a default.
    pub(super) const fn or(self, default: f64) -> Self {
        Self { default: Some(default), ..self }
    }

    /// Restricts it to values of 0 or above in a search.
    pub(super) const fn opposing(self) -> Self {
        Self { opposing: true, ..self }
    }

    /// Marks it as nearly proportional to the effect.
    pub(super) const fn sized(self) -> Self {
        Self { sized: true, ..self }
    }

    /// Sets the initial values and the refinement of a search.
    pub(super) const fn searched(self, grid: Grid, step: Step) -> Self {
        Self { grid, step, ..self }
    }

    /// Restricts it to integers.
    pub(super) const fn whole(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Key on a machine, unit included.
    pub fn key(&self, machine: MachineKind) -> &'static str {
        if machine == MachineKind::Linear { self.linear_key } else { self.key }
    }

    /// Lowest and highest value on a machine.
    pub fn range(&self, machine: MachineKind) -> [f64; 2] {
        if machine == MachineKind::Linear { self.linear_range } else { self.range }
    }

    /// Unit on a machine, as text: that of the key's ending, `1` for a number without one.
    pub fn unit(&self, machine: MachineKind) -> &'static str {
        unit_of(self.key(machine))
    }
}

/// Endings of keys and their units, longer ones before those that end alike.
const UNITS: [(&str, &str); 22] = [
    ("_nm_s2_rad2", "N m s²/rad²"),
    ("_n_s2_m2", "N s²/m²"),
    ("_nm_s_rad", "N m s/rad"),
    ("_n_s_m", "N s/m"),
    ("_m_s_n", "m/s/N"),
    ("_kg_m2", "kg m²"),
    ("_rad_s2", "rad/s²"),
    ("_rad_s", "rad/s"),
    ("_m_s2", "m/s²"),
    ("_nm_rad", "N m/rad"),
    ("_nm_s", "N m s"),
    ("_nm", "N m"),
    ("_n_m", "N/m"),
    ("_m_s", "m/s"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_kg", "kg"),
    ("_m2", "m²"),
    ("_n", "N"),
    ("_m", "m"),
    ("_s", "s"),
    ("", "1"),
];

/// Unit that a key's ending names; `1` where it names none.
pub fn unit_of(key: &str) -> &'static str {
    name_and_unit(key).1
}

/// A key without the ending that names its unit, and that unit; `1` where none is named.
pub fn name_and_unit(key: &str) -> (&str, &'static str) {
    if key.starts_with("order_") {
        return ("order", "1/turn");
    }
    let ends = |(ending, unit): &(&str, &'static str)| Some((key.strip_suffix(ending)?, *unit));
    UNITS.iter().find_map(ends).unwrap_or((key, "1"))
}

/// A kind of effect: all that the library knows of it.
pub struct EffectKind {
    /// Its name in model files and reports.
    pub id: &'static str,
    /// Description in one sentence.
    pub summary: &'static str,
    /// Location in the model.
    pub place: Place,
    /// Machines that it can be on.
    pub machines: &'static [MachineKind],
    /// Parameters in the order of the model file: of a series those of its first member.
    pub parameters: &'static [Parameter],
    /// Action of a harmonic of the machine's angle per unit amplitude; of a series of harmonics, whose
    /// parameters repeat, numbered from 1.
    pub wave: Option<fn(f64, &MotionSample) -> Action>,
    /// Search settings.
    pub trial: Trial,
    /// Its terms on a machine at shape parameters, which stand in the order of the parameters.
    pub(super) make_terms: fn(&Machine, &[f64]) -> Vec<Term>,
    /// The experiment that tells it from the others that look alike.
    pub separated_by: &'static str,
    /// True if a controller can cancel it.
    pub feedforward: Feedforward,
    /// Writes it into the model's declared numbers, and says whether they hold all of it.
    pub(super) declare: fn(&Effect, Declared<'_>) -> bool,
}

/// The numbers of a model.
#[derive(Debug)]
pub enum Declared<'a> {
    /// Of a robot.
    Robot(&'a mut RobotModel),
    /// Of a motor or carriage.
    Axis(&'a mut AxisModel),
}

/// Forces from outside and torques on the body.
pub(super) const NOT_INSIDE: Feedforward = Feedforward::Never(
    "a motor torque reacts on the body and cannot cancel it: the robot has to lean against it",
);

/// No number of a model can hold such an effect.
pub(super) fn undeclared(_: &Effect, _: Declared<'_>) -> bool {
    false
}

impl EffectKind {
    /// Returns whether each motor of a robot has its own.
    pub fn per_motor(&self) -> bool {
        matches!(self.place, Place::Motor | Place::Actuator)
    }

    /// Returns whether it depends on the rotor's own angle.
    pub fn by_angle(&self) -> bool {
        self.place == Place::Motor && self.series()
    }

    /// Returns whether the parameters repeat, numbered from 1, as harmonics do.
    pub fn series(&self) -> bool {
        self.wave.is_some()
    }

    /// Returns the action of a harmonic of unit amplitude on a motor or axis, N m or N; 0 without harmonics.
    pub fn harmonic_nm(&self, moment: &MotionSample) -> f64 {
        self.wave.map_or(0.0, |wave| wave(1.0, moment).on_motor_nm(moment.direction()))
    }

    /// Returns whether its waves act against the motion, so that one way they cannot be distinguished from a torque.
    pub fn harmonics_oppose(&self) -> bool {
        self.wave.is_some_and(|wave| wave(1.0, &MotionSample::default()).friction_nm != 0.0)
    }

    /// Returns whether it can be on a machine.
    pub fn is_on(&self, machine: MachineKind) -> bool {
        self.machines.contains(&machine)
    }

    /// Shape parameters, in the order that [`EffectKind::terms`] takes them; of a series, for each member.
    pub fn shapes(&self) -> impl Iterator<Item = &'static Parameter> {
        self.parameters.iter().filter(|parameter| parameter.role == Role::Shape)
    }

    /// Amplitudes; of a series, those of each member.
    pub fn amplitudes(&self) -> impl Iterator<Item = &'static Parameter> {
        self.parameters.iter().filter(|parameter| parameter.role == Role::Amplitude)
    }

    /// Its terms at unit amplitude: the columns of an estimator. `shape` holds the shape parameters in their order, of
    /// a series one after another for each member. The terms come in the order of the amplitudes' keys.
    pub fn terms(&self, machine: &Machine, shape: &[f64]) -> Vec<Term> {
        (self.make_terms)(machine, shape)
    }
}

impl std::fmt::Debug for EffectKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("EffectKind").field(&self.id).finish()
    }
}

impl PartialEq for EffectKind {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl Eq for EffectKind {}
