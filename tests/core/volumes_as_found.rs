//! Volume files as people have them: headers that contradict themselves or leave something out, voxels in several files,
//! colours. Each is read right, with a warning if something had to be assumed, or refused with the reason. Expected
//! values are those of nibabel and of ITK.

use super::common::Random;
use vesicle::io::{
    Compression, FormatError, VolumeFormat, VolumeOptions, parse_volume, parse_volume_with, write_volume,
};
use vesicle::math::DVec3;
use vesicle::volume::{LengthUnit, Space, Volume, VolumeInit, Voxels};
use vesicle::warning::WarningCode;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

type Rows = [[f64; 4]; 3];

fn assert_rows(volume: &Volume, expected: Rows) {
    let affine = volume.affine_in(Space::Ras);
    for index in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z] {
        let wanted = DVec3::from(expected.map(|r| r[0] * index.x + r[1] * index.y + r[2] * index.z + r[3]));
        let found = affine.transform_point3(index);
        assert!(found.distance(wanted) < 1e-5, "voxel {index} at {found}, not {wanted}");
    }
}

fn values(volume: &Volume) -> Vec<f32> {
    volume.intensities(0).unwrap()
}

/// Returns the texts of the warnings, all of which are of the reader.
fn warnings(volume: &Volume) -> Vec<&str> {
    assert!(volume.warnings().iter().all(|warning| warning.code == WarningCode::Reader));
    volume.warnings().iter().map(|warning| warning.text.as_str()).collect()
}

fn assert_warned(volume: &Volume, word: &str) {
    let found = warnings(volume);
    assert!(found.len() == 1 && found[0].contains(word), "'{word}' in {found:?}");
}

fn whole(bytes: &[u8]) -> Volume {
    parse_volume(bytes, None).unwrap_or_else(|error| panic!("{error}"))
}

fn silent(bytes: &[u8]) -> Volume {
    let volume = whole(bytes);
    assert_eq!(warnings(&volume), [""; 0]);
    volume
}

fn refusal(bytes: &[u8]) -> String {
    parse_volume(bytes, None).expect_err("must be refused").to_string()
}

type File<'a> = (&'a str, &'a [u8]);

fn beside(header: &[u8], files: &[File<'_>]) -> Result<Volume, FormatError> {
    let files = files.to_vec();
    parse_volume_with(header, &VolumeOptions { files: Some(&files), ..VolumeOptions::default() })
}

fn in_space(bytes: &[u8], space: Space) -> Volume {
    let options = VolumeOptions { space: Some(space), ..VolumeOptions::default() };
    let volume = parse_volume_with(bytes, &options).unwrap();
    assert_eq!(warnings(&volume), [""; 0]);
    volume
}

/// A NIfTI-1 or Analyze header in the making, of 4 × 3 × 2 numbers of 16 bits: 7 i − 30.
struct Header(Vec<u8>);

impl Header {
    fn new() -> Self {
        let mut header = Self(vec![0; 352]);
        header.0[..4].copy_from_slice(&348i32.to_le_bytes());
        header.0[344..348].copy_from_slice(b"n+1\0");
        header
            .ints(40, &[3, 4, 3, 2, 1, 1, 1, 1])
            .ints(70, &[4, 16])
            .floats(76, &[1.0, 1.0, 2.0, 3.0])
            .floats(108, &[352.0])
    }

    /// Returns the header with a quaternion, by which y and z are turned round, and an origin.
    fn with_qform(self) -> Self {
        self.ints(252, &[1]).floats(256, &[1.0, 0.0, 0.0, 10.0, 20.0, 30.0])
    }

    fn ints(mut self, at: usize, values: &[i16]) -> Self {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.0[at..at + bytes.len()].copy_from_slice(&bytes);
        self
    }

    fn floats(mut self, at: usize, values: &[f32]) -> Self {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.0[at..at + bytes.len()].copy_from_slice(&bytes);
        self
    }

    fn bytes(mut self, at: usize, values: &[u8]) -> Self {
        self.0[at..at + values.len()].copy_from_slice(values);
        self
    }

    fn file(self) -> Vec<u8> {
        self.with(&numbers())
    }

    fn with(self, data: &[u8]) -> Vec<u8> {
        [&self.0[..], data].concat()
    }
}

fn numbers() -> Vec<u8> {
    (0..24i16).flat_map(|i| (7 * i - 30).to_le_bytes()).collect()
}

fn expected_numbers() -> Vec<f32> {
    (0..24).map(|i| (7 * i - 30) as f32).collect()
}

/// World of [`Header::with_qform`].
const TURNED: Rows = [[1.0, 0.0, 0.0, 10.0], [0.0, -2.0, 0.0, 20.0], [0.0, 0.0, -3.0, 30.0]];

#[test]
fn a_nifti_matrix_without_inverse_gives_way_to_the_quaternion() {
    let singular = [1.0, 0.0, 0.0, 5.0, 1.0, 0.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0];
    for matrix in [[0.0; 12], singular, [f32::NAN; 12]] {
        let header = || Header::new().ints(254, &[1]).floats(280, &matrix);
        let volume = whole(&header().with_qform().file());
        assert_rows(&volume, TURNED);
        assert_eq!(values(&volume), expected_numbers());
        assert_warned(&volume, "sform");
        // Without a quaternion, and with one that cannot be used, the file has no position.
        assert!(parse_volume(&header().file(), None).is_err());
        assert!(parse_volume(&header().with_qform().floats(256, &[f32::NAN]).file(), None).is_err());
    }
    let good = [1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0];
    let volume = silent(&Header::new().ints(254, &[1]).floats(280, &good).with_qform().file());
    assert_rows(&volume, [[1.0, 0.0, 0.0, 5.0], [0.0, 1.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0]]);
}

#[test]
fn the_datatype_of_a_nifti_file_tells_the_size_of_voxels() {
    assert_eq!(values(&silent(&Header::new().ints(72, &[0]).file())), expected_numbers());
    for bits in [8, 32, -1] {
        let volume = whole(&Header::new().ints(72, &[bits]).file());
        assert_eq!(values(&volume), expected_numbers());
        assert_warned(&volume, "bitpix");
    }
}

#[test]
fn a_single_slice_without_thickness_is_of_thickness_one() {
    for size in [0.0, f32::NAN] {
        let flat = || Header::new().ints(46, &[1]).floats(88, &[size]);
        for header in [flat(), flat().ints(252, &[1])] {
            let volume = whole(&header.with(&numbers()[..24]));
            assert_eq!(volume.spacing(), [1.0, 2.0, 1.0]);
            assert_warned(&volume, "along z");
        }
        let missing = refusal(&Header::new().floats(88, &[size]).file());
        assert!(missing.contains("pixdim[3]"), "{missing}");
    }
    // Other axes, and files that do not have the axis.
    let row = whole(&Header::new().ints(40, &[3, 4, 1, 2]).floats(84, &[0.0]).with(&numbers()[..16]));
    assert_eq!(row.spacing(), [1.0, 1.0, 3.0]);
    silent(&Header::new().ints(40, &[2, 4, 3, 7]).floats(88, &[0.0]).with(&numbers()[..24]));
}

#[test]
fn a_single_slice_without_thickness_in_other_formats() {
    let nrrd = |sizes: &str, lines: &str| {
        let header =
            format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\nencoding: raw\n{lines}\n\n");
        [header.as_bytes(), &[0, 1, 2, 3]].concat()
    };
    let space = "space: RAS\nspace origin: (5,6,7)\nspace directions:";
    for (file, columns) in [
        (nrrd("2 2 1", "spacings: 2 3 0"), [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]]),
        (
            nrrd("2 2 1", &format!("{space} (0,2,0) (0,0,3) (0,0,0)")),
            [[0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [1.0, 0.0, 0.0]],
        ),
        (
            nrrd("2 1 2", &format!("{space} (2,0,0) (0,0,0) (0,0,3)")),
            [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]],
        ),
        (
            nrrd("1 2 2", &format!("{space} (0,0,0) (0,2,0) (0,0,3)")),
            [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]],
        ),
    ] {
        let volume = whole(&file);
        assert_warned(&volume, "no thickness of the single slice");
        let found = volume.affine().matrix3;
        assert_eq!([found.x_axis, found.y_axis, found.z_axis].map(|column| column.to_array()), columns);
    }
    let meta = "NDims = 3\nDimSize = 2 2 1\nElementSpacing = 2 3 0\nTransformMatrix = 0 1 0 1 0 0 0 0 -1\n\
                ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcd";
    let volume = whole(meta.as_bytes());
    assert_warned(&volume, "along z");
    assert_rows(&volume, [[0.0, -3.0, 0.0, 0.0], [-2.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]]);
    assert!(refusal(&nrrd("2 1 2", "spacings: 2 3 0")).contains("spacings: "));
    assert!(refusal(meta.replace("2 2 1", "2 1 2").as_bytes()).contains("affine"));
}

#[test]
fn a_nifti_file_without_a_transform_is_in_the_space_that_is_chosen() {
    let file = Header::new().file();
    let sizes = |x: f64, y: f64| [[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, 3.0, 0.0]];
    assert_rows(&silent(&file), sizes(1.0, 2.0));
    assert_rows(&in_space(&file, Space::Lps), sizes(-1.0, -2.0));
    assert_rows(&in_space(&Header::new().with_qform().file(), Space::Lps), TURNED);
}

#[test]
fn axes_of_one_entry_count_for_nothing() {
    for sizes in [[4, 4, 3, 2, 0, 9, 9, 9], [5, 4, 3, 2, 1, 1, 9, 9], [7, 4, 3, 2, 1, 0, 1, 1]] {
        let volume = silent(&Header::new().ints(40, &sizes).file());
        assert_eq!((volume.dims(), volume.frames()), ([4, 3, 2], 1));
    }
    for (sizes, axis) in
        [([5, 4, 3, 1, 1, 2, 1, 1], 5), ([3, 4, 0, 2, 1, 1, 1, 1], 2), ([4, 4, 3, 2, -1, 1, 1, 1], 4)]
    {
        let message = refusal(&Header::new().ints(40, &sizes).file());
        assert!(message.contains(&format!("dim[{axis}]")), "{message}");
    }
}

/// Red, green, blue, white, of which the luminance is 54, 182, 18, 255.
const RGB: [u8; 12] = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
const RGBA: [u8; 16] = [255, 0, 0, 9, 0, 255, 0, 0, 0, 0, 255, 255, 255, 255, 255, 77];
const LUMINANCE: [u8; 4] = [54, 182, 18, 255];

fn assert_luminance(bytes: &[u8], channels: usize) {
    let volume = whole(bytes);
    assert_eq!((volume.dims(), volume.voxels()), ([2, 2, 1], &Voxels::U8(LUMINANCE.to_vec())));
    assert_eq!((volume.slope(), volume.intercept()), (1.0, 0.0));
    assert_warned(&volume, "luminance");
    assert_eq!(warnings(&volume)[0].contains("opacity"), channels == 4);
}

#[test]
fn colours_are_read_as_luminance() {
    let nifti = |datatype, bits| {
        Header::new().ints(40, &[3, 2, 2, 1]).ints(70, &[datatype, bits]).floats(112, &[2.0, 5.0])
    };
    assert_luminance(&nifti(128, 24).with(&RGB), 3);
    assert_luminance(&nifti(2304, 32).with(&RGBA), 4);
    let meta = |channels| {
        format!(
            "ObjectType = Image\nNDims = 3\nDimSize = 2 2 1\nElementNumberOfChannels = {channels}\nElementType = MET_UCHAR\n\
             ElementDataFile = LOCAL\n"
        )
    };
    assert_luminance(&[meta(3).as_bytes(), &RGB].concat(), 3);
    assert_luminance(&[meta(4).as_bytes(), &RGBA].concat(), 4);
    let nrrd = |sizes: &str, kinds: &str, directions: &str| {
        format!(
            "NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\nkinds: {kinds}\nencoding: raw\nspace: LPS\n\
             space directions: {directions}\n\n"
        )
    };
    let first = "none (1,0,0) (0,2,0) (0,0,3)";
    for kind in ["RGB-color", "3-color"] {
        let kinds = format!("{kind} domain domain domain");
        assert_luminance(&[nrrd("3 2 2 1", &kinds, first).as_bytes(), &RGB].concat(), 3);
    }
    let kinds = "RGBA-color domain domain domain";
    assert_luminance(&[nrrd("4 2 2 1", kinds, first).as_bytes(), &RGBA].concat(), 4);
    // Planes of red, green and blue, one after the other.
    let planes: Vec<u8> = (0..12).map(|i| RGB[i % 4 * 3 + i / 4]).collect();
    let last = nrrd("2 2 1 3", "domain domain domain RGB-color", "(1,0,0) (0,2,0) (0,0,3) none");
    assert_luminance(&[last.as_bytes(), &planes].concat(), 3);
}

#[test]
fn vectors_that_are_no_colours_stay_refused() {
    let meta = |kind: &str, channels: usize| {
        format!(
            "NDims = 3\nDimSize = 2 2 1\nElementNumberOfChannels = {channels}\nElementType = {kind}\nElementDataFile = LOCAL\n"
        )
    };
    for header in [meta("MET_FLOAT", 3), meta("MET_SHORT", 4), meta("MET_UCHAR", 2)] {
        let message = refusal(&[header.as_bytes(), &[0; 64]].concat());
        assert!(message.contains("ElementNumberOfChannels"), "{message}");
    }
    for (sizes, kinds) in [
        ("3 2 2 1", "vector domain domain domain"),
        ("4 2 2 1", "RGB-color domain domain domain"),
        ("3 2 2 1", "HSV-color domain domain domain"),
        ("3 3 2 1", "RGB-color RGB-color domain domain"),
    ] {
        let header =
            format!("NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\nkinds: {kinds}\nencoding: raw\n\n");
        let message = refusal(&[header.as_bytes(), &[0; 64]].concat());
        assert!(message.contains("kinds"), "{message}");
    }
}

fn analyze() -> Header {
    Header::new().bytes(344, &[0; 4]).floats(76, &[0.0, 1.0, 2.0, 3.0]).floats(108, &[0.0])
}

#[test]
fn analyze_files_are_read_with_the_common_orientation() {
    let middle: Rows = [[-1.0, 0.0, 0.0, 1.5], [0.0, 2.0, 0.0, -2.0], [0.0, 0.0, 3.0, -1.5]];
    let image = numbers();
    let read = |header: Header| beside(&header.0[..348], &[("a.IMG", &image), ("a.hdr", &[])]).unwrap();
    // Where NIfTI has magic letters, this format has a number.
    for smallest in [[0; 4], [7, 0, 0, 0], [0, 0xFF, 0xFF, 0xFF]] {
        let volume = read(analyze().bytes(344, &smallest));
        assert_eq!((values(&volume), volume.unit()), (expected_numbers(), LengthUnit::Unknown));
        assert_rows(&volume, middle);
        assert_warned(&volume, "Analyze 7.5, which states no orientation");
    }
    // Bytes that are codes and quaternions in NIfTI are others here.
    let volume = read(analyze().bytes(56, b"mm\0\0").bytes(252, &[3]).floats(256, &[0.0; 6]));
    assert_eq!(volume.unit(), LengthUnit::Millimetre);
    let of_spm = read(analyze().bytes(253, &[2, 0, 2, 0, 1, 0]).floats(112, &[2.0, f32::NAN]));
    assert_rows(&of_spm, [[-1.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, -2.0], [0.0, 0.0, 3.0, 0.0]]);
    assert_eq!(values(&of_spm)[0], -60.0);
    assert_warned(&of_spm, "Slope (2)");
    let frames = read(analyze().ints(40, &[4, 4, 3, 1, 2]).floats(88, &[3.0, 2.5]));
    assert_eq!((frames.frames(), frames.frame_seconds()), (2, 0.0));
    let chosen =
        VolumeOptions { detached: Some(&image), space: Some(Space::Lps), ..VolumeOptions::default() };
    let chosen = parse_volume_with(&analyze().0, &chosen).unwrap();
    assert_rows(&chosen, [[-1.0, 0.0, 0.0, 1.5], [0.0, -2.0, 0.0, 2.0], [0.0, 0.0, 3.0, -1.5]]);
    assert_eq!((chosen.space(), warnings(&chosen).len()), (Space::Lps, 0));
}

#[test]
fn the_image_of_a_pair_is_found_by_its_ending() {
    let header = analyze().0;
    let image = numbers();
    assert!(beside(&header, &[("x/a.img", &image), ("notes.txt", b"")]).is_ok());
    for (files, problem) in [
        (&[("a.raw", &image[..])][..], "files: the file .img or .img.gz of this header is missing"),
        (&[("a.img", &image), ("b.img", &image)], "several"),
        (&[("a.img", &image[..40])], "file 'a.img': needs 48 bytes, the file has 40"),
    ] {
        let message = beside(&header, files).expect_err(problem).to_string();
        assert!(message.contains(problem), "{message}");
    }
    assert!(refusal(&header).contains("pass its .img in `files`"));
}

/// Returns an NRRD of 4 × 3 × 2 bytes, 0 to 23, with some lines.
fn nrrd(lines: &[&str]) -> Vec<u8> {
    let start = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n";
    [format!("{start}{}\n\n", lines.join("\n")).into_bytes(), (0..24).collect()].concat()
}

#[test]
fn the_mins_of_nrrd_axes_are_the_ends_of_cells_or_the_first_samples() {
    let at = |[dx, dy, dz]: [f64; 3], [x, y, z]: [f64; 3]| {
        [[dx, 0.0, 0.0, x], [0.0, dy, 0.0, y], [0.0, 0.0, dz, z]]
    };
    let (spacings, mins) = ("spacings: 1 2 3", "axis mins: -10 -20 -30");
    let nodes = "centers: node node node";
    assert_rows(&silent(&nrrd(&[spacings, mins, nodes])), at([1.0, 2.0, 3.0], [-10.0, -20.0, -30.0]));
    for cells in ["centers: cell cell cell", "centerings: cell ??? none", "content: x"] {
        assert_rows(&silent(&nrrd(&[spacings, mins, cells])), at([1.0, 2.0, 3.0], [-9.5, -19.0, -28.5]));
    }
    let partly = nrrd(&[spacings, "axis mins: NaN -20 nan", nodes]);
    assert_rows(&silent(&partly), at([1.0, 2.0, 3.0], [0.0, -20.0, 0.0]));
    let maxs = "axis maxs: -7 -16 -27";
    assert_rows(&silent(&nrrd(&[mins, maxs, nodes])), at([1.0, 2.0, 3.0], [-10.0, -20.0, -30.0]));
    let maxs = "axis maxs: -6 -14 -24";
    assert_rows(
        &silent(&nrrd(&[mins, maxs, "centers: cell cell cell"])),
        at([1.0, 2.0, 3.0], [-9.5, -19.0, -28.5]),
    );
    assert_rows(&silent(&nrrd(&[mins, maxs, spacings, nodes])), at([1.0, 2.0, 3.0], [-10.0, -20.0, -30.0]));
    for (lines, field) in [
        (&[mins, maxs][..], "axismaxs"),
        (&[maxs, nodes], "axismaxs"),
        (&[spacings, "axis mins: 1 2"], "axismins"),
        (&[spacings, "axis mins: inf 2 3"], "spacings"),
    ] {
        assert!(refusal(&nrrd(lines)).starts_with(&format!("NRRD: {field}")), "{lines:?}");
    }
}

#[test]
fn units_of_nrrd_axes_in_words_and_of_several_kinds() {
    let unit = |units: &str| silent(&nrrd(&["spacings: 1 2 3", &format!("units: {units}")])).unit();
    assert_eq!(unit(r#""microns" "micron" "Micrometers""#), LengthUnit::Micrometre);
    assert_eq!(unit(r#""millimeters" "mm" "mm""#), LengthUnit::Millimetre);
    assert_eq!(unit(r#""mm" "mm" """#), LengthUnit::Unknown);
    assert_eq!(unit(r#""pixel" "pixel" "pixel""#), LengthUnit::Unknown);
    let mixed = silent(&nrrd(&[
        "spacings: 100 200 3",
        "axis mins: 100 0 1",
        r#"units: "um" "microns" "mm""#,
        "centers: node node node",
    ]));
    assert_eq!(mixed.unit(), LengthUnit::Millimetre);
    assert_rows(&mixed, [[0.1, 0.0, 0.0, 0.1], [0.0, 0.2, 0.0, 0.0], [0.0, 0.0, 3.0, 1.0]]);
    let world = silent(&nrrd(&[
        "space: RAS",
        "space directions: (0,0,2) (0,3,0) (4,0,0)",
        "space origin: (100,200,3)",
        r#"space units: "um" "um" "mm""#,
    ]));
    assert_eq!(world.unit(), LengthUnit::Millimetre);
    assert_rows(&world, [[0.0, 0.0, 0.004, 0.1], [0.0, 0.003, 0.0, 0.2], [2.0, 0.0, 0.0, 3.0]]);
}

const PLACED: &str = "space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (10,20,30)";

#[test]
fn an_nrrd_that_does_not_tell_its_space_is_in_that_of_itk_with_a_warning() {
    let lps = [[-1.0, 0.0, 0.0, -10.0], [0.0, -2.0, 0.0, -20.0], [0.0, 0.0, 3.0, 30.0]];
    let ras = [[1.0, 0.0, 0.0, 10.0], [0.0, 2.0, 0.0, 20.0], [0.0, 0.0, 3.0, 30.0]];
    for (line, word) in [
        ("space dimension: 3", "does not name"),
        ("space: scanner-xyz", "'scanner-xyz' does not tell"),
        ("space: 3D-left-handed", "'3D-left-handed' does not tell"),
    ] {
        let file = nrrd(&[line, PLACED]);
        let volume = whole(&file);
        assert_rows(&volume, lps);
        assert_warned(&volume, word);
        assert_rows(&in_space(&file, Space::Ras), ras);
        assert_rows(&in_space(&file, Space::Lps), lps);
    }
    // A space that the file names, and one that nothing depends on.
    assert_rows(&in_space(&nrrd(&["space: RAS", PLACED]), Space::Lps), ras);
    assert_rows(&silent(&nrrd(&["space: LPS", PLACED])), lps);
    assert_eq!(silent(&nrrd(&["spacings: 1 2 3"])).space(), Space::Ras);
    assert_eq!(in_space(&nrrd(&["spacings: 1 2 3"]), Space::Lps).space(), Space::Lps);
}

#[test]
fn an_nrrd_of_itk_is_in_its_space_without_a_warning() {
    let comments =
        "# Complete NRRD file format specification at:\n# http://teem.sourceforge.net/nrrd/format.html";
    let file = |comments: &str, kinds: &str| {
        let header = format!(
            "NRRD0004\n{comments}\ntype: uchar\ndimension: 4\nspace dimension: 4\nsizes: 2 2 2 3\n\
             space directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,0.5)\nkinds: {kinds}\nencoding: raw\n\
             space origin: (10,20,30,0)\n\n"
        );
        [header.into_bytes(), (0..24).collect()].concat()
    };
    let domains = "domain domain domain domain";
    let volume = silent(&file(comments, domains));
    assert_eq!((volume.frames(), volume.space()), (3, Space::Lps));
    assert_rows(&volume, [[-1.0, 0.0, 0.0, -10.0], [0.0, -2.0, 0.0, -20.0], [0.0, 0.0, 3.0, 30.0]]);
    assert_eq!(in_space(&file(comments, domains), Space::Ras).space(), Space::Ras);
    let by_pynrrd = format!("# This NRRD file was generated by pynrrd\n{comments}");
    assert_warned(&whole(&file(&by_pynrrd, domains)), "does not name");
    assert_warned(&whole(&file(comments, "space space space time")), "does not name");
    silent(&nrrd(&["space dimension: 3", PLACED, "ITK_original_direction:=1"]));
    let flat = format!(
        "NRRD0004\n{comments}\ntype: uchar\ndimension: 2\nspace dimension: 2\nsizes: 4 6\nspace directions: (1,0) (0,2)\n\
         kinds: domain domain\nencoding: raw\nspace origin: (10,20)\n\n"
    );
    assert_eq!(silent(&[flat.into_bytes(), (0..24).collect()].concat()).space(), Space::Lps);
}

/// Returns the header of an NRRD of 3 × 2 × 4 numbers of 16 bits in other files, of which slice k has the numbers from
/// 10 k on.
fn detached_nrrd(data_file: &str, more: &str) -> Vec<u8> {
    format!(
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 4\nspacings: 1 1 1\nendian: little\nencoding: raw\n{more}\
         data file: {data_file}\n"
    )
    .into_bytes()
}

fn detached_meta(data_file: &str, more: &str) -> Vec<u8> {
    format!("ObjectType = Image\nNDims = 3\nDimSize = 3 2 4\nElementType = MET_SHORT\n{more}ElementDataFile = {data_file}\n")
        .into_bytes()
}

/// Returns slice k, with a number of bytes before its voxels.
fn slice(k: i16, before: usize) -> Vec<u8> {
    [vec![99; before], (0..6).flat_map(|i| (10 * k + i).to_le_bytes()).collect()].concat()
}

/// Returns names and contents of the files of the slices 0 to 3, with names by their numbers.
fn slices(name: impl Fn(i16) -> String, before: usize) -> Vec<(String, Vec<u8>)> {
    (0..4).rev().map(|k| (name(k), slice(k, before))).collect()
}

fn read_slices(header: &[u8], files: &[(String, Vec<u8>)]) -> Vec<f32> {
    let files: Vec<File<'_>> = files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    let volume = beside(header, &files).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((volume.dims(), warnings(&volume).len()), ([3, 2, 4], 0));
    values(&volume)
}

fn in_order(order: [i16; 4]) -> Vec<f32> {
    order.into_iter().flat_map(|k| (0..6).map(move |i| f32::from(10 * k + i))).collect()
}

#[test]
fn voxels_in_a_list_of_files() {
    let files = slices(|k| format!("folder/S{k}.raw"), 0);
    let list = "s2.raw\nS0.raw\n\n./S3.raw\r\nS1.raw";
    for header in [
        detached_nrrd(&format!("LIST\n{list}"), ""),
        detached_nrrd(&format!("LIST 2\n{list}"), ""),
        detached_meta(&format!("LIST\n{list}"), ""),
        detached_meta(&format!("LIST 2D\n{list}"), "ElementSpacing = 1 1 1\n"),
    ] {
        assert_eq!(read_slices(&header, &files), in_order([2, 0, 3, 1]));
    }
    // A name that begins like a list.
    let header = detached_nrrd("LISTED.raw\nspace units: \"mm\" \"mm\" \"mm\"", "");
    let whole: Vec<u8> = (0..4).flat_map(|k| slice(k, 0)).collect();
    assert_eq!(beside(&header, &[("LISTED.raw", &whole)]).unwrap().unit(), LengthUnit::Millimetre);
    // Slabs of two slices.
    let slabs = [
        ("a".to_owned(), [slice(0, 0), slice(1, 0)].concat()),
        ("b".to_owned(), [slice(2, 0), slice(3, 0)].concat()),
    ];
    for header in [detached_nrrd("LIST 3\na\nb", ""), detached_meta("LIST\na\nb", "")] {
        assert_eq!(read_slices(&header, &slabs), in_order([0, 1, 2, 3]));
    }
}

#[test]
fn voxels_in_a_numbered_series_of_files() {
    let plain = slices(|k| format!("my slice{}.raw", 2 * k + 5), 0);
    let padded = slices(|k| format!("s{:03}.raw", k + 1), 0);
    for (header, files, order) in [
        (detached_nrrd("my slice%d.raw 5 11 2", ""), &plain, [0, 1, 2, 3]),
        (detached_nrrd("my slice%d.raw 11 5 -2 2", ""), &plain, [3, 2, 1, 0]),
        (detached_nrrd("s%03d.raw 1 4 1 2", ""), &padded, [0, 1, 2, 3]),
        (detached_meta("my slice%d.raw 5 11 2", ""), &plain, [0, 1, 2, 3]),
        (detached_meta("s%03d.raw 1 4 1", ""), &padded, [0, 1, 2, 3]),
        (detached_meta("s%03d.raw", ""), &padded, [0, 1, 2, 3]),
    ] {
        assert_eq!(read_slices(&header, files), in_order(order));
    }
}

#[test]
fn each_of_several_files_has_its_own_header_to_skip() {
    let files = slices(|k| format!("s{k}"), 5);
    for header in [
        detached_nrrd("s%d 0 3 1", "byte skip: 5\n"),
        detached_nrrd("s%d 0 3 1", "byte skip: -1\n"),
        detached_meta("s%d 0 3 1", "HeaderSize = 5\n"),
        detached_meta("s%d 0 3 1", "HeaderSize = -1\n"),
    ] {
        assert_eq!(read_slices(&header, &files), in_order([0, 1, 2, 3]));
    }
    let lines: Vec<(String, Vec<u8>)> =
        (0..4).map(|k| (format!("s{k}"), [b"P5\n3 2\n".to_vec(), slice(k, 0)].concat())).collect();
    assert_eq!(read_slices(&detached_nrrd("s%d 0 3 1", "line skip: 2\n"), &lines), in_order([0, 1, 2, 3]));
    let hex: Vec<(String, Vec<u8>)> = (0..4)
        .map(|k| {
            (
                format!("s{k}"),
                slice(k, 0).iter().map(|byte| format!("{byte:02x}\n")).collect::<String>().into_bytes(),
            )
        })
        .collect();
    let header = String::from_utf8(detached_nrrd("s%d 0 3 1", "")).unwrap().replace("raw", "hex");
    assert_eq!(read_slices(header.as_bytes(), &hex), in_order([0, 1, 2, 3]));
}

/// Returns bytes as a gzip stream, or as a zlib stream.
fn deflated(bytes: &[u8], format: VolumeFormat) -> Vec<u8> {
    let init = VolumeInit::new(Voxels::U8(bytes.to_vec()), [bytes.len(), 1, 1, 1]);
    let file = write_volume(&Volume::new(init).unwrap(), format, Compression::Deflate).unwrap();
    let end: &[u8] = if format == VolumeFormat::Nrrd { b"\n\n" } else { b"LOCAL\n" };
    let at = file.windows(end.len()).position(|part| part == end).unwrap();
    file[at + end.len()..].to_vec()
}

#[test]
fn each_of_several_files_is_compressed_by_itself() {
    let packed = |format| -> Vec<(String, Vec<u8>)> {
        (0..4).map(|k| (format!("s{k}"), deflated(&slice(k, 0), format))).collect()
    };
    let nrrd = String::from_utf8(detached_nrrd("s%d 0 3 1", "")).unwrap().replace("raw", "gzip");
    let meta = detached_meta("s%d 0 3 1", "CompressedData = True\n");
    assert_eq!(read_slices(nrrd.as_bytes(), &packed(VolumeFormat::Nrrd)), in_order([0, 1, 2, 3]));
    assert_eq!(read_slices(&meta, &packed(VolumeFormat::Mha)), in_order([0, 1, 2, 3]));
}

#[test]
fn files_that_are_missing_or_of_another_size_are_named() {
    let files = slices(|k| format!("s{k}.raw"), 0);
    let message = |header: &[u8], files: &[(String, Vec<u8>)]| {
        let files: Vec<File<'_>> =
            files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
        beside(header, &files).expect_err("must be refused").to_string()
    };
    let mut wrong = files.clone();
    wrong[1].1.push(0);
    let mut short = files.clone();
    short[1].1.pop();
    for header in [detached_nrrd("s%d.raw 0 3 1", ""), detached_meta("s%d.raw 0 3 1", "")] {
        let missing = message(&header, &files[1..]);
        assert!(missing.contains("1 of the 4 that the header names is missing: 's3.raw'"), "{missing}");
        assert!(message(&header, &wrong).contains("file 's2.raw': has 13 bytes of voxels"));
        assert!(message(&header, &short).contains("file 's2.raw': has 11 bytes of voxels"));
        assert!(
            message(&header, &[])
                .contains("4 of the 4 that the header names are missing: 's0.raw', 's1.raw', 's2.raw', …")
        );
        assert!(parse_volume(&header, None).unwrap_err().to_string().contains("pass it in `files`"));
    }
    for (header, problem) in [
        (detached_nrrd("LIST 1\ns0.raw\ns1.raw", ""), "2 files of 1 axes; the sizes call for 8"),
        (detached_nrrd("s%d.raw 0 3 1 7", ""), "as many axes as the volume, or fewer"),
        (detached_nrrd("s%d.raw 0 3 0", ""), "must be like"),
        (detached_nrrd("LIST", ""), "must be followed by the names"),
        (detached_meta("LIST", ""), "must be followed by the names"),
        (detached_meta("s%d.raw 3 0 1", ""), "must be like"),
        (
            detached_meta("LIST\ns0.raw\ns1.raw\ns2.raw\ns3.raw\ns0.raw", ""),
            "5 files cannot have equal parts",
        ),
        (
            detached_meta("s%d.raw 0 9000000000000000000 1", ""),
            "9000000000000000001 that the header names are missing",
        ),
    ] {
        let found = message(&header, &files);
        assert!(found.contains(problem), "{found}");
    }
}

#[test]
fn metaimage_fields_with_more_numbers_than_axes() {
    let header = "NDims = 2\nDimSize = 4 3\nElementType = MET_UCHAR\nElementSpacing = 2 3 4\nOffset = 5 6 7\n\
                  TransformMatrix = 0 1 0 1 0 0 0 0 1\nDistanceUnits = um\nElementDataFile = LOCAL\n";
    let volume = silent(&[header.as_bytes(), &(0..12).collect::<Vec<u8>>()].concat());
    assert_rows(&volume, [[0.0, -3.0, 0.0, -5.0], [-2.0, 0.0, 0.0, -6.0], [0.0, 0.0, 1.0, 0.0]]);
    assert_eq!((volume.dims(), volume.unit()), ([4, 3, 1], LengthUnit::Micrometre));
    for (wrong, field) in [("Spacing = 2 3 x", "ElementSpacing"), ("Spacing = 2", "ElementSpacing")] {
        let header = header.replace("Spacing = 2 3 4", wrong);
        assert!(refusal(&[header.as_bytes(), &[0; 12]].concat()).contains(field));
    }
}

#[test]
fn fields_that_are_given_twice_are_refused() {
    for line in ["spacings: 1 2 3\nspacings: 1 2 4", "space: LPS\nspace: LPS"] {
        let message = refusal(&nrrd(&[line]));
        assert!(message.contains("is given twice"), "{message}");
    }
    let meta = |lines: &str| {
        let header = format!(
            "NDims = 3\nDimSize = 2 2 1\nElementType = MET_UCHAR\n{lines}\nElementDataFile = LOCAL\n"
        );
        [header.as_bytes(), &[1, 2, 3, 4]].concat()
    };
    let message = refusal(&meta("ElementSpacing = 1 2 3\nElementSpacing = 4 5 6"));
    assert!(message.contains("ElementSpacing: is given twice, with different values"), "{message}");
    silent(&meta("ElementSpacing = 1 2 3\nComment = a\nElementSpacing = 1 2 3\nComment = b"));
}

#[test]
fn more_voxels_than_the_header_says_are_no_padding() {
    let header = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_LONG\nElementDataFile = LOCAL\n";
    let with = |numbers: &[u8]| [header.as_bytes(), numbers].concat();
    let of_8_bytes: Vec<u8> = (0..8u64).flat_map(u64::to_le_bytes).collect();
    let message = refusal(&with(&of_8_bytes));
    assert!(message.contains("64 bytes of voxels, the header accounts for 32"), "{message}");
    let of_4_bytes: Vec<u8> = (0..8u32).flat_map(u32::to_le_bytes).collect();
    silent(&with(&[&of_4_bytes[..], &[0; 480]].concat()));
    silent(&with(&[&of_4_bytes[..], b"\n"].concat()));
}

#[test]
fn a_byte_order_mark_before_a_header_is_skipped() {
    assert_eq!(values(&silent(&[b"\xEF\xBB\xBF", &nrrd(&["spacings: 1 2 3"])[..]].concat())).len(), 24);
    let meta = b"\xEF\xBB\xBFNDims = 1\nDimSize = 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nab";
    assert_eq!(values(&silent(meta)), [97.0, 98.0]);
}

#[test]
fn a_single_channel_before_the_axes_of_a_volume_is_no_axis_of_it() {
    let four = |sizes: &str| {
        let header = format!("NRRD0004\ntype: uint8\ndimension: 4\nsizes: {sizes}\nencoding: raw\n\n");
        let volume = silent(&[header.into_bytes(), (0..24).collect()].concat());
        (volume.dims(), volume.frames())
    };
    assert_eq!(four("1 4 3 2"), ([4, 3, 2], 1));
    assert_eq!(four("4 3 2 1"), ([4, 3, 2], 1));
    assert_eq!(four("1 4 6 1"), ([1, 4, 6], 1));
    assert_eq!(four("4 3 1 2"), ([4, 3, 1], 2));
}

#[test]
fn a_sequence_of_slices_is_a_volume_with_a_warning() {
    let header = "NDims = 3\nDimSize = 2 1 2\nSeq_Frame0000_Timestamp = 1.5\nSeq_Frame0001_Timestamp = 2.5\n\
                  ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcd";
    assert_warned(&whole(header.as_bytes()), "Seq_Frame");
}

#[test]
fn what_follows_a_gzip_stream_is_named() {
    let whole = {
        let small = silent(&Header::new().file());
        write_volume(&small, VolumeFormat::Nifti, Compression::Deflate).unwrap()
    };
    silent(&[&whole[..], &[0; 40]].concat());
    let message = refusal(&[&whole[..], b"garbage at the end"].concat());
    assert!(message.contains("followed by 18 bytes that are no gzip stream"), "{message}");
}

/// Returns headers of all kinds whose voxels are in the files `s0` to `s3`, `a.img` and in themselves.
fn headers() -> Vec<Vec<u8>> {
    let colours = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 2 2 1\nkinds: RGB-color domain domain domain\nencoding: raw\n\n";
    vec![
        detached_nrrd("LIST 2\ns2\ns0\ns3\ns1", "units: \"mm\" \"um\" \"mm\"\n"),
        detached_nrrd("s%01d 3 0 -1 2", "byte skip: -1\naxis mins: 1 2 3\ncenters: cell node cell\n"),
        detached_meta("LIST\ns2\ns0\ns3\ns1", "HeaderSize = -1\n"),
        detached_meta("s%d 0 3 1", "ElementSpacing = 1 2 3 4\n"),
        analyze().bytes(253, &[2, 0, 2, 0, 1, 0]).0,
        Header::new().ints(40, &[3, 2, 2, 1]).ints(70, &[128, 24]).with(&RGB),
        Header::new().ints(254, &[1]).with_qform().file(),
        [colours.as_bytes(), &RGB].concat(),
        nrrd(&["space dimension: 3", PLACED]),
    ]
}

#[test]
fn damaged_headers_give_a_volume_or_an_error() {
    let mut random = Random(20_261_128);
    let mut files = slices(|k| format!("s{k}"), 0);
    files.push(("a.img".to_owned(), numbers()));
    let files: Vec<File<'_>> = files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    for (at, header) in headers().iter().enumerate() {
        assert!(beside(header, &files).is_ok(), "header {at}");
        let mut counts = [0; 2];
        for _ in 0..2000 {
            let mut damaged = header.clone();
            for _ in 0..=random.below(4) {
                let at = random.below(damaged.len());
                damaged[at] = random.below(256) as u8;
            }
            let found = beside(&damaged, &files);
            if let Ok(volume) = &found {
                let count = volume.dims().iter().product::<usize>() * volume.frames();
                assert!(
                    count == volume.voxels().len() && count <= damaged.len() + 48,
                    "header {at}: {count}"
                );
            }
            counts[usize::from(found.is_ok())] += 1;
        }
        assert!(counts.iter().all(|&count| count > 50), "header {at}: {counts:?} refused and read");
    }
}
