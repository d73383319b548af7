//! The symbolic work: elimination order, structure of the factor, pattern.

use crate::bundle::Bundles;
use crate::elimination;
use crate::settings::Ordering;
use crate::structure::Structure;
use crate::supernodes::Supernodes;
use crate::tree::{Couplings, moved, postorder};
use crate::twins::{places, twins};
use crate::{KktError, multifrontal::Multifrontal};

/// All that is known of a matrix before its values are.
pub(crate) struct Analysis {
    /// Elimination order: place `k` holds row `order[k]`.
    pub(crate) order: Vec<u32>,
    /// Structure of the matrix in that order.
    pub(crate) structure: Structure,
    pub(crate) factor: Multifrontal,
}

impl Analysis {
    /// Analyses the triplets of a matrix of `n` rows; indices have been checked.
    pub(crate) fn new(
        n: usize,
        rows: &[usize],
        cols: &[usize],
        ordering: &Ordering,
    ) -> Result<Self, KktError> {
        let mut order = elimination::order(n, rows, cols, ordering)?;
        let mut couplings = Couplings::new(n, rows, cols, &elimination::inverse(&order));
        let mut parent = couplings.elimination_forest();
        if let Some(postorder) = postorder(&parent) {
            order = postorder.iter().map(|&k| order[k as usize]).collect();
            let place = elimination::inverse(&postorder);
            couplings = couplings.moved(&place);
            parent = moved(&parent, &place);
        }
        let mut supernodes = Supernodes::new(&couplings, &parent);
        let twins = twins(&supernodes);
        let place = places(&supernodes, &twins);
        let mut bundles = Bundles::new(&supernodes, &twins, &place);
        if bundles.count() > 0 {
            supernodes = supernodes.moved(&place, bundles.rows());
            let postorder = std::mem::replace(&mut order, vec![0; n]);
            for (&place, row) in place.iter().zip(postorder) {
                order[place as usize] = row;
            }
        }
        let structure = Structure::new(n, rows, cols, &elimination::inverse(&order), &mut bundles)?;
        Ok(Self { factor: Multifrontal::new(&structure, supernodes, bundles)?, order, structure })
    }
}
