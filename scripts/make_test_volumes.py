"""Writes tests/data/volumes/made: one small volume in many formats, written by their usual Python libraries.

    pip install nibabel==5.4.2 pynrrd==1.1.3 SimpleITK==2.5.7 numpy
    python scripts/make_test_volumes.py tests/data/volumes/made

Voxel (x, y, z, t) of 5 x 4 x 3 (x 2) holds unit * (x + 5y + 20z + 60t), unit 1, 100, 1e6 or 0.25 by type.
The grid is rotated, with spacing 1.5, 2, 3; its affine in RAS is printed at the end, as nibabel reads it back.
"""

import sys
from pathlib import Path

import nibabel as nib
import nrrd
import numpy as np
import SimpleITK as sitk

OUT = Path(sys.argv[1])
UNITS = {"i1": 1, "u1": 1, "i2": 100, "u2": 100, "i4": 10**6, "u4": 10**6, "i8": 10**6, "u8": 10**6, "f4": 0.25, "f8": 0.25}


def ramp(kind, frames=1):
    t, z, y, x = np.meshgrid(np.arange(frames), np.arange(3), np.arange(4), np.arange(5), indexing="ij")
    values = (x + 5 * y + 20 * z + 60 * t) * UNITS[kind]
    volume = values.transpose(3, 2, 1, 0).astype(kind)
    return volume if frames > 1 else volume[..., 0]


def rotation():
    w, x, y, z = np.array([0.8, 0.2, -0.4, 0.4])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


AFFINE = np.eye(4)
AFFINE[:3, :3] = rotation() @ np.diag([1.5, 2.0, 3.0])
AFFINE[:3, 3] = [-10.0, 20.0, 5.5]
LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


def nifti(name, kind, big=False, two=False, frames=1, sform=1, qform=0, affine=AFFINE, slope=None, units=("mm", "sec"), step=1.0):
    cls = nib.Nifti2Image if two else nib.Nifti1Image
    header = (nib.Nifti2Header if two else nib.Nifti1Header)(endianness=">" if big else "<")
    header.set_data_dtype(np.dtype(kind))
    image = cls(ramp(kind, frames), affine, header)
    image.set_sform(affine if sform else None, sform)
    image.set_qform(affine if qform else None, qform)
    image.header.set_xyzt_units(*units)
    if frames > 1:
        zooms = image.header.get_zooms()
        image.header.set_zooms(zooms[:3] + (step,))
    image.to_filename(OUT / name)
    if slope:  # nibabel would scale the stored numbers: write slope and intercept (NIfTI-1) over its NaN instead
        data = bytearray((OUT / name).read_bytes())
        data[112:120] = np.array(slope, dtype=">f4" if big else "<f4").tobytes()
        (OUT / name).write_bytes(bytes(data))


def write_niftis():
    for kind in UNITS:
        nifti(f"{kind}.nii", kind)
        nifti(f"{kind}_big.nii", kind, big=True)
    nifti("two_f4.nii.gz", "f4", two=True)
    nifti("two_big_i2_4d.nii", "i2", two=True, big=True, frames=2, units=("mm", "msec"), step=40.0)
    nifti("usec_4d.nii.gz", "u1", frames=2, units=("micron", "usec"), step=2500.0)
    nifti("qform.nii", "u1", sform=0, qform=1)
    mirrored = AFFINE @ np.diag([1.0, 1.0, -1.0, 1.0])
    nifti("qform_mirrored_big.nii", "u1", big=True, sform=0, qform=2, affine=mirrored)
    nifti("no_form.nii", "u1", sform=0, qform=0)
    nifti("scaled.nii", "i2", slope=(0.5, -3.0))
    image = nib.Nifti1Image(ramp("i2"), AFFINE)
    image.header.extensions.append(nib.nifti1.Nifti1Extension("comment", b"an extension between header and voxels"))
    image.to_filename(OUT / "extension.nii.gz")
    pair = nib.Nifti1Pair(ramp("i2"), AFFINE)
    pair.to_filename(OUT / "pair.hdr")
    colour = np.zeros((5, 4, 3), dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    nib.Nifti1Image(colour, AFFINE).to_filename(OUT / "rgb24.nii.gz")
    nib.Nifti1Image(ramp("f4").astype("c8"), AFFINE).to_filename(OUT / "complex64.nii.gz")


def nrrd_header(space):
    affine = LPS @ AFFINE if space == "left-posterior-superior" else AFFINE
    if space == "left-anterior-superior":
        affine = np.diag([-1.0, 1.0, 1.0, 1.0]) @ AFFINE
    return {"space": space, "space directions": affine[:3, :3].T, "space origin": affine[:3, 3], "space units": ["mm"] * 3}


def write_nrrds():
    for kind in UNITS:
        for endian in ["little", "big"]:
            header = nrrd_header("left-posterior-superior") | {"endian": endian, "encoding": "raw"}
            order = ">" if endian == "big" else "<"
            nrrd.write(str(OUT / f"{kind}_{endian}.nrrd"), ramp(kind).astype(order + kind), header)
    for space in ["right-anterior-superior", "left-anterior-superior", "left-posterior-superior"]:
        short = "".join(word[0] for word in space.split("-"))
        nrrd.write(str(OUT / f"gzip_{short}.nrrd"), ramp("i2"), nrrd_header(space) | {"encoding": "gzip"})
    nrrd.write(str(OUT / "ascii.nrrd"), ramp("f4"), nrrd_header("left-posterior-superior") | {"encoding": "ascii"})
    nrrd.write(str(OUT / "bzip2.nrrd"), ramp("u1"), nrrd_header("left-posterior-superior") | {"encoding": "bzip2"})
    nrrd.write(str(OUT / "spacings.nrrd"), ramp("u1"), {"spacings": [1.5, 2.0, float("nan")], "encoding": "raw"})
    nrrd.write(str(OUT / "detached.nhdr"), ramp("i2"), nrrd_header("left-posterior-superior") | {"encoding": "raw"}, detached_header=True)
    header = nrrd_header("left-posterior-superior")
    header["space directions"] = np.vstack([header["space directions"], [np.nan] * 3])
    header["kinds"] = ["domain"] * 3 + ["list"]
    nrrd.write(str(OUT / "frames.nrrd"), ramp("i2", 2), header | {"encoding": "gzip"})
    header["space directions"] = np.roll(header["space directions"], 1, axis=0)
    header["kinds"] = ["vector"] + ["domain"] * 3
    nrrd.write(str(OUT / "vectors.nrrd"), np.moveaxis(ramp("i2", 2), 3, 0), header | {"encoding": "gzip"})


def itk_image(kind):
    image = sitk.GetImageFromArray(ramp(kind).T)
    affine = LPS @ AFFINE
    image.SetSpacing([1.5, 2.0, 3.0])
    image.SetDirection((affine[:3, :3] / [1.5, 2.0, 3.0]).flatten())
    image.SetOrigin(affine[:3, 3])
    return image


def write_metaimages():
    for kind in UNITS:
        sitk.WriteImage(itk_image(kind), str(OUT / f"{kind}.mha"))
    sitk.WriteImage(itk_image("i2"), str(OUT / "compressed.mha"), useCompression=True)
    sitk.WriteImage(itk_image("i2"), str(OUT / "compressed.mhd"), useCompression=True)
    sitk.WriteImage(itk_image("i2"), str(OUT / "detached.mhd"))
    sitk.WriteImage(itk_image("i2"), str(OUT / "itk.nii.gz"))
    sitk.WriteImage(itk_image("i2"), str(OUT / "itk.nrrd"))
    frames = sitk.JoinSeries([sitk.GetImageFromArray(ramp("i2", 2)[..., t].T) for t in range(2)])
    sitk.WriteImage(frames, str(OUT / "frames.mha"))


OUT.mkdir(parents=True, exist_ok=True)
write_niftis()
write_nrrds()
write_metaimages()
print(nib.load(OUT / "f8.nii").affine.tolist())
