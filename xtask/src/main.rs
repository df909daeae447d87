//! Project tasks in Rust: the generator of the wasm bindings and the runner of the wasm tests.
//!
//! Both call the library of `wasm-bindgen-cli`, so that its version is the one in `Cargo.lock` and nothing has to be
//! installed.
//!
//! ```text
//! cargo xtask bindgen <file.wasm> <folder> <name>
//! cargo xtask test-runner <file.wasm> [arguments of run-tests.cjs]
//! ```

use std::env;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode, id};
use wasm_bindgen_cli_support::Bindgen;

const USAGE: &str =
    "usage: cargo xtask (bindgen <file.wasm> <folder> <name> | test-runner <file.wasm> [arguments])";

/// Runs the tests of a module in Node.
const RUN_TESTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/run-tests.cjs");

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        ["bindgen", module, folder, name] => bindgen(module, folder, name).map(|()| true),
        ["test-runner", module, ref others @ ..] => run_tests(module, others),
        _ => Err(USAGE.into()),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(problem) => {
            eprintln!("xtask: {problem:?}");
            ExitCode::FAILURE
        }
    }
}

/// Writes a module and its glue, for pages and for Node, to a folder.
fn bindgen(module: &str, folder: &str, name: &str) -> Result<(), Box<dyn Error>> {
    Bindgen::new()
        .input_path(module)
        .out_name(name)
        .web(true)?
        .typescript(true)
        // The face says where the module is, so that a bundler meets only one address of it.
        .omit_default_module_path(true)
        .remove_producers_section(true)
        // A trap loses the instance; the reset function lets a page start a new one without reloading.
        .reset_state_function(true)
        .generate(folder)?;
    Ok(())
}

/// Runs the tests of a module as cargo compiles it, and returns whether they pass.
fn run_tests(module: &str, arguments: &[&str]) -> Result<bool, Box<dyn Error>> {
    // Outside the project, whose package.json would make the glue a module of another kind.
    let folder = env::temp_dir().join(format!("vesicle-tests-{}", id()));
    let passed = run_tests_in(&folder, module, arguments)?;
    fs::remove_dir_all(&folder)?;
    Ok(passed)
}

fn run_tests_in(folder: &Path, module: &str, arguments: &[&str]) -> Result<bool, Box<dyn Error>> {
    // The tests are exports of the module, which the glue has to make available.
    Bindgen::new()
        .input_path(module)
        .out_name("tests")
        .nodejs(true)?
        .debug(true)
        .export_wasm(true)
        .emit_start(false)
        .generate(folder)?;
    let status = Command::new("node").arg(RUN_TESTS).arg(folder.join("tests.js")).args(arguments).status()?;
    Ok(status.success())
}
