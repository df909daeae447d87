//! Seed inputs for fuzzing: small files of every format, and random scenes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "the lints spare tests, but not their helpers")]

use super::super::common::{Random, shapes};
use super::fuzz::states;
use std::fs;
use std::path::Path;
use vesicle::io::{MeshFormat, write_animation, write_mesh};
use vesicle::mesh::{Texture, TriangleMesh};

/// A seed input: its file name and its bytes.
pub type Seed = (String, Vec<u8>);

/// Returns the seeds of a fuzz target.
pub fn of(target: &str) -> Vec<Seed> {
    match target {
        "nifti" => made(&[
            "u1.nii",
            "i2_big.nii",
            "scaled.nii",
            "qform.nii",
            "no_form.nii",
            "two_big_i2_4d.nii",
            "two_f4.nii.gz",
            "extension.nii.gz",
            "usec_4d.nii.gz",
            "rgb24.nii.gz",
        ])
        .into_iter()
        .chain([far_away("two_big_i2_4d.nii")])
        .collect(),
        "nrrd" => made(&[
            "ascii.nrrd",
            "u1_little.nrrd",
            "i8_big.nrrd",
            "gzip_las.nrrd",
            "frames.nrrd",
            "vectors.nrrd",
            "spacings.nrrd",
            "itk.nrrd",
        ])
        .into_iter()
        .chain([hex()])
        .collect(),
        "metaimage" => made(&["u1.mha", "f4.mha", "frames.mha", "compressed.mha"])
            .into_iter()
            .chain([far_away("u1.mha")])
            .collect(),
        "volume_pair" => pairs(),
        "gzip" => (0..3).map(|kind| (format!("deflated-{kind}"), deflated(kind))).collect(),
        "ply" => [mesh(MeshFormat::Ply), text_ply()].concat(),
        "stl" => [mesh(MeshFormat::Stl), text_stl()].concat(),
        "obj" => mesh(MeshFormat::Obj),
        "glb" => [mesh(MeshFormat::Glb), movie()].concat(),
        "gltf" => [mesh(MeshFormat::Glb), movie()]
            .concat()
            .into_iter()
            .map(|(name, file)| (name, opened(&file)))
            .collect(),
        "points" => points(),
        "state_deformable" => vec![("begun".into(), states::deformable_seed())],
        "state_implicit" => vec![("begun".into(), states::implicit_seed())],
        "state_multires" => vec![("begun".into(), states::multires_seed())],
        "state_tracking" => vec![("begun".into(), states::tracking_seed())],
        _ => (0..12).map(|seed| (format!("scene-{seed:02}"), scene(seed))).collect(),
    }
}

/// Returns random bytes; every byte string describes a scene.
fn scene(seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    (0..96).map(|_| random.next() as u8).collect()
}

fn data(file: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes/made").join(file)).unwrap()
}

fn made(files: &[&str]) -> Vec<Seed> {
    files.iter().map(|file| ((*file).into(), data(file))).collect()
}

fn hex() -> Seed {
    let header =
        "NRRD0004\ntype: short\ndimension: 2\nsizes: 2 2\nencoding: hex\nendian: big\nbyte skip: 0\n";
    (
        "hex.nrrd".into(),
        format!("{header}space: LAS\nspace directions: (1,0,0) (0,2,0)\n\n0001 00ff 7fff 8000\n").into(),
    )
}

/// Returns a file whose origin is beyond the range of `f32`.
fn far_away(file: &str) -> Seed {
    let mut bytes = data(file);
    if file.ends_with(".nii") {
        // The last number of the first row of a big-endian NIfTI-2.
        bytes[424..432].copy_from_slice(&1e300_f64.to_be_bytes());
    } else {
        let text = String::from_utf8_lossy(&bytes).replacen("Offset = 10", "Offset = 1e300", 1);
        bytes = text.into_bytes();
    }
    (format!("found-far-away-{file}"), bytes)
}

fn pairs() -> Vec<Seed> {
    let pair = |header: &str, voxels: &str| {
        let header_bytes = data(header);
        let length = (header_bytes.len() as u16).to_le_bytes();
        (header.to_owned(), [&length[..], &header_bytes, &data(voxels)].concat())
    };
    vec![
        pair("pair.hdr", "pair.img"),
        pair("detached.nhdr", "detached.raw"),
        pair("detached.mhd", "detached.raw"),
        pair("compressed.mhd", "compressed.zraw"),
    ]
}

fn deflated(kind: u8) -> Vec<u8> {
    let content = if kind == 0 { data("u1.nii") } else { (0..60).collect() };
    [vec![kind], miniz_oxide::deflate::compress_to_vec(&content, 6)].concat()
}

fn textured() -> TriangleMesh {
    let picture = Texture::new(b"\x89PNG\r\n\x1a\nnot looked at".to_vec()).unwrap();
    TriangleMesh { texture: Some(picture.into()), ..shapes::octahedron() }
}

fn mesh(format: MeshFormat) -> Vec<Seed> {
    let written = |(name, mesh): (&str, TriangleMesh)| {
        (format!("{name}.{}", format.extension()), write_mesh(&mesh, format).unwrap())
    };
    [
        ("bare", shapes::bare_octahedron()),
        ("full", shapes::octahedron()),
        ("seamed", shapes::octahedron_with_seam()),
        ("textured", textured()),
    ]
    .map(written)
    .to_vec()
}

fn movie() -> Vec<Seed> {
    vec![(
        "movie.glb".into(),
        write_animation([shapes::bare_octahedron(), shapes::octahedron()], 0.1).unwrap(),
    )]
}

/// Returns the JSON text of a GLB file, a zero byte, and its binary chunk.
fn opened(file: &[u8]) -> Vec<u8> {
    let text = u32::from_le_bytes(*file[12..].first_chunk().unwrap()) as usize;
    [&file[20..20 + text], &[0], file.get(28 + text..).unwrap_or_default()].concat()
}

fn text_ply() -> Vec<Seed> {
    let header = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n";
    let faces = "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n";
    let body = "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n4 0 1 2 3 8 0 0 1 0 1 1 0 1\n3 0 2 1 0\n";
    let big = "ply\nformat binary_big_endian 1.0\nelement other 1\nproperty list short ushort them\nelement vertex 3\nproperty short x\nproperty char y\nproperty uchar z\nelement face 1\nproperty list uint uchar vertex_index\nend_header\n";
    let numbers = [0, 1, 0, 7, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 1, 2];
    vec![
        ("text.ply".into(), [header, faces, body].concat().into()),
        ("big.ply".into(), [big.as_bytes(), &numbers].concat()),
    ]
}

fn text_stl() -> Vec<Seed> {
    let facet = |corners: &str| format!("facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n");
    let text =
        ["vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", "vertex 0 0 0\nvertex 1e-1 0 0\nvertex 0 0 -1.5\n"];
    vec![("text.stl".into(), format!("solid by hand\n{}endsolid\n", text.map(facet).concat()).into())]
}

fn points() -> Vec<Seed> {
    let texts = [
        ("three.xyz", "1 -2.5 3e-2\n4 5 6\n7 8 9\n"),
        ("counted.pts", "2\nany words\n1 -2.5 0.03 0.5 255 0 17\n4 5 6 0.25 0 9 8\n"),
        (
            "named.csv",
            "index,\"X\",Y,z,nx,ny,nz,red,green,blue\n0,1,2,3,1,0,0,255,0,51\n1,4,5,6,0,0,1,1,2,3\n",
        ),
        ("axes.csv", "index,axis-0,axis-1,axis-2\n0,0.03,-2.5,1\n1,6,5,4\n"),
        ("comments.txt", "# x y z r g b\n// two\n1;2;3;0.5;0.25;1\n%\n4;5;6;0;0;0\n"),
        ("keyed.pts", "d 1 1 1\np 1 2 3\ng 0.5\np 4 5 6\n"),
        ("vertices.obj", "# by hand\nv 1 2 3\nv 4 5 6 0.5 0.5 0.5\nvn 0 0 1\n"),
        ("nine.xyz", "1 2 3 255 0 0 0 0 1\n4 5 6 0 255 0 0 1 0\n"),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())).to_vec();
    [texts, mesh(MeshFormat::Ply)].concat()
}
