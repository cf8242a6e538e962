//! What is tried: every kind of the library that can be in a robot, at shapes that its range of motion can show.

use std::num::NonZeroUsize;

use crate::effects::{EffectKind, Form, Grid, KINDS, Parameter, Place, Step};
use crate::model::MachineKind;
use crate::parallel;

use super::trace::{Pair, Trace};

/// A step of a shape parameter.
#[derive(Clone, Copy, Debug)]
pub(super) enum Move {
    Factor(f64),
    Sum(f64),
}

impl Move {
    /// The value one step on, or back for a `direction` of −1.
    pub(super) fn from(self, value: f64, direction: f64) -> f64 {
        match self {
            Self::Factor(factor) => value * libm::pow(factor, direction),
            Self::Sum(sum) => value + direction * sum,
        }
    }

    /// Half of it.
    pub(super) fn half(self) -> Self {
        match self {
            Self::Factor(factor) => Self::Factor(factor.sqrt()),
            Self::Sum(sum) => Self::Sum(0.5 * sum),
        }
    }
}

/// One thing to try.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) kind: &'static EffectKind,
    pub(super) form: Form,
    pub(super) shape: Vec<f64>,
    /// Columns at unit amplitude.
    pub(super) pairs: Vec<Pair>,
    /// The same, white.
    pub(super) white: Vec<Vec<f64>>,
}

impl Candidate {
    pub(super) fn new(trace: &Trace, kind: &'static EffectKind, form: Form, shape: Vec<f64>) -> Self {
        let pairs = trace.columns(kind, form, &shape);
        Self { kind, form, shape, pairs, white: Vec::new() }
    }

    /// At several shapes, which for harmonics are orders next to each other.
    fn several(trace: &Trace, kind: &'static EffectKind, form: Form, shapes: &[Vec<f64>]) -> Vec<Self> {
        match (kind.wave, shapes) {
            (Some(action), [first, ..]) => {
                let columns = trace.waves(action, first[0], shapes.len());
                let of = |(shape, pairs): (&Vec<f64>, [Pair; 2])| {
                    let (shape, pairs) = (shape.clone(), pairs.into());
                    Self { kind, form, shape, pairs, white: Vec::new() }
                };
                shapes.iter().zip(columns).map(of).collect()
            }
            _ => shapes.iter().map(|shape| Self::new(trace, kind, form, shape.clone())).collect(),
        }
    }

    /// How each shape parameter is refined; none where it is not.
    pub(super) fn moves(&self, com_height_m: f64) -> Vec<Option<Move>> {
        let of = |(place, parameter): (usize, &Parameter)| match (self.form, parameter.step) {
            // A wave has a length, and its phase is in its amplitudes.
            (Form::Wave, _) => (place > 0).then_some(Move::Factor(1.03)),
            (_, Step::Fixed) => None,
            (_, Step::Factor(factor)) => Some(Move::Factor(factor)),
            (_, Step::Sum(sum)) => Some(Move::Sum(sum)),
            (_, Step::OfHeight(share)) => Some(Move::Sum(share * com_height_m)),
            (_, Step::OfNext(share)) => Some(Move::Sum(share * self.shape[place + 1])),
        };
        self.kind.shapes().enumerate().map(of).collect()
    }

    /// How many numbers it has beyond one size.
    pub(super) fn parameters(&self) -> usize {
        self.shape.len() + self.pairs.len() - 1
    }

    /// Whether it has a shape that is refined.
    pub(super) fn is_flexible(&self) -> bool {
        self.kind.shapes().any(|parameter| parameter.step != Step::Fixed)
    }

    /// Whether its amplitude is 1 and its size is in its shape.
    pub(super) fn is_fixed(&self) -> bool {
        self.form == Form::Late || self.kind.amplitudes().next().is_none()
    }

    /// Whether its size is its first shape parameter.
    pub(super) fn is_sized(&self) -> bool {
        self.is_fixed() && self.kind.shapes().next().is_some_and(|parameter| parameter.sized)
    }

    /// Lowest and highest coefficient of each column.
    pub(super) fn bounds(&self) -> Vec<[f64; 2]> {
        const NEAR_ONE: [f64; 2] = [0.7, 1.4];
        if self.is_fixed() {
            return vec![NEAR_ONE; self.pairs.len()];
        }
        if self.form == Form::Driven {
            return vec![[0.0, f64::INFINITY]];
        }
        let range = |parameter: &Parameter| {
            let [low, high] = parameter.range(MachineKind::Robot);
            [if parameter.opposing { low.max(0.0) } else { low }, high]
        };
        let ranges: Vec<[f64; 2]> = self.kind.amplitudes().map(range).collect();
        self.pairs.iter().enumerate().map(|(i, _)| ranges[i % ranges.len()]).collect()
    }

    /// Whether a shape that is refined is at the end of its range.
    pub(super) fn is_at_an_end(&self) -> bool {
        let moves = self.moves(1.0);
        let mut shapes = self.kind.shapes().zip(&self.shape).zip(&moves);
        shapes.any(|((parameter, value), step)| {
            let [low, high] = parameter.range(MachineKind::Robot);
            let (down, up) = match step {
                Some(Move::Factor(_)) if low > 0.0 => (low * NEAR_THE_END, high / NEAR_THE_END),
                _ => return false,
            };
            !(down..=up).contains(value)
        })
    }

    /// Whether its time is longer than what the timing of the log's own torque leaves open.
    pub(super) fn is_resolved(&self, row_s: f64) -> bool {
        let is_time = |parameter: &Parameter| parameter.sized && parameter.unit(MachineKind::Robot) == "s";
        let timed = self.kind.place == Place::Actuator && self.kind.shapes().next().is_some_and(is_time);
        !timed || self.shape[0] > LEAST_ROWS * row_s
    }

    /// Whether more than one of the kind can be in a robot.
    pub(super) fn repeats(&self) -> bool {
        self.kind.series() || self.kind.trial.repeats
    }
}

/// Factor within which a shape is at the end of its range.
const NEAR_THE_END: f64 = 1.05;

/// Least time of an actuator's effect, in rows.
const LEAST_ROWS: f64 = 1.5;

/// Highest order whose waves pass the kernel for some of the time.
const BAND_HZ: f64 = 22.0;

/// Orders of harmonics that one pass over the rows makes.
const ORDERS_AT_ONCE: usize = 10;

/// Ground waves that are tried: longest and shortest, m, and the factor between neighbours.
pub(super) const WAVES_M: [f64; 3] = [2.5, 0.08, 1.1];
/// Most places along the way.
const MOST_PLACES: f64 = 40.0;

/// Everything to try, apart from what depends on a moment.
pub(super) fn library(trace: &Trace, threads: NonZeroUsize) -> Vec<Candidate> {
    let reach = Reach::new(trace);
    let mut wanted = Vec::new();
    for kind in KINDS.iter().copied().filter(|kind| kind.is_on(MachineKind::Robot)) {
        for &form in kind.trial.forms {
            let shapes = if form == Form::Wave { waves() } else { reach.shapes(kind) };
            let together = if kind.wave.is_some() { ORDERS_AT_ONCE } else { 1 };
            wanted.extend(shapes.chunks(together).map(|shapes| (kind, form, shapes.to_vec())));
        }
    }
    let made = parallel::map(&wanted, threads, |(kind, form, shapes)| {
        Candidate::several(trace, kind, *form, shapes)
    });
    made.into_iter()
        .flatten()
        .filter(|candidate| !candidate.pairs.is_empty() && candidate.is_resolved(trace.row_s()))
        .collect()
}

fn waves() -> Vec<Vec<f64>> {
    let [longest, shortest, factor] = WAVES_M;
    let shorter = |length: &f64| (length / factor > shortest).then_some(length / factor);
    std::iter::successors(Some(longest), shorter).map(|length| vec![0.0, length]).collect()
}

/// What a log's motion can show.
struct Reach {
    most_order: u32,
    peak_nm: f64,
    way_m: [f64; 2],
    seconds: f64,
    height_m: f64,
    wheel_inertia_kg_m2: f64,
}

impl Reach {
    fn new(trace: &Trace) -> Self {
        let speeds: Vec<f64> = trace.moments().map(|m| m.motor_speed_rad_s.abs()).collect();
        let typical = quantile(&speeds, 0.5).max(0.3);
        let way = |[low, high]: [f64; 2], m: &crate::effects::MotionSample| [low.min(m.x_m), high.max(m.x_m)];
        Self {
            most_order: ((std::f64::consts::TAU * BAND_HZ / typical) as u32).clamp(8, 60),
            peak_nm: trace.moments().fold(0.0, |peak, m| f64::max(peak, m.torque_nm.abs())),
            way_m: trace.moments().fold([f64::MAX, f64::MIN], way),
            seconds: trace.moments().count() as f64 * trace.moments().next().map_or(1e-3, |m| m.dt_s),
            height_m: trace.machine.parameters.com_height_m,
            wheel_inertia_kg_m2: trace.machine.parameters.wheel_inertia_kg_m2,
        }
    }

    /// Every combination of the values of a kind's shape parameters.
    fn shapes(&self, kind: &EffectKind) -> Vec<Vec<f64>> {
        let parameters: Vec<&Parameter> = kind.shapes().collect();
        // From the last one on: the way is divided by what comes after.
        parameters.iter().rev().fold(vec![Vec::new()], |known: Vec<Vec<f64>>, parameter| {
            let before = |rest: &Vec<f64>| -> Vec<Vec<f64>> {
                let values = self.values(parameter, rest);
                values.into_iter().map(|value| [&[value], rest.as_slice()].concat()).collect()
            };
            known.iter().flat_map(before).collect()
        })
    }

    fn values(&self, parameter: &Parameter, next: &[f64]) -> Vec<f64> {
        let of = |shares: &[f64], whole: f64| shares.iter().map(|share| share * whole).collect();
        match parameter.grid {
            Grid::Default => parameter.default.into_iter().collect(),
            Grid::Orders(most) => (1..=most.min(self.most_order)).map(f64::from).collect(),
            Grid::Values(values) => values.to_vec(),
            Grid::Geometric(first, factor, count) => {
                (0..count).map(|i| first * libm::pow(factor, f64::from(i))).collect()
            }
            Grid::OfLog(shares) => of(shares, self.seconds),
            Grid::OfTorque(shares) => of(shares, self.peak_nm),
            Grid::OfHeight(shares) => of(shares, self.height_m),
            Grid::OfWheelInertia(share) => vec![share * self.wheel_inertia_kg_m2],
            Grid::Distance => {
                let ([low, high], Some(apart)) = (self.way_m, next.first()) else { return Vec::new() };
                let count = ((high - low) / apart).clamp(1.0, MOST_PLACES) as usize;
                (0..count).map(|i| low + (high - low) * (i as f64 + 0.5) / count as f64).collect()
            }
        }
    }
}

/// Value below which a share of the values are.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    if sorted.is_empty() {
        return 0.0;
    }
    let place = ((sorted.len() - 1) as f64 * share) as usize;
    *sorted.select_nth_unstable_by(place, f64::total_cmp).1
}
