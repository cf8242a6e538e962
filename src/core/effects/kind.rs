//! What the library knows of a kind of effect.

use super::effect::Effect;
use super::law::{Action, Moment, Term};
use super::machine::{Machine, MachineKind};
use crate::model_file::{AxisModel, RobotModel};

/// Where an effect sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Torque inside one motor.
    Motor,
    /// Horizontal force on the robot.
    Translation,
    /// Torque on the body.
    Pitch,
    /// Between the torque that is asked for and the one on the shaft.
    Actuator,
    /// In what the sensors say.
    Sensor,
    /// In a declared number.
    Parameter,
}

/// Whether a controller can cancel an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// From what is measured now.
    Causal,
    /// By the corrected number, which the controller uses anyway.
    Declared,
    /// Not; with the reason.
    Never(&'static str),
}

/// How a parameter enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Not linearly: an order, a delay, a time constant, a knee, a speed scale.
    Shape,
    /// Linearly: the factor of a term.
    Amplitude,
}

/// A parameter of an effect. Of a series (see [`EffectKind::series`]) the key's `#` is a number from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Key as in the model file, unit included, on a robot and on a rotary axis.
    key: &'static str,
    /// The same on a linear axis.
    linear_key: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// How it enters.
    pub role: Role,
    /// Lowest and highest value that a machine can have, on a robot and on a rotary axis.
    range: [f64; 2],
    linear_range: [f64; 2],
    /// Value where a model file leaves it out; none where it has to be given.
    pub default: Option<f64>,
    /// Whether it is a whole number on a robot and on a rotary axis.
    pub whole: bool,
    /// Whether it is against the motion, or pulls back: such an amplitude is not below 0.
    pub opposing: bool,
    /// Whether the effect is nearly in proportion to it, though it is a shape.
    pub sized: bool,
    /// Where a search for the effect begins, and how it goes on from there.
    pub grid: Grid,
    /// See `grid`.
    pub step: Step,
}

/// Values of a shape parameter at which a search begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grid {
    /// Its default; nowhere without one.
    Default,
    /// Whole numbers from 1 up to this one, as far as they can be told at the speeds of a log.
    Orders(u32),
    /// These.
    Values(&'static [f64]),
    /// From this one by this factor, so many.
    Geometric(f64, f64, u32),
    /// Shares of the length of the log.
    OfLog(&'static [f64]),
    /// Shares of the largest torque in the log.
    OfTorque(&'static [f64]),
    /// Shares of the height of the centre of mass.
    OfHeight(&'static [f64]),
    /// A share of the inertia of a wheel.
    OfWheelInertia(f64),
    /// Places along the way, as far apart as the next parameter says.
    Way,
}

/// How a search refines a shape parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Not.
    Fixed,
    /// By a factor.
    Factor(f64),
    /// By a sum.
    Sum(f64),
    /// By a share of the height of the centre of mass.
    OfHeight(f64),
    /// By a share of the next parameter.
    OfNext(f64),
}

/// How an effect enters the equations of a robot, where there is more than one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As its law says.
    Law,
    /// Only where the motors turn forward: half of it, and half of the error of the same in both directions.
    Forward(&'static EffectKind),
    /// A mode of the body that its own turning drives.
    Driven,
    /// Waves of the ground, a row of bumps: their length is the second shape parameter.
    Wave,
    /// The log read with an IMU that speaks late.
    Late,
}

/// What the column of an effect is made of, on a log of one motor or axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// The speed alone.
    Speed,
    /// The acceleration, and its noise.
    Acceleration,
    /// The torque as it was measured, which then explains itself.
    MeasuredTorque,
    /// The torque that the model wants: a scale of the measured one that is off.
    WantedTorque,
    /// Anything else: position, direction, time.
    Other,
}

/// How a search over logs goes about an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// Evidence that it needs, in units of what a plain effect does: what else is easily taken for it.
    pub caution: f64,
    /// Whether a machine can have several, each of a shape of its own; those of a series can anyway.
    pub repeats: bool,
    /// Whether it is there for a moment only, of which no other part of a log tells.
    pub brief: bool,
    /// Ways to enter.
    pub forms: &'static [Form],
    /// What its column is made of.
    pub signal: Signal,
}

impl Trial {
    /// Of an effect without anything special.
    pub(super) const PLAIN: Self =
        Self { caution: 1.0, repeats: false, brief: false, forms: &[Form::Law], signal: Signal::Other };
    /// Of one that noise and what is next to it easily look like.
    pub(super) const fn cautious(caution: f64) -> Self {
        Self { caution, ..Self::PLAIN }
    }

    /// Of one whose column is made of this.
    pub(super) const fn of(self, signal: Signal) -> Self {
        Self { signal, ..self }
    }
}

impl Parameter {
    /// A shape parameter from `lowest` to `highest`.
    pub(super) const fn shape(key: &'static str, range: [f64; 2], meaning: &'static str) -> Self {
        Self {
            key,
            linear_key: key,
            meaning,
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
    pub(super) const fn amplitude(key: &'static str, range: [f64; 2], meaning: &'static str) -> Self {
        Self { role: Role::Amplitude, ..Self::shape(key, range, meaning) }
    }

    /// On a linear axis under another key, because of another unit, in another range.
    pub(super) const fn linear(self, linear_key: &'static str, linear_range: [f64; 2]) -> Self {
        Self { linear_key, linear_range, ..self }
    }

    /// May be left out.
    pub(super) const fn or(self, default: f64) -> Self {
        Self { default: Some(default), ..self }
    }

    /// Is not below 0 in a search.
    pub(super) const fn opposing(self) -> Self {
        Self { opposing: true, ..self }
    }

    /// Is nearly in proportion to the effect.
    pub(super) const fn sized(self) -> Self {
        Self { sized: true, ..self }
    }

    /// Is searched for from these values on.
    pub(super) const fn tried(self, grid: Grid, step: Step) -> Self {
        Self { grid, step, ..self }
    }

    /// Is a whole number.
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
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// Where it sits.
    pub place: Place,
    /// Machines that it can be on.
    pub machines: &'static [MachineKind],
    /// Parameters in the order of the model file: of a series those of its first member.
    pub parameters: &'static [Parameter],
    /// What a wave of the machine's angle does at a moment, in proportion to it; of a series of harmonics, whose
    /// parameters repeat, numbered from 1.
    pub wave: Option<fn(f64, &Moment) -> Action>,
    /// How a search goes about it.
    pub trial: Trial,
    /// Its terms on a machine at shape parameters, which stand in the order of the parameters.
    pub(super) make_terms: fn(&Machine, &[f64]) -> Vec<Term>,
    /// The experiment that tells it from the others that look alike.
    pub separated_by: &'static str,
    /// Whether a controller can cancel it.
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
    "a torque of the motors acts back on the body and cannot cancel it: the robot has to lean against it",
);

/// No number of a model can hold such an effect.
pub(super) fn undeclared(_: &Effect, _: Declared<'_>) -> bool {
    false
}

impl EffectKind {
    /// Whether each motor of a robot has its own.
    pub fn per_motor(&self) -> bool {
        matches!(self.place, Place::Motor | Place::Actuator)
    }

    /// Whether it depends on the rotor's own angle.
    pub fn by_angle(&self) -> bool {
        self.place == Place::Motor && self.series()
    }

    /// Whether the parameters repeat, numbered from 1, as harmonics do.
    pub fn series(&self) -> bool {
        self.wave.is_some()
    }

    /// What a wave of unit height does at a moment of a motor or axis, N m or N; 0 of one that has no waves.
    pub fn wave_nm(&self, moment: &Moment) -> f64 {
        self.wave.map_or(0.0, |wave| wave(1.0, moment).on_motor_nm(moment.direction()))
    }

    /// Whether its waves act against the motion, so that one way they cannot be told from a torque.
    pub fn waves_oppose(&self) -> bool {
        self.wave.is_some_and(|wave| wave(1.0, &Moment::default()).friction_nm != 0.0)
    }

    /// Whether it can be on a machine.
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
