"""Writes the TIFF files in tests/data/tiff, by tifffile 2026.3.3 and imagecodecs 2026.3.6.

Voxel i has the value 7 i + (i mod 5) i, in the range of its type; that of floats is divided by 8. Images are 21 x 17.
"""

import sys
from pathlib import Path

import numpy
import tifffile

FOLDER = Path(__file__).parent.parent / "tests/data/tiff"
SHAPE = (2, 17, 21)


def voxels(kind, shape=SHAPE):
    index = numpy.arange(numpy.prod(shape), dtype="int64").reshape(shape)
    values = 7 * index + index % 5 * index
    kind = numpy.dtype(kind)
    if kind.kind == "f":
        return (values / 8).astype(kind)
    return values.astype(kind)


def write(name, data, **options):
    tifffile.imwrite(FOLDER / f"{name}.tif", data, photometric="minisblack", metadata=None, **options)


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    strips = {"rowsperstrip": 5}
    tiles = {"tile": (16, 16)}
    write("u2-be-lzw-2", voxels("u2"), byteorder=">", compression="lzw", predictor=True, bigtiff=True, **strips)
    write("i4-be-zlib-2", voxels("i4"), byteorder=">", compression="zlib", predictor=True, **tiles)
    write("f4-be-zlib-3", voxels("f4"), byteorder=">", compression="zlib", predictor=True, **tiles)
    write("f8-be-zstd-3", voxels("f8"), byteorder=">", compression="zstd", predictor=True, **strips)
    write("f4-le-lzw-3", voxels("f4"), compression="lzw", predictor=True, **tiles)
    write("i2-le-packbits", voxels("i2"), compression="packbits", **strips)
    write("u1-be-zstd-2", voxels("u1"), byteorder=">", compression="zstd", predictor=True, **tiles)
    write("f2-be", voxels("f2"), byteorder=">")
    write("i8-be-zlib", voxels("i8"), byteorder=">", compression="zlib", **strips)
    samples = numpy.moveaxis(voxels("u2", (2, 3, 17, 21)), 1, 3)
    write("u2-be-samples-2", samples, byteorder=">", compression="lzw", predictor=True, planarconfig="contig")
    write("u2-le-planes", voxels("u2", (2, 3, 17, 21)), compression="zlib", planarconfig="separate")
    grey = numpy.add.outer(3 * numpy.arange(24), 2 * numpy.arange(40)).astype("u1")
    write("jpeg", numpy.stack([grey, 255 - grey]), compression="jpeg", compressionargs={"level": 95}, tile=(16, 16))


if __name__ == "__main__":
    sys.exit(main())
