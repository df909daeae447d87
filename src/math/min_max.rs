//! Minimum and maximum of two numbers, as one machine instruction on every target.

/// Returns the lower of two numbers; `a` if either is NaN or they are equal.
#[inline]
pub fn lower(a: f32, b: f32) -> f32 {
    // Engines compile a `select` of numbers to a branch, which is mispredicted half the time.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    {
        use core::arch::wasm32::{f32x4_extract_lane, f32x4_pmin, f32x4_splat};
        f32x4_extract_lane::<0>(f32x4_pmin(f32x4_splat(a), f32x4_splat(b)))
    }
    #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
    if b < a { b } else { a }
}

/// Returns the higher of two numbers; `a` if either is NaN or they are equal.
#[inline]
pub fn higher(a: f32, b: f32) -> f32 {
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    {
        use core::arch::wasm32::{f32x4_extract_lane, f32x4_pmax, f32x4_splat};
        f32x4_extract_lane::<0>(f32x4_pmax(f32x4_splat(a), f32x4_splat(b)))
    }
    #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn the_first_is_taken_where_neither_is_lower_or_higher() {
        assert_eq!((lower(1.0, 2.0), lower(2.0, 1.0)), (1.0, 1.0));
        assert_eq!((higher(1.0, 2.0), higher(2.0, 1.0)), (2.0, 2.0));
        for of in [lower, higher] {
            assert!(of(f32::NAN, 1.0).is_nan() && of(1.0, f32::NAN) == 1.0);
            assert!(of(0.0, -0.0).is_sign_positive() && of(-0.0, 0.0).is_sign_negative());
        }
    }
}
