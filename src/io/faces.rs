//! Faces of mesh files as triangles, whatever the number of their corners and their shape.

use super::MeshFile;
use crate::math::{DVec3, triangulate_face};

/// Number of tests of points that the faces of a file are triangulated with: some seconds.
const EFFORT: u64 = 1 << 29;

/// The part of a face's area, seen along its mean normal, by which its triangles may face backwards before it counts as
/// intersecting itself.
///
/// Seen so, the triangles of a face that does not intersect itself all face forwards, however much it is bent: of the 18,486
/// quadrilaterals of a modelled body, none has a millionth that faces backwards, while the areas of 114 in space exceed
/// that along the mean normal by more than a tenth. Only rounded positions can turn slivers.
const BACKWARDS: f64 = 1e-3;

/// The rounding of positions that is allowed for beside that, relative to the largest coordinate: that of six digits.
const ROUNDING: f64 = 1e-6;

/// The triangulation of the faces of a file, with what a user should know about it.
pub(super) struct Faces {
    /// The number of faces that were left out, as they have fewer than three corners.
    short: usize,
    /// The number of faces that intersect themselves, so that their triangles overlap.
    crossing: usize,
    effort: u64,
    corners: Vec<DVec3>,
}

impl Default for Faces {
    fn default() -> Self {
        Self { short: 0, crossing: 0, effort: EFFORT, corners: Vec::new() }
    }
}

impl Faces {
    /// Returns whether a face has as many corners as a triangle; counts those that don't.
    pub(super) fn is_face(&mut self, corners: usize) -> bool {
        self.short += usize::from(corners < 3);
        corners >= 3
    }

    /// Calls `add` with the corners of each triangle of a face of `count` corners, whose positions `at` returns.
    pub(super) fn triangulate(
        &mut self,
        count: usize,
        at: impl Fn(usize) -> DVec3,
        add: impl FnMut([usize; 3]),
    ) {
        if count > 3 {
            self.corners.clear();
            self.corners.extend((0..count).map(at));
            if let Some(triangles) = triangulate_face(&self.corners, &mut self.effort) {
                let triangles = triangles.into_iter().map(|triangle| triangle.map(|corner| corner as usize));
                // Without effort left, triangles may overlap in any face.
                self.crossing += usize::from(self.effort > 0 && overlap(&self.corners, triangles.clone()));
                return triangles.for_each(add);
            }
            self.crossing += usize::from(overlap(&self.corners, fan(count)));
        }
        fan(count).for_each(add);
    }

    /// Adds warnings about the faces of a file.
    pub(super) fn warn(&self, file: &mut MeshFile) {
        let short = self.short;
        if short > 0 {
            file.warn(format!("Faces with fewer than three corners were left out: {short}."));
        }
        let crossing = self.crossing;
        if crossing > 0 {
            file.warn(format!(
                "Polygons that intersect themselves became triangles that overlap: {crossing}. Their area is too large: save triangles instead."
            ));
        }
        if self.effort == 0 {
            file.warn(
                "Concave polygons with too many corners were not triangulated right: save triangles instead.",
            );
        }
    }
}

/// Iterates over the fan of the first corner of a face with `count` corners.
fn fan(count: usize) -> impl Iterator<Item = [usize; 3]> + Clone {
    (1..count.saturating_sub(1)).map(|k| [0, k, k + 1])
}

/// Returns whether some of the triangles of a face face backwards, seen along its mean normal, so that they lie on others:
/// the face intersects itself. A face without a mean normal does if its triangles have an area.
fn overlap(corners: &[DVec3], triangles: impl Iterator<Item = [usize; 3]> + Clone) -> bool {
    let area = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]);
    let normal: DVec3 = triangles.clone().map(area).sum();
    let size = normal.length();
    let backwards: f64 = if size == 0.0 {
        triangles.map(|triangle| area(triangle).length()).sum()
    } else {
        triangles.map(|triangle| (-area(triangle).dot(normal / size)).max(0.0)).sum()
    };
    backwards > BACKWARDS * size + ROUNDING * largest_product(corners)
}

/// Returns the product of the largest coordinate and the longest side of the box of points.
fn largest_product(points: &[DVec3]) -> f64 {
    let (low, high) =
        points.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
    low.abs().max(high.abs()).max_element() * (high - low).max_element()
}
