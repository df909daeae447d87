//! The JavaScript face of the core: convert, call one core function, convert back.
//!
//! What is exported here is private to the npm package: the classes people use are the TypeScript ones in
//! `js/`, which hold these as raw handles and check every argument first.

mod animation;
mod convert;
mod deformable;
mod error;
mod implicit;
mod mesh;
mod multires;
mod tracking;
mod volume;

use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::throw_val;

use error::Failure;

/// Runs once, when the module starts.
#[wasm_bindgen(start)]
pub fn start() {
    // A panic aborts; thrown from here its message reaches the caller, who is told that the instance is lost.
    std::panic::set_hook(Box::new(|info| throw_val(Failure::new("panic", info.to_string()).into())));
}

/// The version of the library, as in `Cargo.toml`.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
