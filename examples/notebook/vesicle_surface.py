"""A surface in a notebook: a NumPy array goes to the browser, the surface grows there, its mesh comes back.

`npm run notebook` makes `built/surface.js`, which has the library inside: nothing else is fetched.
"""

from pathlib import Path

import anywidget
import numpy as np
import traitlets

# What the library takes as it is; anything else becomes the nearest of them.
KINDS = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


def array_trait(order):
    """A trait that holds an array or None, and crosses over as bytes; order "F" has the first axis fastest, "C" the last."""

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
    """The volume with numbers of a kind that the library takes."""
    volume = np.asarray(volume)
    if volume.ndim not in (3, 4):
        raise ValueError(f"volume: {volume.ndim} axes; volume[x, y, z] or volume[x, y, z, frame] is needed")
    if volume.dtype.name in KINDS:
        return volume
    return volume.astype("uint8" if volume.dtype == bool else "float32" if volume.dtype == "float16" else "float64")


class Surface(anywidget.AnyWidget):
    """A closed surface that grows onto what is brighter than `params["iso"]` in a volume.

    volume: array [x, y, z], as nibabel has it; of an array [z, y, x] the transpose.
    affine: 4 x 4, voxel index to world, as nibabel has it; without it a voxel is 1 wide.
    params: of the deformable model, such as {"iso": 95}; they may be changed at any time.
    levels: of the pyramid, from coarse to fine.

    `state` is loading, running, paused, done or error, and `message` says what is wrong; setting `running` pauses and goes on.
    `vertices` (n x 3, world) and `triangles` (m x 3, counter-clockwise from outside) are there when it pauses or is done.
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
    vertices = array_trait("C")
    triangles = array_trait("C")

    def __init__(self, volume, affine=None, **traits):
        # Column by column, as the library has matrices.
        columns = np.eye(4) if affine is None else np.asarray(affine, float)
        super().__init__(volume=voxels(volume), affine=columns.T.ravel().tolist(), **traits)
