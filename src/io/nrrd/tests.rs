//! Tests of NRRD files with frames along any axis, described in every way that the format allows, and of axes that must
//! not be read as frames.

use crate::io::FormatError;
use crate::io::parse_volume as parse;
use crate::math::DVec3;
use crate::volume::{LengthUnit, Space, Volume};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const DIRECTED: &str = "space directions: (2,0,0) (0,3,0) (0,0,4)";

/// Returns an NRRD file of 2 × 3 × 4 voxels in 2 frames whose frame axis has index `frames`. Each voxel's value is its
/// index in the volume after reading: x fastest, then y, z and frames.
fn file(frames: usize, fields: &[&str]) -> Vec<u8> {
    let mut sizes = vec![2, 3, 4];
    sizes.insert(frames, 2);
    let mut steps = vec![1, 2, 6];
    steps.insert(frames, 24);
    let number = |at: usize| {
        let (mut rest, mut number) = (at, 0);
        for (size, step) in sizes.iter().zip(&steps) {
            number += rest % size * step;
            rest /= size;
        }
        number as u8
    };
    let [a, b, c, d] = sizes[..] else { panic!("{sizes:?}") };
    let fields = fields.join("\n");
    let header =
        format!("NRRD0005\ntype: uint8\nencoding: raw\ndimension: 4\nsizes: {a} {b} {c} {d}\n{fields}\n\n");
    [header.into_bytes(), (0..48).map(number).collect()].concat()
}

/// Returns an NRRD header field with one word per axis: `own` for the frame axis, whose index is `frames`, and `others`
/// for the spatial axes.
fn with(frames: usize, name: &str, others: [&str; 3], own: &str) -> String {
    let mut words = others.to_vec();
    words.insert(frames, own);
    format!("{name}: {}", words.join(" "))
}

fn assert_counted(volume: &Volume, what: &str) {
    assert_eq!((volume.dims(), volume.frames()), ([2, 3, 4], 2), "{what}");
    for t in 0..2 {
        let expected: Vec<f32> = (0..24).map(|i| (i + 24 * t) as f32).collect();
        assert_eq!(volume.intensities(t).unwrap(), expected, "{what}, frame {t}");
    }
    assert_eq!(volume.spacing(), [2.0, 3.0, 4.0], "{what}");
}

fn assert_read(frames: usize, fields: &[&str], seconds: f64) {
    let what = format!("axis {frames}, {}", fields.join(", "));
    let volume = parse(&file(frames, fields), None).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_counted(&volume, &what);
    assert_eq!(volume.frame_seconds(), seconds, "{what}");
}

fn refusal(frames: usize, fields: &[&str]) -> String {
    let what = fields.join(", ");
    parse(&file(frames, fields), None).expect_err(&what).to_string()
}

#[test]
fn frames_by_directions_wherever_their_axis_is() {
    let vectors = ["(2,0,0)", "(0,3,0)", "(0,0,4)"];
    for frames in 0..4 {
        for none in ["none", "(0,0,0)", "( nan, NaN,nan)"] {
            let directions = with(frames, "space directions", vectors, none);
            for kind in ["list", "time", "domain", "???"] {
                let kinds = with(frames, "kinds", ["domain", "space", "domain"], kind);
                assert_read(frames, &["space: LPS", &directions, &kinds], 0.0);
            }
            assert_read(frames, &["space dimension: 3", &directions], 0.0);
            let spacings = with(frames, "spacings", ["nan"; 3], "40");
            let units = with(frames, "units", ["\"\""; 3], "\"ms\"");
            assert_read(frames, &["space: RAS", &directions, &spacings, &units], 0.04);
        }
    }
}

#[test]
fn frames_by_the_time_of_the_world() {
    let vectors = ["(2,0,0,0)", "(0,3,0,0)", "(0,0,4,0)"];
    for frames in 0..4 {
        let directions = with(frames, "space directions", vectors, "(0,0,0,0.5)");
        let spaces = ["right-anterior-superior", "left-posterior-superior", "scanner-xyz", "3D-left-handed"];
        for space in spaces {
            let space = format!("space: {space}-time");
            assert_read(frames, &[&space, &directions, "space origin: (1,2,3,9)"], 0.5);
            let units = "space units: \"mm\" \"mm\" \"mm\" \"ms\"";
            assert_read(frames, &[&space, &directions, units], 0.0005);
        }
        // The fourth dimension is time only if its kind says so.
        assert_read(frames, &["space dimension: 4", &directions], 0.0);
        let kinds = with(frames, "kinds", ["space"; 3], "time");
        assert_read(frames, &["space dimension: 4", &directions, &kinds], 0.5);
        for none in ["none", "(0,0,0,0)", "(nan,nan,nan,nan)", "(0,0,0,-1)", "(0,0,0,nan)"] {
            assert_read(frames, &["space: RAST", &with(frames, "space directions", vectors, none)], 0.0);
        }
    }
    let fields = ["space: LAST", "space directions: (2,0,0,0) (0,3,0,0) (0,0,4,0) none"];
    let placed = [fields[0], fields[1], "space origin: (5,6,7,8)", "space units: \"um\" \"um\" \"um\" \"s\""];
    let volume = parse(&file(3, &placed), None).unwrap();
    assert_eq!(volume.affine().translation, DVec3::new(-5.0, 6.0, 7.0));
    assert_eq!((volume.space(), volume.unit()), (Space::Ras, LengthUnit::Micrometre));
}

#[test]
fn frames_by_kinds_units_and_spacings() {
    let lengths = ["2", "3", "4"];
    for frames in 0..4 {
        let spaced = |own| with(frames, "spacings", lengths, own);
        for (kind, seconds) in [("time", 0.5), ("list", 0.0), ("none", 0.0)] {
            let kinds = with(frames, "kinds", ["domain"; 3], kind);
            assert_read(frames, &[&spaced("0.5"), &kinds], seconds);
        }
        assert_read(frames, &[&spaced("0.5"), &with(frames, "kinds", ["space"; 3], "domain")], 0.0);
        let units = with(frames, "units", ["\"mm\""; 3], "\"s\"");
        assert_read(frames, &[&spaced("0.5"), &units], 0.5);
        for kind in ["domain", "???"] {
            assert_read(frames, &[&spaced("NaN"), &with(frames, "kinds", [kind; 3], kind)], 0.0);
        }
        assert_read(frames, &[&spaced("NaN")], 0.0);
    }
    assert_read(3, &["spacings: 2 3 4 0.5"], 0.0);
    for (own, unit) in [("0", "s"), ("-1", "s"), ("inf", "s"), ("nan", "s"), ("1", "Hz")] {
        let units = with(3, "units", ["\"mm\""; 3], &format!("\"{unit}\""));
        assert_read(3, &[&with(3, "spacings", lengths, own), &units], 0.0);
    }
    let units = "units: \"s\" \"mm\" \"mm\" \"mm\"";
    let volume = parse(&file(0, &["spacings: 1 2 3 4", units]), None).unwrap();
    assert_eq!(volume.unit(), LengthUnit::Millimetre);
}

/// Reads an NRRD file of 24 numbers with the given header fields; returns its dimensions, its number of frames and the
/// seconds between them.
fn grid(fields: &[&str]) -> Result<([usize; 3], usize, f64), FormatError> {
    let fields = fields.join("\n");
    let header = format!("NRRD0004\ntype: uint8\nencoding: raw\n{fields}\n\n");
    let volume = parse(&[header.into_bytes(), (0..24).collect()].concat(), None)?;
    Ok((volume.dims(), volume.frames(), volume.frame_seconds()))
}

#[test]
fn frames_of_fewer_dimensions() {
    let flat = ["dimension: 3", "sizes: 2 3 4"];
    let flat = |more: &[&str]| grid(&[&flat[..], more].concat());
    assert_eq!(flat(&["kinds: domain domain time"]), Ok(([2, 3, 1], 4, 0.0)));
    assert_eq!(flat(&["kinds: time space space", "spacings: 0.5 1 1"]), Ok(([3, 4, 1], 2, 0.5)));
    assert_eq!(flat(&["kinds: domain list domain"]), Ok(([2, 4, 1], 3, 0.0)));
    let units = "units: \"mm\" \"mm\" \"ms\"";
    assert_eq!(flat(&["spacings: 1 1 40", units]), Ok(([2, 3, 1], 4, 0.04)));
    assert_eq!(flat(&["space directions: (1,0,0) (nan,nan,nan) (0,0,1)"]), Ok(([2, 4, 1], 3, 0.0)));
    let directions = "space directions: (1,0,0) (0,1,0) (0,0,0)";
    assert_eq!(flat(&[directions, "kinds: domain domain time"]), Ok(([2, 3, 1], 4, 0.0)));
    let plane = ["space dimension: 2", "space directions: (1,0) (0,1) none"];
    assert_eq!(flat(&plane), Ok(([2, 3, 1], 4, 0.0)));
    let timed = "space directions: (1,0,0,0) (0,1,0,0) (0,0,0,2)";
    assert_eq!(flat(&["space: LPST", timed]), Ok(([2, 3, 1], 4, 2.0)));
    for still in ["spacings: 1 1 NaN", "kinds: domain domain ???", "kinds: space space domain"] {
        assert_eq!(flat(&[still]), Ok(([2, 3, 4], 1, 0.0)), "{still}");
    }
    assert_eq!(grid(&["dimension: 2", "sizes: 4 6", "kinds: list domain"]), Ok(([6, 1, 1], 4, 0.0)));
    let held = ["dimension: 4", "sizes: 1 2 3 4", "kinds: stub domain domain domain"];
    assert_eq!(grid(&held), Ok(([2, 3, 4], 1, 0.0)));
}

#[test]
fn vectors_and_colours_are_no_frames() {
    let kinds = ["vector", "RGB-color", "3-color", "complex", "point", "3D-matrix", "stub"];
    for frames in 0..4 {
        for kind in kinds {
            let line = with(frames, "kinds", ["domain"; 3], kind);
            let directions = with(frames, "space directions", ["(2,0,0)", "(0,3,0)", "(0,0,4)"], "none");
            for fields in [&[&line[..]][..], &[&line, &directions]] {
                let message = refusal(frames, fields);
                assert!(message.contains(&format!("kinds: '{kind}' for axis {frames}")), "{message}");
            }
        }
    }
}

#[test]
fn axes_that_contradict_each_other_are_refused() {
    let domains = "kinds: domain domain domain time";
    for (field, fields) in [
        ("kinds", &["kinds: list domain domain time"][..]),
        ("kinds", &["kinds: domain domain time"]),
        ("kinds", &["spacings: NaN NaN 3 4"]),
        ("kinds", &["kinds: ??? ??? domain domain"]),
        ("kinds", &["kinds: time domain domain domain", "space directions: (2,0,0) (0,3,0) (0,0,4) none"]),
        ("spacings", &[domains, "spacings: 2 0 4 1"]),
        ("spacings", &[domains, "spacings: 2 inf 4 1"]),
        ("spacings", &[domains, "spacings: 2 3 4"]),
        ("axismaxs", &[domains, "axis maxs: 2 3 4 1"]),
        ("spacedirections", &[DIRECTED]),
        ("spacedirections", &["space directions: (2,0,0) (0,3,0) (0,0,4) (1,1,1)"]),
        ("spacedirections", &["space directions: (2,0,0) (0,3,0) none none"]),
        ("spacedirections", &["space directions: none none none none"]),
        ("spacedirections", &["space directions: (2,0,0) (0,3,0) (0,0,4) (0,0,0"]),
        ("spacedirections", &["space: RAST", "space directions: (2,0,0) (0,3,0) (0,0,4) none"]),
        ("spacedirections", &["space: RAS", "space directions: (2,0,0,0) (0,3,0,0) (0,0,4,0) none"]),
        ("spacedirections", &["space: RAST", "space directions: (2,0,0,1) (0,3,0,0) (0,0,4,0) none"]),
        ("spaceorigin", &["space: RAST", "space origin: (1,2,3)"]),
        ("space dimension", &["space dimension: 5"]),
    ] {
        let message = refusal(3, fields);
        assert!(message.starts_with(&format!("NRRD: {field}: ")), "{fields:?}: {message}");
    }
    // The distance of the slices was unknown when the file was written.
    for kinds in ["kinds: domain domain domain", "kinds: space space space"] {
        let unknown = "space directions: (1,0,0) (0,1,0) (0,0,0)";
        let found = grid(&["dimension: 3", "sizes: 2 3 4", kinds, unknown]);
        assert!(found.expect_err(kinds).to_string().contains("affine"));
    }
    for kinds in ["kinds: time", "kinds: list"] {
        assert!(grid(&["dimension: 1", "sizes: 24", kinds]).is_err(), "{kinds}");
    }
    let lengths = "sizes: 99999999999 2 99999999999 99999999999";
    assert!(grid(&["dimension: 4", lengths, "kinds: domain list domain domain"]).is_err());
}

#[test]
fn a_header_is_read_to_its_end_or_refused() {
    // As of a segmentation with thousands of segments; a comment goes beyond the limit.
    let file = |keys: usize| {
        let fields = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n";
        let segments: String =
            (0..keys).map(|i| format!("# Segment{i}_Name:={}\n", "x".repeat(1000))).collect();
        [fields.as_bytes(), segments.as_bytes(), b"\n", &[7, 9]].concat()
    };
    let volume = parse(&file(5000), None).expect("a header of 5 MB");
    assert_eq!(volume.intensities(0).unwrap(), [7.0, 9.0]);
    let message = parse(&file(17_000), None).expect_err("a header of 17 MB").to_string();
    assert_eq!(message, "NRRD: header: must have at most 16 MiB");
}
