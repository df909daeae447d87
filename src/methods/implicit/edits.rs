//! Manual edits of the input points of an implicit surface: points added, removed, and marked as outside.

use super::cloud::{BoxMap, Cloud, check_finite, check_max_count};
use super::exterior::Exterior;
use super::sampling::Samples;
use super::solve::Constraints;
use crate::math::{PositionIndex, Vec3};
use crate::methods::MethodError;
use serde::{Deserialize, Serialize};

/// Manual edits of the points that an implicit surface is fitted to, as differences from its input points.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointEdits {
    /// Points near the surface, in world units, that are used in addition to the input points.
    pub added: Vec<Vec3>,
    /// Indices of input points to leave out; other input points at the same position are left out, too. If only a
    /// sample of the points is used, samples that are removed are not replaced by other points.
    pub removed: Vec<u32>,
    /// Points known to be outside the surface, in world units, that are used in addition to other exterior points.
    pub exterior: Vec<Vec3>,
}

/// Maximum distance, along each axis, from the centre of the input points' bounding box to a point that is added or
/// marked as outside, in halves of the longest side of that box. The default cell size allows for a surface that
/// extends so far.
pub const MAX_ADDED_DISTANCE: f32 = 3.0;

impl PointEdits {
    /// Checks the edits against `original`, the input points in world units, and `map`, their map into the normalised
    /// box: numbers of points, finite coordinates, distances and indices.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the list, the bad entry and what is accepted.
    pub fn validate(&self, original: &[Vec3], map: &BoxMap) -> Result<(), MethodError> {
        for (name, points) in [("added", &self.added), ("exterior", &self.exterior)] {
            check_max_count(name, points.len())?;
            check_finite(name, points)?;
            if let Some(i) =
                points.iter().position(|&p| map.in_box(p).abs().max_element() > MAX_ADDED_DISTANCE)
            {
                let problem = format!(
                    "point {i}, {}, is more than 3 half sides from the centre of the input points",
                    points[i]
                );
                return Err(MethodError::invalid(name, problem));
            }
        }
        match self.removed.iter().find(|&&i| i as usize >= original.len()) {
            Some(i) => {
                let problem = format!("must be indices below {}, got {i}", original.len());
                Err(MethodError::invalid("removed", problem))
            }
            None => Ok(()),
        }
    }

    /// Checks that no point marked as outside coincides with a point of `surface`, a cloud in the normalised box, into
    /// which `map` maps world points: the implicit function cannot be both 0 and −1 there.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the first point that does.
    pub fn check_exterior(&self, surface: &Cloud, map: &BoxMap) -> Result<(), MethodError> {
        let known = PositionIndex::new(&surface.points);
        match self.exterior.iter().position(|&p| known.find(map.in_box(p)).is_some()) {
            Some(i) => {
                let problem = format!("point {i} is {}, which is also a surface point", self.exterior[i]);
                Err(MethodError::invalid("exterior", problem))
            }
            None => Ok(()),
        }
    }

    /// Returns the positions of the removed points in the normalised box, as an index for finding out whether a point
    /// was removed; `original` holds all input points, in world units.
    pub fn removed_positions(&self, original: &[Vec3], map: &BoxMap) -> PositionIndex {
        let positions: Vec<Vec3> = self.removed.iter().map(|&i| map.in_box(original[i as usize])).collect();
        PositionIndex::new(&positions)
    }

    /// Returns `cloud`, which is in the normalised box, without the removed points, with the added ones, and without
    /// duplicates; `original` holds all input points. As added points have no normals or colours, the result has
    /// neither; their confidence is 1.
    pub fn apply_to(&self, cloud: &Cloud, original: &[Vec3], map: &BoxMap) -> Cloud {
        let remaining = self.without_removed(cloud, original, map);
        let added = self.added.iter().map(|&p| map.in_box(p));
        let points: Vec<Vec3> = remaining.points.iter().copied().chain(added).collect();
        let confidence = remaining.confidence.map(|mut confidence| {
            confidence.resize(points.len(), 1.0);
            confidence
        });
        Cloud { points, confidence, ..Cloud::default() }.distinct()
    }

    /// Returns `cloud`, which is in the normalised box, without points at the positions of removed ones; `original`
    /// holds all input points.
    pub fn without_removed(&self, cloud: &Cloud, original: &[Vec3], map: &BoxMap) -> Cloud {
        if self.removed.is_empty() {
            return cloud.clone();
        }
        let removed = self.removed_positions(original, map);
        let stays = |i: &u32| removed.find(cloud.points[*i as usize]).is_none();
        cloud.select(&(0..cloud.len() as u32).filter(stays).collect::<Vec<u32>>())
    }

    /// Builds the constraints on the implicit function, with their regularisation λ still 0, from the sampled points,
    /// the exterior points and these edits; `original` holds all input points in world units, and `map` maps these into
    /// the normalised box.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if too few points remain, they lie in one plane, or a point is both on the
    /// surface and outside.
    pub fn constraints(
        &self,
        samples: &Samples,
        exterior: &Exterior,
        original: &[Vec3],
        map: &BoxMap,
    ) -> Result<Constraints, MethodError> {
        let surface = self.apply_to(&samples.cloud, original, map);
        surface.check_count()?;
        surface.check_span()?;
        let all_in_box = |all: &[Vec3]| all.iter().map(|&p| map.in_box(p)).collect::<Vec<Vec3>>();
        let [added, marked] = [&self.added, &self.exterior].map(|points| all_in_box(points));
        let [mut outside, inside] = exterior.valid_after_edits(&surface.points, &added, &marked);
        outside.extend(marked);
        outside.extend(&exterior.on_sphere);
        let outside = Cloud { points: outside, ..Cloud::default() }.distinct().points;
        let constraints = Constraints::new(&surface, &outside, &inside);
        match constraints.shared_centre() {
            Some(p) => {
                let is_added = self.added.iter().any(|&added| map.in_box(added) == p);
                let [name, other] =
                    if is_added { ["added", "an exterior point"] } else { ["exterior", "a surface point"] };
                let problem = format!("{} is also {other}", map.in_world(p.as_dvec3()));
                Err(MethodError::invalid(name, problem))
            }
            None => Ok(constraints),
        }
    }
}
