//! Project tasks that need Rust: the wasm glue generator and the wasm test runner.
fn main() {}
