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
    // The difference in world space, which is 0 for equal transforms however far from the origin.
    let between = |p: DVec3| other.affine.transform_point3(p) - first.affine.transform_point3(p);
    let moved = |p: DVec3| first.inverse.transform_vector3(between(p)).length();
    corners.iter().any(|&p| moved(p) > GRID_TOLERANCE).then_some("position")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::volume::{VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn volume(affine: DAffine3) -> Volume {
        Volume::new(VolumeInit { affine, ..VolumeInit::new(Voxels::U8(vec![1; 40]), [2, 4, 5, 1]) }).unwrap()
    }

    #[test]
    fn a_shift_a_turn_and_a_scaling_are_found_in_voxels() {
        let affine = DAffine3::from_scale(DVec3::new(1e-6, 1.0, 1e6));
        let index = |map: DAffine3| grid_difference(&volume(affine), &volume(affine * map));
        for (size, expected) in [(5e-4, None), (2e-3, Some("position"))] {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                assert_eq!(index(DAffine3::from_translation(axis * size)), expected);
            }
            assert_eq!(index(DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.0 + size / 5.0))), expected);
            assert_eq!(index(DAffine3::from_axis_angle(DVec3::Z, size / 4.0)), expected);
        }
    }

    #[test]
    fn a_volume_has_its_own_grid_however_far_from_the_origin() {
        let far = DAffine3 { translation: DVec3::new(-2e38, 1e30, 1.0), ..DAffine3::IDENTITY };
        assert_eq!(grid_difference(&volume(far), &volume(far)), None);
    }
}
