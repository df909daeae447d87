//! Fuzz targets of saved states with valid checksums and changed contents: each is rejected, or the run continues from
//! it.

use super::steppers;
use std::sync::LazyLock;
use vesicle::mesh::Mesh;
use vesicle::methods::deformable::DeformableModel;
use vesicle::methods::implicit::ImplicitSurface;
use vesicle::methods::multires::MultiresolutionModel;
use vesicle::methods::tracking::SurfaceTracker;

/// Size of signature and checksum at the start of a saved state, in bytes.
const HEADER: usize = 16;

/// Returns a saved state with a valid checksum: the signature and the fingerprint of the input from `saved`, followed
/// by `contents`.
pub fn with_checksum(saved: &[u8], contents: &[u8]) -> Vec<u8> {
    let body = [&saved[HEADER..contents_offset(saved)], contents].concat();
    let mix = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    let sum = body.iter().fold(0xcbf2_9ce4_8422_2325, mix);
    [&saved[..8], &sum.to_le_bytes(), &body].concat()
}

/// Returns the offset of the contents in a saved state, in bytes: after the header and the fingerprint of the input, an
/// integer of variable length whose last byte is the first below 128.
pub fn contents_offset(saved: &[u8]) -> usize {
    let number = &saved[HEADER..];
    HEADER + 1 + number.iter().position(|&byte| byte < 0x80).unwrap_or(0)
}

/// Defines a function that returns the saved state of a small fixed model after three steps, and that model before
/// them.
macro_rules! scene {
    ($name:ident, $model:ty, $make:expr) => {
        fn $name() -> (&'static [u8], $model) {
            static SAVED: LazyLock<Vec<u8>> = LazyLock::new(|| {
                let mut model = $make;
                for _ in 0..3 {
                    _ = model.step();
                }
                model.save()
            });
            (&SAVED, $make)
        }
    };
}

/// Defines a target that restores a state with changed contents. If it is rejected, the unchanged state can still be
/// restored and saved; if it is accepted, the model's own state can be, and the meshes are valid after each of two
/// steps.
macro_rules! target {
    ($name:ident, $saved:ident, $scene:ident, $meshes:expr) => {
        pub fn $name(data: &[u8]) {
            let (saved, mut model) = $scene();
            if model.restore(&with_checksum(saved, data)).is_err() {
                assert_eq!(model.restore(saved), Ok(()), "a refusal changed the run");
                assert!(model.save() == saved, "a refusal changed the run");
                return;
            }
            let own = model.save();
            assert_eq!(model.restore(&own), Ok(()), "its own state");
            assert!(model.save() == own, "another state comes out");
            for _ in 0..2 {
                _ = model.step();
                for mesh in $meshes(&model) {
                    assert_eq!(mesh.check(), Ok(()));
                }
            }
        }

        /// Returns the contents of the unchanged state, the seed of the target.
        pub fn $saved() -> Vec<u8> {
            let (saved, _) = $scene();
            saved[contents_offset(saved)..].to_vec()
        }
    };
}

scene!(small_deformable, DeformableModel, steppers::small_deformable());
target!(deformable, deformable_seed, small_deformable, |model: &DeformableModel| [model.mesh().clone()]);

scene!(small_implicit, ImplicitSurface, steppers::small_implicit());
target!(implicit, implicit_seed, small_implicit, |_: &ImplicitSurface| Vec::<Mesh>::new());

scene!(small_multires, MultiresolutionModel, steppers::small_multires());
target!(multires, multires_seed, small_multires, |model: &MultiresolutionModel| [
    model.mesh().clone(),
    model.base_mesh().clone()
]);

scene!(small_tracking, SurfaceTracker, steppers::small_tracking());
target!(tracking, tracking_seed, small_tracking, |model: &SurfaceTracker| [model.mesh().clone()]);
