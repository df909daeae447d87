//! The fuzz targets (`fuzz`, docs/fuzzing.md) without a fuzzer: each runs on its seeds and on thousands of mutations of
//! them.
//!
//! `cargo test --lib write_seeds -- --ignored` rewrites the seeds from the files in `data` and from small scenes.

#[path = "../../fuzz/src/lib.rs"]
mod fuzz;
#[path = "../common/fuzz_seeds.rs"]
mod fuzz_seeds;

use super::common::Random;
use fuzz::Target;
use std::fs;
use std::path::{Path, PathBuf};

fn fuzz_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz")
}

fn folder(target: &str) -> PathBuf {
    fuzz_folder().join("seeds").join(target)
}

/// Returns the stored seeds of a target, sorted by name.
fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let files = fs::read_dir(folder(target)).unwrap_or_else(|error| panic!("seeds of {target}: {error}"));
    let mut paths: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.display().to_string(), fs::read(&path).unwrap())).collect()
}

/// Prints the current input if a panic unwinds.
struct Running<'a>(&'a str, &'a [u8]);

impl Drop for Running<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("{}: {:?}", self.0, self.1);
        }
    }
}

/// Returns a seed with one to four random mutations of the kinds that a fuzzer makes.
fn mutated(seeds: &[(String, Vec<u8>)], random: &mut Random) -> Vec<u8> {
    let mut data = seeds[random.below(seeds.len())].1.clone();
    for _ in 0..1 + random.below(4) {
        let at = random.below(data.len() + 1);
        let length = random.below(9).min(data.len() - at);
        let other = &seeds[random.below(seeds.len())].1;
        match random.below(7) {
            0 => data.truncate(at),
            1 => _ = data.drain(at..at + length),
            2 => data.splice(at..at, other.iter().copied().skip(at).take(16)).for_each(drop),
            3 => data[at..at + length].fill([0, 0xFF, 0x7F, 0x80, b'9'][random.below(5)]),
            4 => data.splice(at..at + length, *b"-1").for_each(drop),
            5 => data[at..at + length].iter_mut().for_each(|b| *b = random.next() as u8),
            _ => data[at..].iter_mut().take(1).for_each(|b| *b ^= 1 << random.below(8)),
        }
    }
    data.truncate(4096);
    data
}

fn replay(name: &str) {
    let target = fuzz::target(name);
    let seeds = seeds(name);
    assert!(!seeds.is_empty(), "{} has no seeds", target.name);
    for (path, data) in &seeds {
        let _running = Running(path, data);
        fuzz::run(target.name, data);
    }
    let mut random = Random(1);
    for _ in 0..target.mutations {
        let data = mutated(&seeds, &mut random);
        let _running = Running(target.name, &data);
        fuzz::run(target.name, &data);
    }
}

/// Generates a test for each target, with the target's name.
macro_rules! replayed {
    ($($name:ident),+) => {
        mod nothing_panics_or_takes_too_much_memory {
            $(
                #[test]
                fn $name() {
                    super::replay(stringify!($name));
                }
            )+
        }

        const REPLAYED: &[&str] = &[$(stringify!($name)),+];
    };
}

replayed!(
    nifti,
    nrrd,
    metaimage,
    volume_pair,
    gzip,
    ply,
    stl,
    obj,
    glb,
    gltf,
    glb_parts,
    points,
    state_deformable,
    state_implicit,
    state_multires,
    state_tracking,
    deformable,
    implicit,
    multires,
    tracking,
    edits,
    remeshing
);

/// Each target has a binary of its own, as cargo-fuzz requires, and a test.
#[test]
fn every_target_has_a_binary_and_a_test() {
    assert_eq!(REPLAYED, fuzz::TARGETS.each_ref().map(|target| target.name));
    let manifest = fs::read_to_string(fuzz_folder().join("Cargo.toml")).unwrap();
    assert_eq!(manifest.matches("[[bin]]").count(), fuzz::TARGETS.len());
    for Target { name, .. } in &fuzz::TARGETS {
        assert!(manifest.contains(&format!("path = \"targets/{name}.rs\"")), "{name}");
        let program = fs::read_to_string(fuzz_folder().join(format!("targets/{name}.rs"))).unwrap();
        assert!(program.contains(&format!("run(\"{name}\", data)")), "{name}");
    }
}

#[test]
#[ignore = "writes into the repository"]
fn write_seeds() {
    for Target { name, .. } in &fuzz::TARGETS {
        fs::create_dir_all(folder(name)).unwrap();
        for (file, data) in fuzz_seeds::of(name) {
            fs::write(folder(name).join(file), data).unwrap();
        }
    }
}
