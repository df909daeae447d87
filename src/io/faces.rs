//! Faces of mesh files as triangles, whatever the number of their corners and their shape.

use super::MeshFile;
use crate::math::{DVec3, triangulate_face};

/// Number of tests of points that the faces of a file are triangulated with: some seconds.
const EFFORT: u64 = 1 << 29;

/// The triangulation of the faces of a file, with what a user should know about it.
pub(super) struct Faces {
    /// The number of faces that were left out, as they have fewer than three corners.
    short: usize,
    effort: u64,
    corners: Vec<DVec3>,
}

impl Default for Faces {
    fn default() -> Self {
        Self { short: 0, effort: EFFORT, corners: Vec::new() }
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
        mut add: impl FnMut([usize; 3]),
    ) {
        if count > 3 {
            self.corners.clear();
            self.corners.extend((0..count).map(at));
            if let Some(triangles) = triangulate_face(&self.corners, &mut self.effort) {
                return triangles
                    .into_iter()
                    .for_each(|triangle| add(triangle.map(|corner| corner as usize)));
            }
        }
        (1..count.saturating_sub(1)).for_each(|k| add([0, k, k + 1]));
    }

    /// Adds warnings about the faces of a file.
    pub(super) fn warn(&self, file: &mut MeshFile) {
        let short = self.short;
        if short > 0 {
            file.warn(format!("Faces with fewer than three corners were left out: {short}."));
        }
        if self.effort == 0 {
            file.warn(
                "Concave polygons with too many corners were not triangulated right: save triangles instead.",
            );
        }
    }
}
