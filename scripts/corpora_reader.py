"""Reads one file for each line of its input with the readers of others, and answers with what they found, for corpora.mjs.

Needs nibabel, SimpleITK, pydicom, tifffile and trimesh.
"""

import json
import os
import sys
import warnings

import numpy as np

warnings.filterwarnings("ignore")


def volume_facts(values, spacing=None):
    """Returns the facts of voxels in the order z, y, x, or t, z, y, x."""
    values = np.asarray(values)
    if values.dtype.kind in "cV" or values.dtype == bool:
        raise ValueError("no numbers")
    frames = values.shape[0] if values.ndim == 4 else 1
    first = (values[0] if values.ndim == 4 else values).astype(float)
    while first.ndim < 3:
        first = first[np.newaxis]
    finite = values[np.isfinite(values)].astype(float)
    facts = {
        "dims": list(first.shape[::-1]),
        "frames": frames,
        "range": [float(finite.min()), float(finite.max())],
        "mean": float(np.where(np.isfinite(first), first, 0).mean()),
    }
    if spacing is not None:
        facts["spacing"] = [float(x) for x in spacing]
    return facts


def read_volume(path):
    if path.lower().endswith((".nii", ".nii.gz", ".hdr")):
        import nibabel

        image = nibabel.load(path)
        data = np.asanyarray(image.dataobj)
        if data.ndim > 4 and all(n == 1 for n in data.shape[4:]):
            data = data.reshape(data.shape[:4])
        return volume_facts(data.T, np.sqrt((image.affine[:3, :3] ** 2).sum(axis=0)))
    import SimpleITK

    image = SimpleITK.ReadImage(path)
    if image.GetNumberOfComponentsPerPixel() != 1:
        raise ValueError("several components")
    return volume_facts(SimpleITK.GetArrayFromImage(image))


def read_mesh(path):
    import trimesh

    mesh = trimesh.load(path, force="mesh", process=False)
    return {"triangles": len(mesh.faces), "area": float(mesh.area)}


def read_tiff(path):
    import tifffile

    values = tifffile.imread(path)
    if values.ndim > 3:
        raise ValueError("more than three axes")
    return volume_facts(values)


def read_dicom(path):
    import pydicom
    from pydicom.pixels import apply_rescale

    data = pydicom.dcmread(path)
    values = data.pixel_array
    if values.ndim != 3 or data.SamplesPerPixel != 1:
        raise ValueError("no volume")
    return volume_facts(apply_rescale(values, data))


READERS = {"volume": read_volume, "mesh": read_mesh, "tiff": read_tiff, "dicom": read_dicom}

for line in sys.stdin:
    request = json.loads(line)
    # Readers print warnings, which are no answers.
    out = os.dup(1)
    os.dup2(2, 1)
    try:
        reader = READERS.get(request["kind"])
        answer = {"status": "read", "facts": reader(request["path"])} if reader else {"status": "none"}
    except Exception as error:
        answer = {"status": "refused", "reason": str(error)[:200]}
    sys.stdout.flush()
    os.dup2(out, 1)
    os.close(out)
    print(json.dumps(answer), flush=True)
