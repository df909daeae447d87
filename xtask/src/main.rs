//! Project tasks in Rust: the generator of the wasm bindings and the runner of the wasm tests.
//!
//! Both are the programs of `wasm-bindgen-cli`, called as a library, so that their version is the one in `Cargo.lock`
//! and nothing has to be installed.
//!
//! ```text
//! cargo xtask bindgen <arguments of wasm-bindgen>
//! cargo xtask test-runner <file.wasm> [arguments of wasm-bindgen-test-runner]
//! ```

use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask (bindgen | test-runner) <arguments>";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("xtask: {problem}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let mut arguments = env::args_os().skip(1);
    let task = arguments.next().ok_or(USAGE)?;
    // Both programs expect their own name as first argument, as on a command line.
    let arguments: Vec<OsString> = [task.clone()].into_iter().chain(arguments).collect();
    match task.to_str() {
        Some("bindgen") => wasm_bindgen_cli::wasm_bindgen::run_cli_with_args(arguments),
        Some("test-runner") => wasm_bindgen_cli::wasm_bindgen_test_runner::run_cli_with_args(arguments),
        _ => return Err(format!("unknown task {}; {USAGE}", task.display())),
    }
    .map_err(|error| format!("{error:?}"))
}
