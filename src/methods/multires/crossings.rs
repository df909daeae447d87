//! Parts of a given surface that intersect each other, or themselves: they are not kept apart.

use super::correspondence::{BasePoint, Correspondence};
use crate::mesh::{TriangleMesh, intersecting_parts};
use crate::pauses::Pauses;
use crate::remesh::{Embedding, PairsOfParts};
use crate::warning::{Warning, WarningCode};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The connected components of a surface that intersect each other or themselves.
#[derive(Clone, Debug, Default)]
pub(super) struct Crossings {
    /// The component of each triangle of the surface; empty if nothing intersects.
    part_of: Vec<u32>,
    /// The pairs of components that intersect; all if there were too many triangles to test.
    pairs: PairsOfParts,
}

impl Crossings {
    /// Finds them, and pauses meanwhile.
    pub async fn of(surface: &TriangleMesh, pauses: &Pauses) -> Self {
        let parts = surface.component_of_each_vertex();
        let part_of: Vec<u32> = surface.triangles.iter().map(|corners| parts[corners[0] as usize]).collect();
        let pairs = intersecting_parts(surface, &part_of, pauses).await;
        if pairs.as_ref().is_some_and(BTreeSet::is_empty) {
            return Self::default();
        }
        Self { part_of, pairs: pairs.map(Arc::new) }
    }

    fn any(&self) -> bool {
        !self.part_of.is_empty()
    }

    /// Has a collision guard leave them alone in the next move of a surface with the given places on this one, by slot.
    pub fn exempt_from(&self, guard: &mut Embedding, points: &Correspondence) {
        let part_of = |at: &BasePoint| self.part_of.get(at.triangle as usize).copied().unwrap_or(u32::MAX);
        if self.any() {
            guard.tolerate(points.iter().map(part_of).collect(), self.pairs.clone());
        }
    }

    /// Returns the warning about them, if there are any.
    pub fn warning(&self) -> Option<Warning> {
        self.any().then(|| {
            let what = if self.pairs.is_none() {
                "Too many triangles of the surface overlap to find whether it intersects itself as given: it is not \
                 kept from doing so. Remesh it before, if that matters."
            } else {
                "The surface intersects itself as given. Its components that do, with themselves or each other, are \
                 not kept from doing so; all others are. Repair it before, or remesh it, if that matters."
            };
            Warning::new(WarningCode::SelfIntersecting, what)
        })
    }
}
