//! The origin of meshes that are far from that of the world.

use crate::math::DVec3;

/// Largest distance of data from the world's origin, in units of their size, at which positions are kept relative to
/// it: single precision then resolves a millionth of the size, and meshes near the world's origin keep their bits. With
/// a larger factor, positions become coarse; with a smaller one, the origin of ordinary images changes.
const NEAR: f64 = 16.0;

/// Returns the origin for data in the box from `min` to `max`: 0 unless the box is far from the world's origin for its
/// size; then a point near its centre whose coordinates have few bits, so that subtracting it is exact.
pub fn world_origin(min: DVec3, max: DVec3) -> DVec3 {
    let size = (max - min).max_element();
    let furthest = min.abs().max(max.abs()).max_element();
    let is_near = furthest <= NEAR * size || size == 0.0;
    if is_near || !furthest.is_finite() {
        return DVec3::ZERO;
    }
    let (_, exponent) = libm::frexp(size);
    let step = libm::ldexp(1.0, exponent);
    ((min / 2.0 + max / 2.0) / step).round() * step
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn only_boxes_far_from_the_origin_for_their_size_get_one_of_their_own() {
        for size in [1e-12, 1.0, 300.0, 1e12] {
            let cube = |at: f64| [DVec3::new(at, 0.0, 0.0), DVec3::new(at + size, size, size)];
            for at in [0.0, -0.5, 10.0, -14.0] {
                let [min, max] = cube(at * size);
                assert_eq!(world_origin(min, max), DVec3::ZERO, "{size} {at}");
            }
            for at in [20.0, -1e3, 1e8] {
                let [min, max] = cube(at * size);
                let origin = world_origin(min, max);
                assert!(
                    (origin - (min + max) / 2.0).abs().max_element() <= 2.0 * size,
                    "{size} {at} {origin}"
                );
                assert_eq!(origin + (min - origin), min, "{size} {at}");
            }
        }
        assert_eq!(world_origin(DVec3::splat(f64::INFINITY), DVec3::ONE), DVec3::ZERO);
    }
}
