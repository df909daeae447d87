"""A widget that fits a closed surface to a NumPy array in the browser and returns its mesh.

`npm run notebook` builds `built/surface.js`, which includes the library: nothing else is downloaded.
"""

from pathlib import Path

import anywidget
import numpy as np
import traitlets

# Number types that the library supports; others are converted to one of them.
KINDS = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


def array_trait(order):
    """Returns a trait of an array or None, sent as bytes; in order "F" the first axis is fastest, in "C" the last."""

    def packed(array, _widget):
        if array is None:
            return None
        native = array.astype(array.dtype.newbyteorder("="), copy=False)
        return {"kind": native.dtype.name, "shape": list(native.shape), "data": memoryview(native.tobytes(order))}

    def unpacked(sent, _widget):
        if sent is None:
            return None
        return np.frombuffer(bytearray(sent["data"]), sent["kind"]).reshape(sent["shape"], order=order)

    either = traitlets.Instance(np.ndarray, allow_none=True)
    return either.tag(sync=True, to_json=packed, from_json=unpacked, echo_update=False)


def voxels(volume):
    """Returns the volume in a number type that the library supports."""
    volume = np.asarray(volume)
    if volume.ndim not in (3, 4):
        raise ValueError(f"volume: {volume.ndim} axes; volume[x, y, z] or volume[x, y, z, frame] is needed")
    if volume.dtype.name in KINDS:
        return volume
    return volume.astype("uint8" if volume.dtype == bool else "float32" if volume.dtype == "float16" else "float64")


class Surface(anywidget.AnyWidget):
    """A closed surface that is fitted to the boundary of the voxels brighter than `params["iso"]`.

    volume: array [x, y, z], as in nibabel; transpose an array [z, y, x].
    affine: 4 x 4 matrix from voxel index to world, as in nibabel; by default a voxel has size 1.
    params: parameters of the deformable model, such as {"iso": 95}; they can be changed at any time.
    levels: number of pyramid levels above the volume, through which the fit goes from coarse to fine.

    `state` is loading, running, paused, done or error, and `message` describes an error; `running` pauses and resumes.
    `warnings` is a list of what to know about the result, each with `code` and `text`, and `where` if it is a part of it.
    `vertices` (n x 3, world) and `triangles` (m x 3, counter-clockwise from outside) are set when it is paused or done.
    """

    _esm = Path(__file__).with_name("built") / "surface.js"

    volume = array_trait("F")
    affine = traitlets.List(traitlets.Float()).tag(sync=True)
    levels = traitlets.Int(0).tag(sync=True)
    params = traitlets.Dict().tag(sync=True)
    running = traitlets.Bool(True).tag(sync=True)

    state = traitlets.Unicode("loading").tag(sync=True)
    message = traitlets.Unicode("").tag(sync=True)
    iteration = traitlets.Int(0).tag(sync=True)
    warnings = traitlets.List().tag(sync=True)
    vertices = array_trait("C")
    triangles = array_trait("C")

    def __init__(self, volume, affine=None, **traits):
        # Column-major, as the library expects.
        columns = np.eye(4) if affine is None else np.asarray(affine, float)
        super().__init__(volume=voxels(volume), affine=columns.T.ravel().tolist(), **traits)
