//! The regression of one fit: rows, free and held parameters, solution.

use std::ops::ControlFlow;

use nalgebra::DVector;

use super::kinematics::{Sieve, Stretch, direction, near_rest, stretches};
use super::regression::{Normal, half_widths, residual};
use super::stribeck_search::{Shape, Span, search};
use super::{Axis, KnownAxis, MotionError, MotionFit, MotionParameter, MotionSeries, place};
use crate::record::Log;

/// Sine of a column's angle to the others below which its parameter is not distinguished from them.
const INSEPARABLE: f64 = 0.01;
/// Threshold below which a warning says that they are hard to distinguish.
const HARD_TO_TELL: f64 = 0.1;
/// Fraction of noise in the acceleration above which the inertia is not estimated, and above which it is named.
const NOISE_ONLY: f64 = 0.3;
const NOISY: f64 = 0.02;
/// Fewest rows for each free parameter.
const ROWS_PER_PARAMETER: usize = 5;
/// A speed below this fraction of the root mean square may be a rest.
const REST_SHARE: f64 = 0.03;

/// Speeds of one stretch, from which the columns of friction are made.
struct Moving {
    step_s: f64,
    speed: Vec<f64>,
    /// The log that it comes from.
    sieve: usize,
    /// Which of its rows are in motion.
    kept: Vec<bool>,
}

/// The regression of one fit.
pub(super) struct Problem {
    files: String,
    axis: Axis,
    has_model: bool,
    sieves: Vec<Sieve>,
    moving: Vec<Moving>,
    /// Columns in the order of [`place`], the shape's two of them for no Stribeck curve.
    columns: Vec<Vec<f64>>,
    /// Time of each row, s.
    time_s: Vec<f64>,
    effort: Vec<f64>,
    /// Rows of sign(v), of which the shape's two columns are parts.
    directions: Vec<f64>,
    values: [f64; place::ALL],
    free: [bool; place::ALL],
    shape: Option<Shape>,
    span: Span,
    warnings: Vec<String>,
}

impl Problem {
    pub(super) fn new(
        logs: &[Log],
        axis: Axis,
        known: Option<&KnownAxis>,
        free: [bool; place::ALL],
        watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Self, MotionError> {
        let files = logs.iter().map(|log| log.source.as_str()).collect::<Vec<_>>().join(", ");
        let mut problem = Self {
            files,
            axis,
            has_model: known.is_some(),
            sieves: Vec::new(),
            moving: Vec::new(),
            columns: vec![Vec::new(); place::LINEAR],
            time_s: Vec::new(),
            effort: Vec::new(),
            directions: Vec::new(),
            values: known_values(known),
            free,
            shape: None,
            span: Span::default(),
            warnings: Vec::new(),
        };
        for (index, log) in logs.iter().enumerate() {
            problem.take_in(log)?;
            report(watch, 0.5 * (index + 1) as f64 / logs.len() as f64)?;
        }
        if logs.is_empty() {
            return Err(MotionError::NoLog);
        }
        problem.check_length()?;
        problem.start_shape(known);
        Ok(problem)
    }

    /// Adds the rows of a log.
    fn take_in(&mut self, log: &Log) -> Result<(), MotionError> {
        let kind = self.axis.log_kind();
        let (position_name, effort_name) = self.axis.columns();
        let time = log.required(kind, "time_s")?;
        let position = log.required(kind, position_name)?;
        let stretches = stretches(time, position, log.required(kind, effort_name)?);
        let moves = |stretch: &Stretch| stretch.position.windows(2).any(|pair| pair[0] != pair[1]);
        if !stretches.is_empty() && !stretches.iter().any(moves) {
            return Err(MotionError::NoMotion { file: log.source.clone(), column: position_name });
        }
        let pushes = |stretch: &Stretch| stretch.effort.windows(2).any(|pair| pair[0] != pair[1]);
        if !stretches.is_empty() && !stretches.iter().any(pushes) {
            return Err(MotionError::NoEffort { file: log.source.clone(), column: effort_name });
        }
        let sieve = Sieve::choose(&stretches);
        let motions: Vec<_> = stretches.iter().map(|stretch| sieve.kinematics(stretch)).collect();
        let speeds = motions.iter().flat_map(|motion| &motion.speed);
        let rms = (speeds.clone().map(|v| v * v).sum::<f64>() / speeds.count().max(1) as f64).sqrt();
        let rest_speed = (REST_SHARE * rms).max(sieve.speed_noise(&stretches));
        self.span.widen(rest_speed, rms);
        for (stretch, motion) in stretches.into_iter().zip(motions) {
            let step_s = stretch.step_s;
            let resting = near_rest(&motion.speed, rest_speed, sieve.blur(), sieve.blur());
            let kept: Vec<bool> =
                sieve.row_samples(resting.len(), step_s).map(|sample| !resting[sample]).collect();
            let times = sieve.row_samples(resting.len(), step_s).map(|sample| sample as f64 * step_s);
            let times: Vec<f64> = times.map(|time| stretch.start_s + time).collect();
            self.time_s.extend(chosen(&times, &kept));
            let load: Vec<f64> = stretch.position.iter().map(|angle| angle.sin()).collect();
            let ones = vec![1.0; load.len()];
            let signs: Vec<f64> = motion.speed.iter().map(|&v| direction(v)).collect();
            let linear = [
                (place::INERTIA, &motion.acceleration),
                (place::VISCOUS, &motion.speed),
                (place::COULOMB, &signs),
                (place::OFFSET, &ones),
                (place::GRAVITY, &load),
            ];
            for (index, signal) in linear {
                self.columns[index].extend(chosen(&sieve.rows(signal, step_s), &kept));
            }
            self.effort.extend(chosen(&sieve.rows(&stretch.effort, step_s), &kept));
            self.moving.push(Moving { step_s, speed: motion.speed, sieve: self.sieves.len(), kept });
        }
        self.directions.clone_from(&self.columns[place::COULOMB]);
        self.columns[place::STATIC].resize(self.effort.len(), 0.0);
        self.sieves.push(sieve);
        Ok(())
    }

    fn check_length(&self) -> Result<(), MotionError> {
        let (rows, needed) = (self.effort.len(), ROWS_PER_PARAMETER * self.free_count().max(4));
        if rows < needed {
            let cutoff_hz = self.sieves.first().map_or(0.0, |sieve| sieve.cutoff_hz);
            return Err(MotionError::TooShort { files: self.files.clone(), rows, needed, cutoff_hz });
        }
        Ok(())
    }

    fn free_count(&self) -> usize {
        self.free.iter().filter(|&&free| free).count()
    }

    fn shape_is_free(&self) -> [bool; 2] {
        [self.free[place::STRIBECK_SPEED], self.free[place::STRIBECK_EXPONENT]]
    }

    fn start_shape(&mut self, known: Option<&KnownAxis>) {
        let friction = known.and_then(|known| known.friction);
        self.shape = match friction {
            Some(p) => Some(Shape { speed: p.stribeck_speed_rad_s, exponent: p.stribeck_exponent }),
            None => self.free[place::STATIC].then(|| self.span.middle()),
        };
        if let Some(shape) = self.shape {
            self.set_shape(shape);
        }
    }

    /// Splits sign(v) into the columns of Coulomb and static friction of a curve.
    fn set_shape(&mut self, shape: Shape) {
        let [coulomb, sticking] = self.friction_columns(shape);
        self.columns[place::COULOMB] = coulomb;
        self.columns[place::STATIC] = sticking;
        self.values[place::STRIBECK_SPEED] = shape.speed;
        self.values[place::STRIBECK_EXPONENT] = shape.exponent;
        self.shape = Some(shape);
    }

    fn friction_columns(&self, shape: Shape) -> [Vec<f64>; 2] {
        let mut sticking = Vec::with_capacity(self.effort.len());
        for Moving { step_s, speed, sieve, kept } in &self.moving {
            let low: Vec<f64> = speed.iter().map(|&v| direction(v) * shape.fading(v)).collect();
            sticking.extend(chosen(&self.sieves[*sieve].rows(&low, *step_s), kept));
        }
        // Filters are linear: what does not fade is the rest of sign(v).
        let coulomb = self.directions.iter().zip(&sticking).map(|(sign, low)| sign - low).collect();
        [coulomb, sticking]
    }

    /// Places of the free parameters in which the model is linear.
    fn free_linear(&self) -> Vec<usize> {
        (0..place::LINEAR).filter(|&index| self.free[index]).collect()
    }

    fn free_columns(&self) -> Vec<Vec<f64>> {
        self.free_linear().into_iter().map(|index| self.columns[index].clone()).collect()
    }

    /// The effort without what the held parameters explain.
    fn target(&self) -> Vec<f64> {
        let held: Vec<usize> = (0..place::LINEAR).filter(|&index| !self.free[index]).collect();
        let columns: Vec<Vec<f64>> = held.iter().map(|&index| self.columns[index].clone()).collect();
        let values = DVector::from_iterator(held.len(), held.iter().map(|&index| self.values[index]));
        residual(&columns, &values, &self.effort)
    }

    /// Solves for the linear parameters at the present shape and returns the sum of squares left.
    fn solve_linear(&mut self) -> Option<f64> {
        let (columns, target) = (self.free_columns(), self.target());
        let solution = Normal::new(&columns).solve(&columns, &target)?;
        for (place, value) in self.free_linear().into_iter().zip(&solution) {
            self.values[place] = *value;
        }
        Some(residual(&columns, &solution, &target).iter().map(|r| r * r).sum())
    }

    /// The fit.
    pub(super) fn solve(
        mut self,
        watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<MotionFit, MotionError> {
        self.give_up_on_noise();
        self.give_up_on_the_inseparable();
        if self.free_count() == 0 {
            return Err(MotionError::NothingExcited { files: self.files });
        }
        if let (Some(start), [speed, exponent]) = (self.shape, self.shape_is_free())
            && (speed || exponent)
        {
            if !self.span.is_open() {
                return Err(MotionError::StribeckHidden { files: self.files });
            }
            let span = self.span.clone();
            let best = search(start, [speed, exponent], &span, |shape, share| {
                report(watch, 0.5 + 0.5 * share)?;
                self.set_shape(shape);
                Ok(self.solve_linear().unwrap_or(f64::INFINITY))
            })?;
            self.set_shape(best);
            self.warn_of_shape(&span, best);
        }
        let mut left = self.solve_linear();
        if left.is_some_and(|left| self.inertia_is_drowned(left)) {
            self.give_up(place::INERTIA, "the acceleration is small and noisy");
            left = self.solve_linear();
        }
        if left.is_none() || self.free_count() == 0 {
            return Err(MotionError::NothingExcited { files: self.files });
        }
        Ok(self.into_fit())
    }

    /// Returns whether the inertia acts less than what is left (a sum of squares) while the acceleration is noisy:
    /// noise that is not white, as a jittering clock makes it, can then hide it to any degree.
    fn inertia_is_drowned(&self, left: f64) -> bool {
        self.free[place::INERTIA] && self.noise_share() > NOISY && self.inertia_effect() < left
    }

    /// Sum of squares of the effort that accelerates the inertia.
    fn inertia_effect(&self) -> f64 {
        let acceleration = &self.columns[place::INERTIA];
        self.values[place::INERTIA].powi(2) * acceleration.iter().map(|a| a * a).sum::<f64>()
    }

    /// Fraction of noise in the variance of the acceleration over all rows.
    fn noise_share(&self) -> f64 {
        let mut power = 0.0;
        let mut noise = 0.0;
        let acceleration = &self.columns[place::INERTIA];
        let mut rows = acceleration.iter();
        for Moving { sieve, kept, .. } in &self.moving {
            let count = kept.iter().filter(|&&kept| kept).count();
            let sum: f64 = rows.by_ref().take(count).map(|a| a * a).sum();
            power += sum;
            noise += sum * self.sieves[*sieve].noise_share.min(1.0);
        }
        if power > 0.0 { noise / power } else { 1.0 }
    }

    /// Holds the inertia where the acceleration is noise.
    fn give_up_on_noise(&mut self) {
        if self.free[place::INERTIA] && self.noise_share() > NOISE_ONLY {
            self.give_up(place::INERTIA, "the acceleration is barely above the noise of the position");
        }
    }

    /// Holds parameters until the columns of the others are independent, those first that matter least.
    fn give_up_on_the_inseparable(&mut self) {
        let order =
            [place::STATIC, place::GRAVITY, place::OFFSET, place::VISCOUS, place::INERTIA, place::COULOMB];
        loop {
            let sines = Normal::new(&self.free_columns()).sines();
            let places = self.free_linear();
            let weak = |place: &usize| {
                places.iter().zip(&sines).any(|(other, &sine)| other == place && sine < INSEPARABLE)
            };
            let Some(&place) = order.iter().find(|place| weak(place)) else {
                self.warn_of_near_dependence(&places, &sines);
                return;
            };
            self.give_up(place, "its effect cannot be separated from that of the others in this motion");
        }
    }

    fn give_up(&mut self, place: usize, reason: &str) {
        let advice = match place {
            place::INERTIA => "record a motion with strong accelerations",
            place::OFFSET | place::COULOMB => "record motion in both directions",
            place::GRAVITY => "record motion over a larger range of angles",
            _ => "record motion at several speeds",
        };
        let key = self.axis.keys()[place];
        let done = if self.has_model { "is fixed at the model's value" } else { "is omitted (set to 0)" };
        self.warnings.push(format!("{key} {done}: {reason}; {advice}"));
        self.free[place] = false;
        if place == place::STATIC {
            self.free[place::STRIBECK_SPEED] = false;
            self.free[place::STRIBECK_EXPONENT] = false;
        }
    }

    fn warn_of_near_dependence(&mut self, places: &[usize], sines: &[f64]) {
        let keys = self.axis.keys();
        let close = places.iter().zip(sines).filter(|(_, sine)| **sine < HARD_TO_TELL);
        let names: Vec<&str> = close.map(|(&place, _)| keys[place]).collect();
        if !names.is_empty() {
            self.warnings.push(format!(
                "{} are hard to separate in this motion: record a greater variety of speeds and accelerations",
                names.join(" and ")
            ));
        }
    }

    fn warn_of_shape(&mut self, span: &Span, shape: Shape) {
        let keys = self.axis.keys();
        let [speed, exponent] = self.shape_is_free();
        for (free, edge, key) in [
            (speed, span.speed_at_edge(shape), keys[place::STRIBECK_SPEED]),
            (exponent, span.exponent_at_edge(shape), keys[place::STRIBECK_EXPONENT]),
        ] {
            if free && edge {
                self.warnings.push(format!(
                    "{key} is at the limit of what this motion can identify: record slow motion \
                     in steps of constant speed"
                ));
            }
        }
    }

    fn into_fit(mut self) -> MotionFit {
        let (mut columns, target) = (self.free_columns(), self.target());
        let mut places = self.free_linear();
        let solution = DVector::from_iterator(places.len(), places.iter().map(|&place| self.values[place]));
        let left = residual(&columns, &solution, &target);
        for (place, column) in self.shape_derivatives() {
            places.push(place);
            columns.push(column);
        }
        let widths = half_widths(&columns, &left);
        if widths.is_none() {
            self.warnings
                .push("no confidence intervals: a parameter depends on one short part of the log".into());
        }
        let width = |place: usize| {
            let index = places.iter().position(|&other| other == place)?;
            widths.as_ref().map(|widths| widths[index])
        };
        let sum = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        let parameters: Vec<MotionParameter> =
            (0..place::ALL).filter_map(|place| self.parameter(place, width(place))).collect();
        let relative_error = (sum(&left) / sum(&self.effort)).sqrt();
        let rmse = (sum(&left) / left.len() as f64).sqrt();
        self.warn_of_values(&parameters, rmse, relative_error);
        let fitted = self.effort.iter().zip(&left).map(|(effort, left)| effort - left).collect();
        let series = MotionSeries {
            time_s: self.time_s,
            speed: std::mem::take(&mut self.columns[place::VISCOUS]),
            measured: self.effort,
            fitted,
        };
        MotionFit {
            series,
            rmse,
            rmse_unit: self.axis.effort_unit(),
            relative_error,
            rows: left.len(),
            cutoff_hz: self.sieves.iter().map(|sieve| sieve.cutoff_hz).collect(),
            condition_number: Normal::new(&columns).condition(),
            parameters,
            warnings: self.warnings,
        }
    }

    /// An estimate with its interval, or a value of the model that took part.
    fn parameter(&self, place: usize, half_width: Option<f64>) -> Option<MotionParameter> {
        let (key, value) = (self.axis.keys()[place], self.values[place]);
        let stribeck = [place::STATIC, place::STRIBECK_SPEED, place::STRIBECK_EXPONENT];
        let absent = key.is_empty() || (stribeck.contains(&place) && self.shape.is_none());
        if absent || !(self.free[place] || self.has_model) {
            return None;
        }
        let ci95 = half_width.map(|width| match place {
            place::STRIBECK_SPEED | place::STRIBECK_EXPONENT => [value * (-width).exp(), value * width.exp()],
            _ => [value - width, value + width],
        });
        Some(MotionParameter { key, value, ci95, held: !self.free[place] })
    }

    /// Derivatives of the model by the logarithms of the free parameters of the shape.
    fn shape_derivatives(&self) -> Vec<(usize, Vec<f64>)> {
        const STEP: f64 = 1e-4;
        let Some(shape) = self.shape else { return Vec::new() };
        let level = |shape: Shape| {
            let [coulomb, sticking] = self.friction_columns(shape);
            let (f_c, f_s) = (self.values[place::COULOMB], self.values[place::STATIC]);
            coulomb.into_iter().zip(sticking).map(move |(c, s)| f_c * c + f_s * s).collect::<Vec<f64>>()
        };
        let derivative = |upper: Shape, lower: Shape| {
            let (upper, lower) = (level(upper), level(lower));
            upper.into_iter().zip(lower).map(|(u, l)| (u - l) / (2.0 * STEP)).collect()
        };
        let at_speed = |step: f64| Shape { speed: shape.speed * step.exp(), ..shape };
        let at_exponent = |step: f64| Shape { exponent: shape.exponent * step.exp(), ..shape };
        let [speed, exponent] = self.shape_is_free();
        let mut found = Vec::new();
        if speed {
            found.push((place::STRIBECK_SPEED, derivative(at_speed(STEP), at_speed(-STEP))));
        }
        if exponent {
            found.push((place::STRIBECK_EXPONENT, derivative(at_exponent(STEP), at_exponent(-STEP))));
        }
        found
    }

    fn warn_of_values(&mut self, parameters: &[MotionParameter], rmse: f64, relative_error: f64) {
        let keys = self.axis.keys();
        let never_negative = [place::INERTIA, place::VISCOUS, place::COULOMB, place::STATIC];
        for place in never_negative {
            let own = parameters.iter().find(|p| p.key == keys[place] && !p.held);
            let Some(parameter) = own.filter(|p| p.value < 0.0) else { continue };
            let told_from_zero = parameter.ci95.is_none_or(|[_, upper]| upper < 0.0);
            let (key, value) = (parameter.key, parameter.value);
            self.warnings.push(if told_from_zero {
                format!(
                    "{key} = {value:.3e} is negative, which is impossible: check the signs of position \
                     and effort, check that the model has all loads on the axis, or give known values in a model"
                )
            } else {
                format!("{key} = {value:.3e} is not significantly different from 0: record a motion in which it has more effect")
            });
        }
        let share = self.noise_share();
        if self.free[place::INERTIA] && share > NOISY {
            self.warnings.push(format!(
                "noise of the position is {:.0} % of the acceleration's variance, which biases {} low by \
                 about as much: record stronger accelerations or a finer position",
                100.0 * share,
                keys[place::INERTIA]
            ));
        }
        if self.free[place::INERTIA] && self.inertia_effect() < rmse * rmse * self.effort.len() as f64 {
            self.warnings.push(format!(
                "the effect of {} is smaller than the residual, and noise would bias it low: \
                 record a motion with strong accelerations",
                keys[place::INERTIA]
            ));
        }
        if relative_error > 0.5 {
            self.warnings.push(format!(
                "the residual is {:.0} % of the effort: check units and columns, and check \
                 that the model has all loads on the axis",
                100.0 * relative_error
            ));
        }
    }
}

fn known_values(known: Option<&KnownAxis>) -> [f64; place::ALL] {
    let mut values = [0.0; place::ALL];
    let Some(known) = known else { return values };
    values[place::INERTIA] = known.inertia;
    values[place::GRAVITY] = known.gravity_torque_nm;
    if let Some(friction) = known.friction {
        values[place::VISCOUS] = friction.viscous_nm_s_rad;
        values[place::COULOMB] = friction.coulomb_nm;
        values[place::OFFSET] = friction.offset_nm;
        values[place::STATIC] = friction.static_nm;
        values[place::STRIBECK_SPEED] = friction.stribeck_speed_rad_s;
        values[place::STRIBECK_EXPONENT] = friction.stribeck_exponent;
    }
    values
}

fn report(watch: &mut dyn FnMut(f64) -> ControlFlow<()>, share: f64) -> Result<(), MotionError> {
    if watch(share).is_break() { Err(MotionError::Cancelled) } else { Ok(()) }
}

fn chosen<'a>(values: &'a [f64], kept: &'a [bool]) -> impl Iterator<Item = f64> + 'a {
    values.iter().zip(kept).filter(|(_, kept)| **kept).map(|(value, _)| *value)
}
