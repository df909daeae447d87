//! Whether two volumes have the same grid: the same voxels at the same positions in world space.

use super::Volume;
use crate::math::DVec3;

/// Largest accepted distance between corresponding corners of two grids, in voxels: allows for rounding in file headers
/// only.
pub(super) const GRID_TOLERANCE: f64 = 1e-3;

/// Returns in which respect the grid of `other` differs from that of `first`: dimensions, space, or position by more
/// than a thousandth of a voxel; `None` if the grids are the same. The numbers of frames are not compared.
pub(super) fn grid_difference(first: &Volume, other: &Volume) -> Option<&'static str> {
    if other.dims() != first.dims() {
        return Some("dimensions");
    }
    if other.space != first.space {
        return Some("space");
    }
    let last = DVec3::from(first.dims().map(|n| n as f64));
    let corners = [DVec3::ZERO, last.with_y(0.0).with_z(0.0), last.with_x(0.0).with_z(0.0), last];
    let moved = |p: DVec3| first.inverse.transform_point3(other.affine.transform_point3(p)).distance(p);
    corners.iter().any(|&p| moved(p) > GRID_TOLERANCE).then_some("position")
}
