//! The layers of the crate: no module uses a module of a higher layer, and no method uses another method.
//!
//! Reads the source files, so it runs natively only.

use std::fs;
use std::path::{Path, PathBuf};

/// The modules that each module may use besides itself. `lib.rs` documents the same order. The bindings are a crate of
/// their own, which no module can use.
const ALLOWED: [(&str, &[&str]); 10] = [
    ("warning", &[]),
    ("pauses", &[]),
    ("math", &["pauses"]),
    ("mesh", &["math", "pauses"]),
    ("spatial", &["math", "mesh", "pauses"]),
    ("volume", &["math", "mesh", "pauses", "warning"]),
    ("io", &["math", "mesh", "volume", "warning"]),
    ("voxelise", &["math", "mesh", "pauses", "spatial", "volume"]),
    ("remesh", &["math", "mesh", "pauses", "spatial", "volume"]),
    ("methods", &["math", "mesh", "pauses", "spatial", "volume", "remesh", "warning"]),
];

/// Returns the names that follow `prefix` anywhere in the code: `crate::a::b` and `crate::{a::b, c}` give a; a and c.
fn names_after(prefix: &str, code: &str) -> Vec<String> {
    let bare = without_comments(code);
    bare.match_indices(prefix)
        .filter(|&(start, _)| {
            !bare[..start].ends_with(|before: char| before.is_alphanumeric() || before == ':')
        })
        .flat_map(|(start, _)| heads(&bare[start + prefix.len()..]))
        .collect()
}

fn without_comments(code: &str) -> String {
    let lines = code.lines().map(|line| line.split_once("//").map_or(line, |(before, _)| before));
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the first name of a path, or of each path of a group in braces.
fn heads(path: &str) -> Vec<String> {
    let Some(group) = path.strip_prefix('{') else {
        return vec![path.chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect()];
    };
    let mut depth = 0;
    let outer: String = group
        .chars()
        .take_while(|&c| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            depth >= 0
        })
        .collect();
    split_outside_braces(&outer).iter().flat_map(|part| heads(part.trim())).collect()
}

fn split_outside_braces(list: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut depth = 0;
    for c in list.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if c == ',' && depth == 0 {
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            part.push(c);
        }
    }
    parts
}

/// Returns the modules of the crate that `code`, part of `module`, uses and must not.
fn forbidden(module: &str, code: &str) -> Vec<String> {
    let known = |name: &str| ALLOWED.iter().find(|(module, _)| *module == name);
    let allowed = known(module).map_or(&[][..], |(_, allowed)| *allowed);
    let mut used = names_after("crate::", code);
    used.retain(|name| known(name).is_some() && name != module && !allowed.contains(&name.as_str()));
    used
}

/// Returns the other methods that `code`, part of the method `method`, uses.
fn other_methods(method: &str, methods: &[String], code: &str) -> Vec<String> {
    let mut used = names_after("crate::methods::", code);
    used.extend(names_after("super::super::", code));
    used.retain(|name| name != method && methods.contains(name));
    used
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// Returns the files of a module, which may be a single one.
fn files_of(module: &str) -> Vec<PathBuf> {
    let file = source(&format!("{module}.rs"));
    if file.is_file() { vec![file] } else { rust_files(&source(module)) }
}

fn source(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder)
}

fn folders(path: &Path) -> Vec<String> {
    let entries = fs::read_dir(path).unwrap().map(|entry| entry.unwrap());
    let folders = entries.filter(|entry| entry.path().is_dir());
    folders.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

#[test]
fn every_module_belongs_to_a_layer() {
    for module in folders(&source("")).into_iter().filter(|module| module != "bindings") {
        assert!(
            ALLOWED.iter().any(|(name, _)| *name == module),
            "src/{module} is in no layer: add it to ALLOWED"
        );
    }
}

#[test]
fn no_module_uses_a_higher_layer() {
    let mut files = 0;
    for (module, _) in ALLOWED {
        for file in files_of(module) {
            let found = forbidden(module, &fs::read_to_string(&file).unwrap());
            assert!(found.is_empty(), "{} uses {found:?}, which `{module}` may not", file.display());
            files += 1;
        }
    }
    assert!(files > ALLOWED.len(), "only {files} files were read");
}

#[test]
fn no_method_uses_another() {
    let methods = folders(&source("methods"));
    for method in &methods {
        for file in rust_files(&source("methods").join(method)) {
            let found = other_methods(method, &methods, &fs::read_to_string(&file).unwrap());
            assert!(found.is_empty(), "{} uses {found:?}: what both need belongs below them", file.display());
        }
    }
}

#[test]
fn an_import_of_a_higher_layer_is_detected() {
    assert_eq!(forbidden("mesh", "use crate::volume::Volume;"), ["volume"]);
    assert_eq!(forbidden("math", "use crate::{mesh::{Mesh, Ring}, math::Vec3, io};"), ["mesh", "io"]);
    assert_eq!(forbidden("io", "fn f() -> crate::spatial::Tree {}"), ["spatial"]);
    assert!(forbidden("mesh", "use crate::math::Vec3; // not crate::volume\nuse super::ids;").is_empty());
    let methods = ["deformable", "implicit"].map(String::from);
    assert_eq!(
        other_methods("implicit", &methods, "use crate::methods::{StepReport, deformable::X};"),
        ["deformable"]
    );
    assert_eq!(other_methods("implicit", &methods, "use super::super::deformable::X;"), ["deformable"]);
    assert!(other_methods("implicit", &methods, "use crate::methods::implicit::X;").is_empty());
}
