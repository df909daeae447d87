"""Writes tests/data/zarr: a part of a volume as OME-Zarr images, each a ZIP, written by ome-zarr and zarr-python.

    pip install ome-zarr==0.18.0 zarr==3.1.6 pynrrd==1.1.3
    python scripts/make_test_zarr.py www/public/data/ovule.nrrd tests/data/zarr

Level 0 is the box of the volume below, each further level every second voxel of the one before. Channel 1 is 255 minus
channel 0, and time 1 is time 0 mirrored along x. Values are multiplied by a factor in types other than uint8.
"""

import sys
import tempfile
import zipfile
from pathlib import Path

import nrrd
import numcodecs
import numpy as np
import zarr
from ome_zarr.format import FormatV04, FormatV05
from ome_zarr.writer import write_image, write_multiscale
from zarr.codecs import BloscCodec, GzipCodec, ZstdCodec

SOURCE, OUT = Path(sys.argv[1]), Path(sys.argv[2])
BOX = (slice(40, 66), slice(50, 72), slice(8, 22))  # x, y, z
CHUNKS = {"t": 1, "c": 1, "z": 6, "y": 9, "x": 11}
SHARDS = {"t": 1, "c": 1, "z": 12, "y": 18, "x": 22}
SCALE = {"t": 2.0, "c": 1.0, "z": 0.235, "y": 0.15, "x": 0.15}
ZYX = nrrd.read(str(SOURCE))[0][BOX].transpose(2, 1, 0).astype("u1")


def image(axes, kind="u1", factor=1):
    """Returns the voxels with the given axes, in their order."""
    channels = np.stack([ZYX, 255 - ZYX])
    tczyx = np.stack([channels, channels[..., ::-1]])
    wanted = tczyx[tuple(slice(None) if axis in axes else 0 for axis in "tczyx")]
    present = [axis for axis in "tczyx" if axis in axes]
    return (wanted.transpose([present.index(axis) for axis in axes]).astype(kind) * factor).astype(kind)


def pyramid(voxels, axes, levels):
    half = tuple(slice(None, None, 2 if axis in "zyx" else 1) for axis in axes)
    result = [voxels]
    while len(result) < levels:
        result.append(result[-1][half])
    return result


def metadata(axes, levels, unit="micrometer"):
    """Returns the attributes of an image whose transforms are split between its levels and the whole."""
    types = {"t": "time", "c": "channel"}
    units = {"t": {"unit": "second"}, "c": {}}

    def axis(name):
        return {"name": name, "type": types.get(name, "space"), **units.get(name, {"unit": unit})}

    def level(index):
        step = [float(2**index) if name in "zyx" else 1.0 for name in axes]
        scale = {"type": "scale", "scale": step}
        shift = {"type": "translation", "translation": [10.0 if name == "x" else 0.0 for name in axes]}
        return {"path": f"scale{index}/image", "coordinateTransformations": [scale, shift]}

    whole = {"type": "scale", "scale": [SCALE[name] for name in axes]}
    return {
        "axes": [axis(name) for name in axes],
        "datasets": [level(index) for index in range(levels)],
        "coordinateTransformations": [whole],
        "name": "ovule",
    }


def with_ome_zarr(name, axes, version, **storage):
    def write(folder):
        group = zarr.open_group(str(folder), mode="w", zarr_format=2 if version.version == "0.4" else 3)
        options = {"chunks": tuple(CHUNKS[axis] for axis in axes), **storage}
        scale = {axis: SCALE[axis] for axis in axes}
        units = {axis: "micrometer" for axis in axes if axis in "zyx"}
        write_multiscale(
            pyramid(image(axes), axes, 3), group, fmt=version, axes=axes, storage_options=options,
            coordinate_transformations=[
                [{"type": "scale", "scale": [SCALE[axis] * (2**level if axis in "zyx" else 1) for axis in axes]}]
                for level in range(3)
            ],
            axes_units=units,
        )  # fmt: skip

    pack(name, write)


def scaled_by_ome_zarr(name):
    def write(folder):
        group = zarr.open_group(str(folder), mode="w", zarr_format=3)
        options = {"chunks": (6, 9, 11)}
        scale = {axis: SCALE[axis] for axis in "zyx"}
        units = {axis: "micrometer" for axis in "zyx"}
        write_image(
            image("zyx"), group, scale_factors=[2], fmt=FormatV05(), axes="zyx", storage_options=options, scale=scale,
            axes_units=units,
        )  # fmt: skip

    pack(name, write)


def with_zarr_python(name, axes, kind, factor, version, levels=2, **storage):
    def write(folder):
        group = zarr.open_group(str(folder), mode="w", zarr_format=version)
        content = metadata(axes, levels)
        if version == 2:
            group.attrs["multiscales"] = [{"version": "0.4", **content}]
        else:
            group.attrs["ome"] = {"version": "0.5", "multiscales": [content]}
        for index, voxels in enumerate(pyramid(image(axes, kind, factor), axes, levels)):
            chunks = tuple(CHUNKS[axis] for axis in axes)
            group.create_array(f"scale{index}/image", data=np.ascontiguousarray(voxels), chunks=chunks, **storage)

    pack(name, write)


def pack(name, write):
    """Writes a folder and makes it a ZIP with fixed dates."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder))
        files = sorted(path for path in Path(folder).rglob("*") if path.is_file())
        with zipfile.ZipFile(OUT / f"{name}.zip", "w", zipfile.ZIP_STORED) as archive:
            for path in files:
                entry = zipfile.ZipInfo(str(path.relative_to(folder)), (1980, 1, 1, 0, 0, 0))
                archive.writestr(entry, path.read_bytes())
    print(name, (OUT / f"{name}.zip").stat().st_size)


def shards(axes):
    return tuple(SHARDS[axis] for axis in axes)


OUT.mkdir(parents=True, exist_ok=True)
with_ome_zarr("v2-blosc-tczyx", "tczyx", FormatV04())
with_ome_zarr("v3-zstd-zyx", "zyx", FormatV05())
scaled_by_ome_zarr("v3-scaled-zyx")
with_zarr_python(
    "v2-gzip-fortran", "zyx", ">u2", 100, 2, order="F", compressors=numcodecs.GZip(5),
    chunk_key_encoding={"name": "v2", "separator": "."},
)  # fmt: skip
with_zarr_python("v3-blosc-xyz", "xyz", "i2", -3, 3, compressors=BloscCodec(cname="zstd"))
with_zarr_python("v3-raw-float", "zyx", "f4", 0.25, 3, compressors=None)
with_zarr_python("v3-sharded-gzip", "zyx", "u1", 1, 3, shards=shards("zyx"), compressors=GzipCodec())
with_zarr_python("v3-sharded-zstd-yxzc", "yxzc", "u2", 7, 3, shards=shards("yxzc"), compressors=ZstdCodec())
