//! JavaScript bindings of the core: each converts its arguments, calls one core function and converts the result.
//!
//! These exports are private to the npm package. Its public classes are the TypeScript ones in `js/`, which hold these
//! as raw handles and check all arguments first.

#![cfg(target_arch = "wasm32")]
#![cfg_attr(
    not(all(
        feature = "deformable",
        feature = "implicit",
        feature = "tracking",
        feature = "multires",
        feature = "import",
        feature = "enrich",
        feature = "labels",
        feature = "sparse"
    )),
    allow(dead_code, reason = "what some methods share is unused without them")
)]

// Only sequences and the strokes of a sculptor are saved as animations.
#[cfg(any(feature = "tracking", feature = "multires"))]
mod animation;
mod convert;
#[cfg(feature = "deformable")]
mod deformable;
#[cfg(feature = "labels")]
mod editing;
#[cfg(feature = "enrich")]
mod enrich;
mod error;
#[cfg(all(feature = "import", not(feature = "processing")))]
mod files;
#[cfg(feature = "tracking")]
mod frames;
#[cfg(feature = "implicit")]
mod implicit;
#[cfg(all(feature = "import", feature = "processing"))]
mod import;
#[cfg(feature = "labels")]
mod label_surfaces;
#[cfg(feature = "labels")]
mod labels;
#[cfg(feature = "processing")]
mod mesh;
#[cfg(any(
    feature = "deformable",
    feature = "implicit",
    feature = "tracking",
    feature = "multires",
    feature = "labels"
))]
mod method;
#[cfg(feature = "multires")]
mod multires;
#[cfg(feature = "import")]
mod readers;
#[cfg(feature = "labels")]
mod slices;
#[cfg(all(feature = "sparse", feature = "deformable"))]
mod sparse;
#[cfg(any(feature = "deformable", feature = "tracking", feature = "multires"))]
mod stepping;
mod texture;
#[cfg(feature = "tracking")]
mod tracking;
#[cfg(feature = "processing")]
mod volume;
#[cfg(feature = "labels")]
mod voxelise;

use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::throw_val;

use error::Failure;

/// Installs a panic hook that throws the message of the panic as a failure; runs once, when the module is instantiated.
#[wasm_bindgen(start)]
pub fn start() {
    // A panic aborts the module. Thrown from here, its message reaches the caller, who learns that the instance is
    // unusable.
    std::panic::set_hook(Box::new(|info| throw_val(Failure::new("panic", info.to_string()).into())));
}

/// Returns the version of the library, as in `Cargo.toml`.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
