//! Volume files of every accepted format, compared with what their usual libraries (nibabel, pynrrd, SimpleITK) read,
//! and the errors of broken files.

use super::common::Random;
use vesicle::io::{FormatError, parse_volume, write_nifti};
use vesicle::math::{DAffine3, DVec3};
use vesicle::volume::{LengthUnit, Space, Volume, VolumeInit, Voxels};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

macro_rules! made {
    ($($name:expr),+) => { &include_bytes!(concat!("../data/volumes/made/", $($name),+))[..] };
}
macro_rules! i2nii {
    ($name:expr) => {
        &include_bytes!(concat!("../data/volumes/i2nii/", $name))[..]
    };
}

/// Affine of the volumes in `made`, rows in RAS, as nibabel reads it.
const MADE: [[f64; 4]; 3] = [[0.54, -1.6, -1.44, -10.0], [0.72, 1.2, -1.92, 20.0], [1.2, 0.0, 1.8, 5.5]];
/// Affine of the volumes in `i2nii`, rows in RAS, as nibabel reads it from the .nii.gz and the .mgz.
const I2NII: [[f64; 4]; 3] =
    [[-3.4375, 0.0, 0.0, 108.281], [0.0, 3.4375, 0.0, -82.3795], [0.0, 0.0, 3.8, -47.8356]];

fn read(bytes: &[u8]) -> Volume {
    parse_volume(bytes, None).unwrap_or_else(|error| panic!("{error}"))
}

fn read_pair(bytes: &[u8], detached: &[u8]) -> Volume {
    parse_volume(bytes, Some(detached)).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the RAS position of a voxel, whatever the volume's own space.
fn in_ras(volume: &Volume, index: DVec3) -> DVec3 {
    let p = volume.affine().transform_point3(index);
    if volume.space() == Space::Lps { DVec3::new(-p.x, -p.y, p.z) } else { p }
}

fn assert_world(volume: &Volume, rows: [[f64; 4]; 3], name: &str) {
    for index in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(4.0, 3.0, 2.0)] {
        let expected = DVec3::from(rows.map(|r| r[0] * index.x + r[1] * index.y + r[2] * index.z + r[3]));
        let found = in_ras(volume, index);
        assert!(found.distance(expected) < 2e-5, "{name}: voxel {index} at {found}, not {expected}");
    }
}

/// Asserts that every voxel (x, y, z, t) is unit * (x + 5y + 20z + 60t).
fn assert_ramp(volume: &Volume, unit: f64, frames: usize, name: &str) {
    assert_eq!((volume.dims(), volume.frames()), ([5, 4, 3], frames), "{name}");
    for t in 0..frames {
        let expected: Vec<f32> = (0..60).map(|i| ((i + 60 * t) as f64 * unit) as f32).collect();
        assert_eq!(volume.intensities(t).unwrap(), expected, "{name}, frame {t}");
    }
}

fn assert_made(bytes: &[u8], unit: f64, name: &str) -> Volume {
    let volume = read(bytes);
    assert_ramp(&volume, unit, 1, name);
    assert_world(&volume, MADE, name);
    volume
}

/// Returns format and field of the error that reading gives.
fn refusal(bytes: &[u8], detached: Option<&[u8]>) -> (&'static str, String) {
    match parse_volume(bytes, detached).expect_err("must be refused") {
        FormatError::Invalid { format, field, .. }
        | FormatError::Unsupported { format, field, .. }
        | FormatError::Truncated { format, field, .. }
        | FormatError::TooLarge { format, field, .. } => (format, field),
    }
}

macro_rules! all_files_of_type {
    ($($kind:literal $unit:literal),+) => { $(
        for (name, bytes) in [
            (concat!($kind, ".nii"), made!($kind, ".nii")),
            (concat!($kind, "_big.nii"), made!($kind, "_big.nii")),
            (concat!($kind, "_little.nrrd"), made!($kind, "_little.nrrd")),
            (concat!($kind, "_big.nrrd"), made!($kind, "_big.nrrd")),
            (concat!($kind, ".mha"), made!($kind, ".mha")),
        ] {
            assert_made(bytes, $unit, name);
        }
    )+ };
}

#[test]
fn every_voxel_type_in_every_format_and_byte_order() {
    all_files_of_type!("i1" 1.0, "u1" 1.0, "i2" 100.0, "u2" 100.0, "i4" 1e6, "u4" 1e6, "i8" 1e6, "u8" 1e6, "f4" 0.25, "f8" 0.25);
}

#[test]
fn voxels_keep_their_stored_type() {
    assert!(matches!(read(made!("u1.nii")).voxels(), Voxels::U8(_)));
    assert!(matches!(read(made!("i2_big.nrrd")).voxels(), Voxels::I16(_)));
    assert!(matches!(read(made!("u4.mha")).voxels(), Voxels::U32(_)));
    // Numbers of 64 bits that fit in 32 are stored so, as labels have to be integers.
    assert!(matches!(read(made!("i8.nii")).voxels(), Voxels::I32(_)));
    assert!(matches!(read(made!("u8_big.nrrd")).voxels(), Voxels::U32(_)));
}

#[test]
fn spaces_are_kept_as_stored() {
    assert_eq!(read(made!("u1.nii")).space(), Space::Ras);
    assert_eq!(read(made!("u1.mha")).space(), Space::Lps);
    assert_eq!(read(made!("gzip_lps.nrrd")).space(), Space::Lps);
    assert_eq!(read(made!("gzip_ras.nrrd")).space(), Space::Ras);
    assert_eq!(read(made!("gzip_las.nrrd")).space(), Space::Ras);
}

#[test]
fn one_volume_is_the_same_from_every_container() {
    for (name, bytes) in [
        ("gzip_lps.nrrd", made!("gzip_lps.nrrd")),
        ("gzip_ras.nrrd", made!("gzip_ras.nrrd")),
        ("gzip_las.nrrd", made!("gzip_las.nrrd")),
        ("itk.nrrd", made!("itk.nrrd")),
        ("itk.nii.gz", made!("itk.nii.gz")),
        ("extension.nii.gz", made!("extension.nii.gz")),
        ("compressed.mha", made!("compressed.mha")),
    ] {
        assert_made(bytes, 100.0, name);
    }
    for (name, header, payload) in [
        ("pair.hdr", made!("pair.hdr"), made!("pair.img")),
        ("detached.nhdr", made!("detached.nhdr"), made!("detached.raw")),
        ("detached.mhd", made!("detached.mhd"), made!("detached.raw")),
        ("compressed.mhd", made!("compressed.mhd"), made!("compressed.zraw")),
    ] {
        let volume = read_pair(header, payload);
        assert_ramp(&volume, 100.0, 1, name);
        assert_world(&volume, MADE, name);
    }
    assert_made(made!("ascii.nrrd"), 0.25, "ascii.nrrd");
}

#[test]
fn nifti_orientation_methods() {
    assert_made(made!("qform.nii"), 1.0, "qform.nii");
    let mirrored = read(made!("qform_mirrored_big.nii"));
    assert_world(&mirrored, MADE.map(|[x, y, z, o]| [x, y, -z, o]), "qform_mirrored_big.nii");
    let plain = read(made!("no_form.nii"));
    let rows = [[1.5, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 3.0, 0.0]];
    assert_world(&plain, rows, "no_form.nii");
}

#[test]
fn nifti_versions_frames_units_and_scaling() {
    let two = assert_made(made!("two_f4.nii.gz"), 0.25, "two_f4.nii.gz");
    assert_eq!(two.unit(), LengthUnit::Millimetre);
    let frames = read(made!("two_big_i2_4d.nii"));
    assert_ramp(&frames, 100.0, 2, "two_big_i2_4d.nii");
    assert_world(&frames, MADE, "two_big_i2_4d.nii");
    assert!((frames.frame_seconds() - 0.040).abs() < 1e-9);
    let micro = read(made!("usec_4d.nii.gz"));
    assert_ramp(&micro, 1.0, 2, "usec_4d.nii.gz");
    assert!((micro.frame_seconds() - 0.0025).abs() < 1e-9);
    assert_eq!(micro.unit(), LengthUnit::Micrometre);
    let scaled = read(made!("scaled.nii"));
    assert_eq!(scaled.intensities(0).unwrap(), (0..60).map(|i| i as f32 * 50.0 - 3.0).collect::<Vec<_>>());
    assert_eq!(scaled.range(), [-3.0, 2947.0]);
}

#[test]
fn nrrd_and_metaimage_frames() {
    let frames = read(made!("frames.nrrd"));
    assert_ramp(&frames, 100.0, 2, "frames.nrrd");
    assert_world(&frames, MADE, "frames.nrrd");
    assert_ramp(&read(made!("frames.mha")), 100.0, 2, "frames.mha");
    for (file, seconds) in [(TIME_FIRST, 0.0), (TIME_BETWEEN, 0.001)] {
        let volume = read(file);
        assert_eq!((volume.dims(), volume.frames(), volume.spacing()), ([5, 2, 3], 2, [2.0, 3.0, 4.0]));
        assert_eq!(volume.frame_seconds(), seconds);
    }
}

#[test]
fn nrrd_spacings_without_directions() {
    let volume = read(made!("spacings.nrrd"));
    assert_eq!((volume.spacing(), volume.space()), ([1.5, 2.0, 1.0], Space::Ras));
    assert_ramp(&volume, 1.0, 1, "spacings.nrrd");
}

#[test]
fn a_scan_in_four_containers_is_the_same_voxel_for_voxel_and_in_world() {
    let volumes = [
        ("converted.nii.gz", read(i2nii!("converted.nii.gz"))),
        ("nrrd.nhdr", read_pair(i2nii!("nrrd.nhdr"), i2nii!("nrrd.raw.gz"))),
        ("mha.mha", read(i2nii!("mha.mha"))),
    ];
    for (name, volume) in &volumes {
        assert_eq!(
            (volume.dims(), volume.frames(), volume.range()),
            ([64, 64, 37], 1, [0.0, 6690.0]),
            "{name}"
        );
        let rows =
            I2NII.map(|row| row.map(|v| if *name == "converted.nii.gz" { f64::from(v as f32) } else { v }));
        assert_world(volume, rows, name);
        let values = volume.intensities(0).unwrap();
        let at = |x: usize, y: usize, z: usize| values[x + 64 * (y + 64 * z)];
        assert_eq!(
            [at(0, 0, 0), at(32, 32, 18), at(21, 21, 12), at(63, 63, 36)],
            [0.0, 4369.0, 2701.0, 0.0],
            "{name}"
        );
        assert_eq!(values.iter().map(|&v| f64::from(v)).sum::<f64>(), 79_944_614.0, "{name}");
        assert_eq!(values, volumes[0].1.intensities(0).unwrap(), "{name}");
    }
}

#[test]
fn sampling_agrees_between_spaces() {
    let (ras, lps) = (read(made!("u1.nii")), read(made!("u1.mha")));
    for index in [DVec3::new(1.25, 2.5, 0.75), DVec3::new(0.1, 0.2, 1.9)] {
        let p = in_ras(&ras, index);
        let expected = index.x + 5.0 * index.y + 20.0 * index.z;
        assert!((ras.sample(p, 0).unwrap() - expected).abs() < 1e-4);
        assert!((lps.sample(DVec3::new(-p.x, -p.y, p.z), 0).unwrap() - expected).abs() < 1e-4);
    }
}

#[test]
fn unsupported_formats_and_contents_are_named() {
    let message = |bytes: &[u8]| parse_volume(bytes, None).expect_err("must be refused").to_string();
    assert!(message(i2nii!("mgh.mgz")).contains("MGH"));
    assert!(message(i2nii!("afni.BRIK+orig.HEAD")).contains("AFNI"));
    assert!(message(i2nii!("afni.BRIK+orig.BRIK")).contains("unknown signature"));
    assert!(message(made!("complex64.nii.gz")).contains("complex64"));
    assert!(message(made!("bzip2.nrrd")).contains("bzip2"));
    assert!(
        message(made!("vectors.nrrd")).contains("kinds: 'vector' for axis 0, more than one number per voxel")
    );
    assert!(message(b"").contains("signature"));
    assert!(message(b"a letter to a friend\n").contains("unknown signature"));
    assert!(message(b"<!DOCTYPE html><title>404</title>").contains("a web page in place of the file"));
    assert!(message(made!("pair.img")).contains("unknown signature"));
    for header in [made!("pair.hdr"), made!("detached.nhdr"), made!("detached.mhd")] {
        assert!(message(header).contains("; pass "));
    }
}

/// Returns an NRRD file of 2 x 2 x 2 bytes with one header line replaced or added.
fn nrrd_with(line: &str) -> Vec<u8> {
    let base = ["type: uint8", "dimension: 3", "sizes: 2 2 2", "encoding: raw"];
    let key = line.split(':').next().unwrap();
    let mut text = "NRRD0004\n".to_owned();
    for l in base.iter().filter(|l| !l.starts_with(key)) {
        text += &format!("{l}\n");
    }
    [text.as_bytes(), line.as_bytes(), b"\n\n\x00\x01\x02\x03\x04\x05\x06\x07"].concat()
}

fn meta_with(line: &str) -> Vec<u8> {
    let base = ["NDims = 3", "DimSize = 2 2 2", "ElementType = MET_UCHAR", "ElementDataFile = LOCAL"];
    let key = line.split(' ').next().unwrap();
    let mut lines: Vec<&str> = base.iter().copied().filter(|l| !l.starts_with(key)).collect();
    let at = lines.iter().position(|l| l.starts_with("ElementDataFile")).unwrap_or(lines.len());
    lines.insert(at, line);
    lines.sort_by_key(|l| !l.starts_with("NDims"));
    lines.sort_by_key(|l| l.starts_with("ElementDataFile"));
    [lines.join("\n").as_bytes(), b"\n\x00\x01\x02\x03\x04\x05\x06\x07"].concat()
}

#[test]
fn invalid_nrrd_fields_are_named() {
    assert_eq!(read(&nrrd_with("content: two\ncolour:=blue")).range(), [0.0, 7.0]);
    for (line, field) in [
        ("sizes: 2 2 3", "voxel data"),
        ("sizes: 2 2", "sizes"),
        ("sizes: 2 0 2", "sizes"),
        ("sizes: 4000000000 4000000000 4000000000", "voxel data"),
        // With 32-bit addresses, a single such size is too large.
        (
            "sizes: 99999999999 99999999999 99999999999",
            if cfg!(target_arch = "wasm32") { "sizes" } else { "voxel data" },
        ),
        ("dimension: 5", "dimension"),
        ("type: block", "type"),
        ("type: int16", "endian"),
        ("encoding: bz2", "encoding"),
        ("space: superior-anterior-right", "space"),
        ("space: right-anterior-superior-time\nspace directions: (1,0,0) (0,1,0) (0,0,1)", "spacedirections"),
        ("spacings: 1 0 1", "spacings"),
        ("spacings: 1 1", "spacings"),
        ("axis maxs: 3 3 3", "axismaxs"),
        ("space directions: (1,0,0) (0,1,0) (0,0,nan)", "affine"),
        ("space directions: (1,0,0) (0,1,0) (1,1,0)", "affine"),
        ("space directions: (1,0,0) (0,1,0)", "spacedirections"),
        ("kinds: domain domain RGB-color", "kinds"),
        ("byte skip: 100", "byte skip"),
        ("line skip: 100", "line skip"),
        ("data file: other.raw", "datafile"),
        ("spacing: 1 1 1", "spacing"),
    ] {
        assert_eq!(refusal(&nrrd_with(line), None), ("NRRD", field.to_owned()), "{line}");
    }
}

#[test]
fn error_messages_shorten_quoted_text() {
    let long = "é".repeat(5000);
    let files = [
        nrrd_with(&format!("space: {long}")),
        nrrd_with(&format!("encoding: {long}")),
        nrrd_with(&format!("{long}: 1")),
        meta_with(&format!("ElementType = {long}")),
        meta_with(&format!("BinaryData = {long}")),
    ];
    for file in files {
        let message = parse_volume(&file, None).unwrap_err().to_string();
        assert!(message.contains("éé") && message.chars().count() < 600, "{message}");
    }
}

#[test]
fn nrrd_byte_skip_hex_and_file_lists() {
    let skipped = [&nrrd_with("byte skip: 3")[..], &[8, 9, 10]].concat();
    assert_eq!(read(&skipped).range(), [3.0, 10.0]);
    let last = [&nrrd_with("byte skip: -1")[..], &[8, 9, 10]].concat();
    assert_eq!(read(&last).range(), [3.0, 10.0]);
    let header =
        b"NRRD0001\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: hex\n\n0001 0203\n04 05 06fF\n";
    assert_eq!(read(header).range(), [0.0, 255.0]);
    let list =
        b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: LIST\na.raw\nb.raw\n";
    assert_eq!(read_pair(list, &[1, 2, 3, 4, 5, 6, 7, 8]).range(), [1.0, 8.0]);
}

#[test]
fn invalid_metaimage_fields_are_named() {
    assert_eq!(read(&meta_with("Comment = two")).range(), [0.0, 7.0]);
    assert_eq!(read(&meta_with("HeaderSize = 0")).range(), [0.0, 7.0]);
    for (line, field) in [
        ("DimSize = 2 2 3", "voxel data"),
        ("DimSize = 2 2", "DimSize"),
        ("DimSize = 2 -2 2", "DimSize"),
        ("NDims = 7", "NDims"),
        ("ElementType = MET_UCHAR_ARRAY", "ElementType"),
        ("ElementNumberOfChannels = 2", "ElementNumberOfChannels"),
        ("ElementSpacing = 1 nan 1", "ElementSpacing"),
        ("ElementSpacing = 1 0 1", "affine"),
        ("TransformMatrix = 1 0 0 0 1 0", "TransformMatrix"),
        ("TransformMatrix = 1 0 0 0 1 0 1 1 0", "affine"),
        ("Offset = a b c", "Offset"),
        ("CompressedData = True", "zlib"),
        ("CompressedData = perhaps", "CompressedData"),
        ("ElementDataFile = other.raw", "ElementDataFile"),
        ("HeaderSize = 100", "HeaderSize"),
        ("ElementToIntensityFunctionSlope = 0", "slope"),
    ] {
        assert_eq!(refusal(&meta_with(line), None), ("MetaImage", field.to_owned()), "{line}");
    }
}

/// Returns a NIfTI-1 file with some bytes replaced.
fn nifti_with(at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut file = made!("u1.nii").to_vec();
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

#[test]
fn invalid_nifti_fields_are_named() {
    let nan = f32::NAN.to_le_bytes();
    let big = [0xFF, 0x7F].repeat(3);
    for (at, bytes, field) in [
        (40, &[0, 0][..], "dim[0]"),
        (42, &[0, 0], "dim[1]"),
        (44, &[0xFF, 0xFF], "dim[2]"),
        (42, &big, "voxel data"),
        (70, &[0x20, 0], "datatype"),
        (108, &nan, "vox_offset"),
        (108, &1e30f32.to_le_bytes(), "vox_offset"),
        (108, &100f32.to_le_bytes(), "vox_offset"),
        (108, &400f32.to_le_bytes(), "voxel data"),
        (112, &f32::INFINITY.to_le_bytes(), "scl_slope"),
        (112, &[0, 0, 0x80, 0x3F, 0, 0, 0xC0, 0x7F], "scl_inter"),
        (280, &nan, "srow_x"),
        (312, &nan, "srow_z"),
        (280, &[0; 16], "affine"),
        (344, b"nope", "magic"),
        (344, b"\0\0\0\0", "magic"),
    ] {
        let (format, found) = refusal(&nifti_with(at, bytes), None);
        assert_eq!((format, found.as_str()), ("NIfTI", field), "bytes {bytes:?} at {at}");
    }
    let five = [&[5, 0, 5, 0, 4, 0, 3, 0, 1, 0, 2, 0][..]].concat();
    assert_eq!(refusal(&nifti_with(40, &five), None).1, "dim[5]");
    let qform = |at: usize, bytes: &[u8]| {
        let mut file = made!("qform.nii").to_vec();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        refusal(&file, None).1
    };
    assert_eq!(qform(256, &nan), "quatern_b, c, d");
    assert_eq!(qform(256, &5f32.to_le_bytes()), "quatern_b, c, d");
    assert_eq!(qform(268, &nan), "qoffset_x, y, z");
    assert_eq!(qform(80, &nan), "pixdim[1]");
    assert_eq!(qform(84, &[0; 4]), "pixdim[2]");
}

#[test]
fn sixty_four_bit_integers_that_f64_cannot_hold_are_refused() {
    let mut file = made!("i8.nii").to_vec();
    let end = file.len();
    file[end - 8..].copy_from_slice(&i64::MIN.to_le_bytes());
    assert_eq!(refusal(&file, None), ("NIfTI", "voxel data".to_owned()));
}

#[test]
fn a_volume_without_a_finite_voxel_is_refused() {
    let mut file = made!("f4.nii").to_vec();
    let voxels = file.len() - 240;
    for four in file[voxels..].chunks_exact_mut(4) {
        four.copy_from_slice(&f32::NAN.to_le_bytes());
    }
    assert_eq!(refusal(&file, None), ("NIfTI", "data".to_owned()));
}

#[test]
fn mismatched_header_and_payload_are_refused() {
    let raw = vec![0; 1000];
    assert_eq!(refusal(made!("detached.nhdr"), Some(&raw)).1, "voxel data");
    assert_eq!(refusal(made!("detached.mhd"), Some(&raw[..100])).1, "voxel data");
    assert_eq!(refusal(made!("pair.hdr"), Some(&raw)).1, "voxel data");
}

/// NRRD files of two frames of 5 x 2 x 3 voxels: frames interleaved by voxel, and by row with a time axis in the world.
const TIME_FIRST: &[u8] =
    b"NRRD0005\ntype: uint8\ndimension: 4\nsizes: 2 5 2 3\nencoding: raw\nkinds: list domain \
    domain domain\nspace: RAS\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\n\n\
    .,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;";
const TIME_BETWEEN: &[u8] = b"NRRD0005\ntype: uint8\ndimension: 4\nsizes: 5 2 2 3\nencoding: raw\nkinds: space time \
    space space\nspace: RAST\nspace directions: (2,0,0,0) (0,0,0,1) (0,3,0,0) (0,0,4,0)\nspace units: \"mm\" \"mm\" \
    \"mm\" \"ms\"\n\n.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;.,:;";

/// A file's name, its bytes, and its payload, if it is in a separate file.
type Sample = (&'static str, &'static [u8], Option<&'static [u8]>);

/// Returns all small files.
fn corpus() -> Vec<Sample> {
    vec![
        ("u1.nii", made!("u1.nii"), None),
        ("f8_big.nii", made!("f8_big.nii"), None),
        ("two_f4.nii.gz", made!("two_f4.nii.gz"), None),
        ("two_big_i2_4d.nii", made!("two_big_i2_4d.nii"), None),
        ("extension.nii.gz", made!("extension.nii.gz"), None),
        ("qform_mirrored_big.nii", made!("qform_mirrored_big.nii"), None),
        ("pair.hdr", made!("pair.hdr"), Some(made!("pair.img"))),
        ("i8_big.nrrd", made!("i8_big.nrrd"), None),
        ("gzip_las.nrrd", made!("gzip_las.nrrd"), None),
        ("frames.nrrd", made!("frames.nrrd"), None),
        ("time first", TIME_FIRST, None),
        ("time between", TIME_BETWEEN, None),
        ("detached.nhdr", made!("detached.nhdr"), Some(made!("detached.raw"))),
        ("u2.mha", made!("u2.mha"), None),
        ("compressed.mha", made!("compressed.mha"), None),
        ("frames.mha", made!("frames.mha"), None),
        ("compressed.mhd", made!("compressed.mhd"), Some(made!("compressed.zraw"))),
    ]
}

#[test]
fn every_truncation_is_refused() {
    for (name, bytes, detached) in corpus() {
        let length = if detached.is_some() { 0 } else { bytes.len() };
        for n in 0..length {
            assert!(parse_volume(&bytes[..n], None).is_err(), "{name} cut to {n} bytes was read");
        }
        if let Some(payload) = detached {
            for n in 0..payload.len() {
                assert!(
                    parse_volume(bytes, Some(&payload[..n])).is_err(),
                    "{name}, payload cut to {n} bytes, was read"
                );
            }
            for n in 0..bytes.len() {
                // A text header may lose its last fields; what is read must still be a whole volume.
                if let Ok(volume) = parse_volume(&bytes[..n], Some(payload)) {
                    assert_eq!(volume.dims(), [5, 4, 3], "{name} cut to {n} bytes");
                }
            }
        }
    }
    for bytes in [i2nii!("converted.nii.gz"), i2nii!("mha.mha")] {
        for n in (0..bytes.len()).step_by(9973) {
            assert!(parse_volume(&bytes[..n], None).is_err());
        }
    }
}

/// Asserts that reading gives an error or a volume of at most 16 times the bytes. Returns whether it gives a volume.
fn must_end_well(bytes: &[u8], detached: Option<&[u8]>) -> bool {
    let Ok(volume) = parse_volume(bytes, detached) else { return false };
    let voxels = volume.dims().iter().product::<usize>() * volume.frames();
    let given = bytes.len() + detached.map_or(0, <[u8]>::len);
    assert!(voxels <= 16 * given, "{voxels} voxels from {given} bytes");
    assert!(volume.range().iter().all(|v| v.is_finite()));
    assert!(volume.sample(DVec3::ZERO, 0).unwrap().is_finite());
    true
}

#[test]
fn thousands_of_damaged_files_give_a_volume_or_an_error() {
    let mut random = Random(20_250_101);
    for (name, bytes, detached) in corpus() {
        let mut counts = [0; 2];
        for _ in 0..1500 {
            let mut damaged = bytes.to_vec();
            for _ in 0..=random.below(6) {
                let at = random.below(damaged.len());
                damaged[at] = random.below(256) as u8;
            }
            counts[usize::from(must_end_well(&damaged, detached))] += 1;
            let payload = detached.unwrap_or(bytes);
            must_end_well(&damaged, Some(payload));
        }
        assert!(counts[0] > 200 && counts[1] > 0, "{name}: {counts:?} refused and read");
    }
}

#[test]
fn damaged_header_numbers_give_a_volume_or_an_error() {
    // Every field of 2, 4 and 8 bytes of both NIfTI headers is set to numbers that break careless arithmetic.
    let patterns: [&[u8]; 8] = [
        &[0xFF; 8],
        &[0x7F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF],
        &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F],
        &[0; 8],
        &[0, 0, 0x80, 0x7F, 0, 0, 0x80, 0x7F],
        &[0, 0, 0xC0, 0x7F, 0, 0, 0xF8, 0x7F],
        &[1, 0, 0, 0, 0, 0, 0, 0],
        &[0x7F, 0xF0, 0, 0, 0, 0, 0, 0],
    ];
    for file in [made!("f8_big.nii"), made!("u1.nii"), made!("two_big_i2_4d.nii"), made!("qform.nii")] {
        let mut counts = [0; 2];
        for at in (0..540.min(file.len() - 8)).step_by(2) {
            for (pattern, width) in patterns.iter().flat_map(|p| [(p, 2), (p, 4), (p, 8)]) {
                let mut damaged = file.to_vec();
                damaged[at..at + width].copy_from_slice(&pattern[..width]);
                counts[usize::from(must_end_well(&damaged, None))] += 1;
            }
        }
        assert!(counts.iter().all(|&count| count > 500), "{counts:?} refused and read");
    }
}

#[test]
fn writing_and_reading_again_keeps_voxels_and_world() {
    for name in ["u1.nii", "i2.nrrd", "f8.mha", "usec"] {
        let volume = match name {
            "u1.nii" => read(made!("u1.nii")),
            "i2.nrrd" => read(made!("i2_big.nrrd")),
            "f8.mha" => read(made!("f8.mha")),
            _ => read(made!("usec_4d.nii.gz")),
        };
        let again = read(&write_nifti(&volume).unwrap());
        assert_eq!(again.voxels(), volume.voxels(), "{name}");
        assert_eq!(again.unit(), volume.unit(), "{name}");
        assert!((again.frame_seconds() - volume.frame_seconds()).abs() < 1e-9, "{name}");
        assert_world(&again, MADE, name);
    }
    let scaled = read(made!("scaled.nii"));
    let again = read(&write_nifti(&scaled).unwrap());
    assert_eq!((again.slope(), again.intercept()), (0.5, -3.0));
}

#[test]
fn dimensions_beyond_nifti_1_are_written_as_nifti_2() {
    let long = Volume::new(VolumeInit {
        affine: DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.1),
            glam::DQuat::IDENTITY,
            DVec3::ONE,
        ),
        ..VolumeInit::new(Voxels::I8((0..40_000).map(|i| (i % 100) as i8).collect()), [40_000, 1, 1, 1])
    })
    .unwrap();
    let bytes = write_nifti(&long).unwrap();
    assert_eq!(bytes[..4], 540i32.to_le_bytes());
    let again = read(&bytes);
    assert_eq!((again.voxels(), again.affine()), (long.voxels(), long.affine()));
}

/// Larger files that are not part of the project, in the folder named by VESICLE_DATA.
#[cfg(not(target_arch = "wasm32"))]
mod elsewhere {
    use super::*;
    use std::path::PathBuf;

    fn folder() -> PathBuf {
        let folder = std::env::var_os("VESICLE_DATA").map(PathBuf::from).filter(|f| f.is_dir());
        folder.expect("VESICLE_DATA does not name a folder")
    }

    struct Expected {
        path: &'static str,
        dims: [usize; 4],
        range: [f64; 2],
        sum: f64,
        /// The voxel at half of every dimension.
        middle: f64,
        /// Rows of the affine in RAS.
        rows: [[f64; 4]; 3],
    }

    /// Values as read by nibabel 5.4.2.
    const NIFTI: [Expected; 5] = [
        Expected {
            path: "volumes/formats/avg152T1_RL_nifti.nii.gz",
            dims: [91, 109, 91, 1],
            range: [0.0, 255.0],
            sum: 74_825_382.0,
            middle: 121.0,
            rows: [[2.0, 0.0, 0.0, -90.0], [0.0, 2.0, 0.0, -126.0], [0.0, 0.0, 2.0, -72.0]],
        },
        Expected {
            path: "volumes/formats/example4d.nii.gz",
            dims: [128, 96, 24, 2],
            range: [0.0, 1162.0],
            sum: 101_985_356.0,
            middle: 266.0,
            rows: [
                [-2.0, 0.0, 0.0, 117.8551025390625],
                [0.0, 1.9737114906311035, -0.35552823543548584, -35.72294235229492],
                [0.0, 0.3232076168060303, 2.171081781387329, -7.248798370361328],
            ],
        },
        Expected {
            path: "volumes/formats/example_nifti2.nii.gz",
            dims: [32, 20, 12, 2],
            range: [46.0, 757.0],
            sum: 6_926_802.0,
            middle: 266.0,
            rows: [
                [-2.0, 0.0, 0.0, 117.8551025390625],
                [0.0, 1.9737114906311035, -0.35552823543548584, -35.72294235229492],
                [0.0, 0.3232076168060303, 2.171081781387329, -7.248798370361328],
            ],
        },
        Expected {
            path: "volumes/ct_skull_phantom/CT_pitch.nii.gz",
            dims: [175, 248, 58, 1],
            range: [0.0, 255.0],
            sum: 95_678_796.0,
            middle: 156.0,
            rows: [
                [0.8125, 0.0, 0.0, -69.02075958251953],
                [0.0, 0.779041051864624, 0.6807987689971924, -134.38560485839844],
                [0.0, -0.23076248168945312, 2.2983384132385254, -13.56882095336914],
            ],
        },
        Expected {
            path: "volumes/mr_stroke/T2.nii.gz",
            dims: [124, 160, 140, 1],
            range: [0.0, 503.96865725517273],
            sum: 161_054_719.48539615,
            middle: 202.79216885566711,
            rows: [
                [0.9935920238494873, 0.01600503921508789, 0.11188727617263794, -64.89823913574219],
                [-0.049704909324645996, 0.9509366750717163, 0.3053668737411499, -110.43114471435547],
                [-0.10151028633117676, -0.3089714050292969, 0.9456385970115662, -27.925539016723633],
            ],
        },
    ];

    fn check(volume: &Volume, expected: &Expected) {
        let path = expected.path;
        let [nx, ny, nz] = volume.dims();
        let dims = [nx, ny, nz, volume.frames()];
        assert_eq!(dims, expected.dims, "{path}");
        for (found, wanted) in volume.range().iter().zip(expected.range) {
            assert!((found - wanted).abs() < 1e-6, "{path}: {found}, not {wanted}");
        }
        let sum: f64 = (0..dims[3])
            .map(|t| volume.intensities(t).unwrap().iter().map(|&v| f64::from(v)).sum::<f64>())
            .sum();
        assert!((sum / expected.sum - 1.0).abs() < 1e-7, "{path}: sum {sum}");
        let half = dims.map(|n| n / 2);
        let middle = volume.intensities(half[3]).unwrap()[half[0] + nx * (half[1] + ny * half[2])];
        assert!((f64::from(middle) - expected.middle).abs() < 1e-4, "{path}: {middle}");
        assert_world(volume, expected.rows, path);
    }

    #[test]
    #[ignore = "reads files from the folder VESICLE_DATA"]
    fn nifti_files_as_nibabel_reads_them() {
        let folder = folder();
        for expected in NIFTI {
            let bytes = std::fs::read(folder.join(expected.path)).unwrap();
            check(&read(&bytes), &expected);
        }
        let bytes = std::fs::read(folder.join("volumes/formats/rgb24_derived.nii.gz")).unwrap();
        let colours = read(&bytes);
        assert_eq!(colours.warnings().len(), 1);
    }

    #[test]
    #[ignore = "reads files from the folder VESICLE_DATA"]
    fn a_header_over_a_numbered_series_and_its_conversion_agree() {
        let folder = folder();
        let folder = folder.join("volumes/ct_headsq");
        let slices: Vec<Vec<u8>> =
            (1..=93).map(|k| std::fs::read(folder.join(format!("quarter.{k}"))).unwrap()).collect();
        let header = std::fs::read(folder.join("quarter.nhdr")).unwrap();
        let series = read_pair(&header, &slices.concat());
        let converted = read(&std::fs::read(folder.join("headsq_converted.nrrd")).unwrap());
        assert_eq!((series.dims(), series.spacing()), ([64, 64, 93], [3.2, 3.2, 1.5]));
        assert_eq!(series.voxels(), converted.voxels());
        assert_eq!(converted.range(), [0.0, 3926.0]);
    }

    #[test]
    #[ignore = "reads files from the folder VESICLE_DATA"]
    fn detached_files_as_pynrrd_and_itk_read_them() {
        let folder = folder();
        let read_from = |path: &str| std::fs::read(folder.join("volumes").join(path)).unwrap();
        let tooth = read_pair(&read_from("ct_tooth/tooth.nhdr"), &read_from("ct_tooth/tooth.raw"));
        assert_eq!((tooth.dims(), tooth.range()), ([103, 94, 161], [0.0, 1300.0]));
        let sum: f64 = tooth.intensities(0).unwrap().iter().map(|&v| f64::from(v)).sum();
        assert_eq!(sum, 821_287_590.0);
        let head = read_pair(&read_from("formats/HeadMRVolume.mhd"), &read_from("formats/HeadMRVolume.raw"));
        assert_eq!((head.dims(), head.spacing(), head.space()), ([48, 62, 42], [4.0; 3], Space::Lps));
        let values = head.intensities(0).unwrap();
        assert_eq!((values[24 + 48 * (31 + 62 * 21)], head.range()), (79.0, [0.0, 255.0]));
        let ovule = read(&read_from("micro_ovule/ovule_label.nrrd"));
        assert_eq!(
            (ovule.dims(), ovule.range(), ovule.unit()),
            ([128, 128, 32], [0.0, 918.0], LengthUnit::Micrometre)
        );
    }

    /// Returns every file below a folder, sorted by name.
    fn files_below(folder: &std::path::Path) -> Vec<PathBuf> {
        let mut paths: Vec<PathBuf> =
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        paths
            .into_iter()
            .flat_map(|path| if path.is_dir() { files_below(&path) } else { vec![path] })
            .collect()
    }

    /// Returns broken variants of a file: truncated, with changed sizes and numbers, empty, and replaced by text.
    fn broken(bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut variants: Vec<Vec<u8>> = (0..40).map(|k| bytes[..bytes.len() * k / 40].to_vec()).collect();
        variants.push(bytes[..bytes.len() - 1].to_vec());
        variants.push(b"once upon a time there was a volume".to_vec());
        for at in (0..400).step_by(4).filter(|at| at + 4 <= bytes.len()) {
            for pattern in [[0xFF; 4], [0xFF, 0xFF, 0xFF, 0x7F], f32::NAN.to_le_bytes(), [b'9'; 4], [0; 4]] {
                let mut damaged = bytes.to_vec();
                damaged[at..at + 4].copy_from_slice(&pattern);
                variants.push(damaged);
            }
        }
        variants
    }

    /// Returns whether an error reads `format: field: problem`, with a format that this crate supports.
    fn names_format_and_field(message: &str) -> bool {
        const FORMATS: [&str; 4] = ["NIfTI", "NRRD", "MetaImage", "volume file"];
        let parts: Vec<&str> = message.splitn(3, ": ").collect();
        parts.len() == 3 && FORMATS.iter().any(|f| parts[0].starts_with(f)) && !parts[1].is_empty()
    }

    #[test]
    #[ignore = "reads files from the folder VESICLE_DATA"]
    fn every_file_and_every_broken_variant_gives_a_volume_or_names_format_and_field() {
        let folder = folder();
        let (mut volumes, mut errors) = (0, 0);
        for path in files_below(&folder.join("volumes/formats")) {
            let bytes = std::fs::read(&path).unwrap();
            for variant in std::iter::once(bytes.clone()).chain(broken(&bytes)) {
                match parse_volume(&variant, None) {
                    Ok(volume) => {
                        volumes += 1;
                        assert!(volume.range().iter().all(|v| v.is_finite()), "{path:?}");
                    }
                    Err(error) => {
                        errors += 1;
                        assert!(names_format_and_field(&error.to_string()), "{path:?}: {error}");
                    }
                }
            }
        }
        eprintln!("{volumes} volumes, {errors} errors");
        assert!(volumes > 100 && errors > 1000);
    }
}
