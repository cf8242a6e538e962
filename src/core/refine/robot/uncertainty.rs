//! How sure sizes and shapes are.
//!
//! The jackknife over blocks says how the estimates scatter with the log, their shapes free beside their sizes: a shape is
//! a column more, the change of the effect with it. To that is added what declared numbers may be off by without the
//! log saying so: with the normal equations H = G + P, P what is known beforehand, that is H⁻¹ P H⁻¹.

use nalgebra::{DMatrix, DVector};

use crate::refine::select::Member;

use super::candidates::Candidate;
use super::kernel::dot;
use super::search::{Fit, FreeShape, Search};

/// Standard errors.
pub(super) struct Uncertainty {
    /// Of every coefficient of the fit, those of the nuisances first.
    pub(super) sizes: Vec<f64>,
    /// Of every shape parameter of every pick; none of those that are not refined.
    pub(super) shapes: Vec<Vec<Option<f64>>>,
}

impl Uncertainty {
    pub(super) fn new(search: &Search<'_>, picks: &[Candidate], fit: &Fit) -> Self {
        let free = search.free_shapes(picks, fit);
        let own = fit.members.len();
        let mut members = fit.members.clone();
        for (pick, first) in search.placed(picks) {
            // Of one without an amplitude the shape is the size.
            let is_of = |shape: &FreeShape| std::ptr::eq(&picks[shape.pick], pick);
            if pick.is_fixed() && !pick.is_sized() && free.iter().any(is_of) {
                members[first].bounds = [1.0, 1.0];
            }
        }
        members.extend((0..free.len()).map(|extra| Member::free(own + extra)));
        let mut columns = search.columns(picks);
        columns.extend(free.iter().map(|shape| shape.column.as_slice()));
        let errors = errors(search, &columns, &members)
            .unwrap_or_else(|| (0..own).map(|i| fit.judged.standard_error(i)).collect());
        let mut shapes: Vec<Vec<Option<f64>>> =
            picks.iter().map(|pick| vec![None; pick.shape.len()]).collect();
        for (shape, error) in free.iter().zip(errors.iter().skip(own)) {
            shapes[shape.pick][shape.place] = Some(*error);
        }
        let sizes =
            (0..own).map(|i| errors[i].max(fit.judged.standard_error(i)).hypot(fit.doubt[i])).collect();
        Self { sizes, shapes }
    }
}

/// Standard errors of the members' coefficients; none where they depend on each other.
fn errors(search: &Search<'_>, columns: &[&[f64]], members: &[Member]) -> Option<Vec<f64>> {
    let judged = search.blocks(columns).judge(members, 1.0)?;
    let count = members.len();
    let known = DVector::from_iterator(count, members.iter().map(|member| 1.0 / member.spread.powi(2)));
    let normal = DMatrix::from_fn(count, count, |i, j| {
        dot(columns[i], columns[j]) + if i == j { known[i] } else { 0.0 }
    });
    let inverse = normal.cholesky()?.inverse();
    let beforehand = |i: usize| (0..count).map(|k| inverse[(i, k)].powi(2) * known[k]).sum::<f64>();
    Some((0..count).map(|i| (judged.standard_error(i).powi(2) + beforehand(i)).sqrt()).collect())
}
