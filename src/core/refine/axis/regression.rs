//! Logs of an axis and its declared model as one regression: rows, what was measured there, what the declared numbers
//! leave of it, and which of them are estimated along.

use crate::effects::Place;
use crate::record::HealthFinding;
use crate::refine::error::RefineError;
use crate::refine::select::Blocks;
use crate::refine::whiten::Whitener;

use super::candidates::{Candidate, Scales, library};
use super::carried;
use super::floor;
use super::health;
use super::nuisance::{Nuisance, nuisances};
use super::rig::Declared;
use super::search::{self, Search, White};
use super::trace::{Part, Rows};

/// Cut-off in units of the frequency at which noise of the position takes over, and the share of the cut-off that it must
/// be below, so that it is worth a change.
const BAND: f64 = 3.0;
const WORTH: f64 = 0.8;
const LOWEST_HZ: f64 = 8.0;

pub(super) struct Regression {
    pub(super) declared: Declared,
    pub(super) rows: Rows,
    /// Efforts at the rows, N m or N.
    pub(super) measured: Vec<f64>,
    /// The same less what the declared numbers and effects explain.
    pub(super) target: Vec<f64>,
    pub(super) nuisances: Vec<Nuisance>,
}

impl Regression {
    /// The regression of a declared axis over rows of its logs, their zeros of the angle taken into account.
    ///
    /// # Errors
    /// A name in `estimate` that is no number of an axis.
    pub(super) fn new(mut declared: Declared, rows: Rows, estimate: &[String]) -> Result<Self, RefineError> {
        declared.zeros_rad = carried::zeros_rad(&declared, &rows);
        let [measured, target] = declared.targets(&rows);
        let nuisances = nuisances(&declared, &rows, estimate)?;
        Ok(Self { declared, rows, measured, target, nuisances })
    }

    /// Highest frequency, Hz, of rows that say something beside the noise of the position, where it is well below the
    /// kernel's cut-off.
    pub(super) fn highest_hz(&self) -> Option<f64> {
        let whitener = self.whitener();
        if whitener.rows().len() < super::LEAST_ROWS {
            return None;
        }
        let left = self.left_of(&whitener, &self.target)?;
        let highest_hz = BAND * floor::crossover_hz(&self.declared, &self.rows, &left)?;
        (highest_hz < WORTH * self.rows.kernel.cutoff_hz).then_some(highest_hz.max(LOWEST_HZ))
    }

    /// Findings about what the effort and the position say of each other.
    pub(super) fn check_units(&self) -> Vec<HealthFinding> {
        let Self { declared, rows, measured, target, nuisances } = self;
        let of_effort = health::check_effort(rows, declared, nuisances, measured, target);
        if !of_effort.is_empty() {
            return of_effort;
        }
        health::check_unit(rows, declared, nuisances, measured).into_iter().collect()
    }

    /// Speeds of the rows that free friction is told from; none where it is held.
    pub(super) fn fitted_speed_range(&self) -> Option<[f64; 2]> {
        let is_told = self.nuisances.iter().any(|nuisance| nuisance.free && nuisance.is_friction());
        if is_told { self.rows.speeds(Part::Fit) } else { None }
    }

    /// Findings about speeds beyond those that friction was told from, by these logs or by the model.
    pub(super) fn check_speeds(&self) -> Vec<HealthFinding> {
        let own = self.fitted_speed_range();
        let beyond = |part: &Part| {
            let told_from = own.or(self.declared.told_from)?;
            health::beyond(&self.declared, told_from, self.rows.speeds(*part)?)
        };
        let parts = if own.is_some() { &[Part::HeldOut][..] } else { &[Part::Fit, Part::HeldOut] };
        let beyond = parts.iter().find_map(beyond);
        beyond.into_iter().chain(own.map(|speeds| health::told_from(&self.declared, speeds))).collect()
    }

    /// The effort that the declared numbers and effects ask for.
    pub(super) fn wanted(&self) -> Vec<f64> {
        self.measured.iter().zip(&self.target).map(|(measured, left)| measured - left).collect()
    }

    pub(super) fn whitener(&self) -> Whitener {
        search::whitener(&self.rows, self.declared.inertia)
    }

    pub(super) fn white(&self, whitener: &Whitener) -> White {
        self.white_of(whitener, &self.target)
    }

    fn white_of(&self, whitener: &Whitener, target: &[f64]) -> White {
        White::new(&self.rows, whitener, &self.nuisances, [&self.measured, target], self.declared.inertia)
    }

    pub(super) fn search<'a>(
        &'a self,
        whitener: &'a Whitener,
        white: &'a White,
        library: &'a [Candidate],
    ) -> Search<'a> {
        let (machine, target) = (&self.declared.machine, &self.target);
        Search::new(&self.rows, machine, &self.nuisances, target, (whitener, white, library))
    }

    /// What is left of another target with the declared numbers estimated anew.
    pub(super) fn left_of(&self, whitener: &Whitener, target: &[f64]) -> Option<Vec<f64>> {
        let white = self.white_of(whitener, target);
        let machine = &self.declared.machine;
        let search = Search::new(&self.rows, machine, &self.nuisances, target, (whitener, &white, &[]));
        Some(search.residual(&search.fit(&[])?.judged.coefficients))
    }

    /// The target with effects put back that it was freed from.
    pub(super) fn target_with(&self, known: &[f64]) -> Vec<f64> {
        self.target.iter().zip(known).map(|(left, known)| left + known).collect()
    }

    /// Effects that the model may lack. Where the effort is not what drives the motion, noise that nobody logged does: it
    /// would be taken for an error of the inertia or of the effort, which are left out then.
    pub(super) fn library(&self, whitener: &Whitener, is_driven: bool) -> Vec<Candidate> {
        let inertia = self.declared.inertia;
        let scales = Scales::new(&self.rows, inertia);
        let wanted = self.wanted();
        let mut found = library(&self.declared.machine, &self.rows, whitener, &scales, (&wanted, inertia));
        let needs_effort =
            |candidate: &Candidate| matches!(candidate.kind.place, Place::Actuator | Place::Parameter);
        // What is free already is no effect that the model lacks.
        let is_free = |candidate: &Candidate| {
            self.nuisances.iter().any(|known| known.free && known.says(candidate.kind))
        };
        found.retain(|candidate| (is_driven || !needs_effort(candidate)) && !is_free(candidate));
        found
    }

    /// Takes the timing of the torque out of the target, which is the log's and of no model.
    pub(super) fn take_out_timing(&mut self, whitener: &Whitener) {
        let Some(timing) = self.nuisances.iter().find(|nuisance| nuisance.is_timing) else { return };
        let (column, white) = (whitener.apply(&timing.column), whitener.apply(&self.target));
        let blocks = Blocks::new(&[&column], &white, &vec![0; white.len()]);
        let noise = blocks.target_power() / blocks.rows().max(1) as f64;
        if let Some(late) = blocks.fit(&[timing.member(0)], noise) {
            self.target.iter_mut().zip(&timing.column).for_each(|(target, value)| *target -= late[0] * value);
        }
    }
}
