//! Fuzz targets of the readers of volumes, and of the functions on a volume that was read.

use vesicle::io::{
    Compression, FormatError, VolumeFormat, VolumeOptions, parse_volume, parse_volume_with, write_volume,
};
use vesicle::math::DVec3;
use vesicle::volume::{Enrichment, Interpolation, ResampleGrid, Volume, marching_cubes_world};

/// Largest number of voxels of a volume that [`check`] also samples, contours and writes.
const FULL_CHECK_LIMIT: usize = 4096;

/// Reads a whole file as a volume; the seeds are NIfTI files.
pub fn nifti(data: &[u8]) {
    use_volume(data, None);
}

/// Reads a whole file as a volume; the seeds are NRRD files.
pub fn nrrd(data: &[u8]) {
    use_volume(data, None);
}

/// Reads a whole file as a volume; the seeds are MetaImage files.
pub fn metaimage(data: &[u8]) {
    use_volume(data, None);
}

/// Reads a header with detached voxels, and with the same voxels in files of some names; the first two bytes are the length
/// of the header, low byte first.
pub fn pair(data: &[u8]) {
    let Some((&length, rest)) = data.split_first_chunk() else { return };
    let (header, voxels) = rest.split_at(usize::from(u16::from_le_bytes(length)).min(rest.len()));
    use_volume(header, Some(voxels));
    let files: Vec<(&str, &[u8])> =
        ["a.raw", "b.raw", "s1", "s2", "a.img"].map(|name| (name, voxels)).to_vec();
    let options = VolumeOptions { files: Some(&files), ..VolumeOptions::default() };
    checked(parse_volume_with(header, &options));
}

/// Reads compressed voxels with valid checksums; the first byte selects the file around them: plain gzip, NRRD or
/// MetaImage.
pub fn gzip(data: &[u8]) {
    let Some((&kind, deflated)) = data.split_first() else { return };
    let content = inflated(deflated).unwrap_or_default();
    let file = match kind % 3 {
        0 => gzipped(deflated, &content),
        1 => [&b"NRRD0004\ntype: uchar\ndimension: 1\nsizes: 60\nencoding: gzip\n\n"[..], &gzipped(deflated, &content)].concat(),
        _ => [&b"ObjectType = Image\nNDims = 1\nDimSize = 60\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n"[..], &zlib(deflated, &content)].concat(),
    };
    use_volume(&file, None);
}

/// Inflates a deflate stream; `None` if it is invalid or gives more than 64 KiB.
fn inflated(deflated: &[u8]) -> Option<Vec<u8>> {
    miniz_oxide::inflate::decompress_to_vec_with_limit(deflated, 1 << 16).ok()
}

/// Returns a gzip member with valid checksum that contains a deflate stream; `content` is the inflated stream.
fn gzipped(deflated: &[u8], content: &[u8]) -> Vec<u8> {
    let header = [0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 255];
    [&header[..], deflated, &crc32(content).to_le_bytes(), &(content.len() as u32).to_le_bytes()].concat()
}

fn crc32(bytes: &[u8]) -> u32 {
    let bit = |crc: u32, _| if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), bit))
}

/// Returns a zlib stream with valid checksum that contains a deflate stream; `content` is the inflated stream.
fn zlib(deflated: &[u8], content: &[u8]) -> Vec<u8> {
    let sums = content.iter().fold([1, 0], |[a, b], &byte| {
        let a = (a + u32::from(byte)) % 65_521;
        [a, (b + a) % 65_521]
    });
    [&[0x78, 0x9C], deflated, &(sums[1] << 16 | sums[0]).to_be_bytes()].concat()
}

/// Reads a volume, with `detached` voxels if there are any, and checks it; an error must have a short message.
fn use_volume(bytes: &[u8], detached: Option<&[u8]>) {
    checked(parse_volume(bytes, detached));
}

fn checked(result: Result<Volume, FormatError>) {
    match result {
        Ok(volume) => check(&volume),
        Err(error) => {
            assert!(error.to_string().len() < 2000, "a message of {} bytes", error.to_string().len())
        }
    }
}

/// Asserts that a volume that was read is valid and, if small, that it can be sampled, contoured and written.
fn check(volume: &Volume) {
    let ([nx, ny, nz], frames) = (volume.dims(), volume.frames());
    assert_eq!(volume.voxels().len(), nx * ny * nz * frames);
    let [low, high] = volume.range();
    assert!(low <= high && low.is_finite() && high.is_finite());
    if volume.voxels().len() > FULL_CHECK_LIMIT {
        return;
    }
    for frame in [0, frames - 1] {
        let values = volume.intensities(frame).unwrap();
        assert!(values.iter().all(|v| !v.is_infinite()));
        let counted: u32 = volume.histogram(16, frame).unwrap().iter().sum();
        assert!(counted as usize <= values.len());
        for (axis, size) in volume.dims().into_iter().enumerate() {
            let slice = volume.slice(axis, size - 1, frame).unwrap();
            assert_eq!(slice.len() * size, values.len());
        }
        let middle = DVec3::new(nx as f64, ny as f64, nz as f64) / 2.0;
        let world = volume.affine().transform_point3(middle);
        assert!(volume.sample(world, frame).is_ok_and(f64::is_finite) || !world.is_finite());
        if let Ok(surface) = marching_cubes_world(volume, 0.5 * (low + high), frame) {
            assert!(surface.validate().is_ok());
        }
    }
    derive(volume);
    write(volume);
}

/// Computes pyramid, binned volume, interpolated slices, masks and resampled volumes; errors are accepted, panics are findings.
fn derive(volume: &Volume) {
    let levels = volume.max_pyramid_levels(2.0).unwrap_or(0);
    let _ = volume.pyramid(levels.min(3), 2.0);
    let _ = volume.binned([2, 1, 3]);
    for method in [Enrichment::Flow, Enrichment::Linear] {
        let _ = volume.enrich_slices(Some(2), method);
    }
    if let Some(label) = volume.labels(0).ok().and_then(|labels| labels.first().copied()) {
        // Other frames may have intensities that are no labels.
        assert!(volume.label(&[label.value]).is_err() || volume.dice(volume, Some(label.value)) == Ok(1.0));
    }
    let [low, high] = volume.range();
    assert_eq!(volume.threshold(low, high).unwrap().dims(), volume.dims());
    for how in [Interpolation::Linear, Interpolation::Nearest] {
        let _ = volume.resample(ResampleGrid::Dims([3, 2, 4]), how);
        let _ = volume.resample(ResampleGrid::Like(volume), how);
    }
}

/// Writes the volume in each format and, if that can be read again, asserts that dimensions and frames are the same.
fn write(volume: &Volume) {
    for format in [VolumeFormat::Nifti, VolumeFormat::Nrrd, VolumeFormat::Mha] {
        for compression in [Compression::None, Compression::Deflate] {
            let file = write_volume(volume, format, compression).unwrap();
            if let Ok(again) = parse_volume(&file, None) {
                assert_eq!(again.dims(), volume.dims());
                assert_eq!(again.frames(), volume.frames());
            }
        }
    }
}
