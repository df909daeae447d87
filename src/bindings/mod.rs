//! The JavaScript face of the core: convert, call one core function, convert back.
//!
//! What is exported here is private to the npm package: the classes people use are the TypeScript ones in
//! `js/`, which hold these as raw handles and check every argument first.

use wasm_bindgen::prelude::wasm_bindgen;

/// The version of the library, as in `Cargo.toml`.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
