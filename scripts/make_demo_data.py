"""Makes the volumes, points and photographs that the app ships, in www/public/data.

    pip install nibabel==5.4.2 pynrrd==1.1.3 numpy scipy pillow==12.0.0
    python scripts/make_demo_data.py <folder of the source volumes> www/public/data
    python scripts/make_demo_data.py --points <folder of points and photographs> www/public/data

The source folder contains ct_head_visible_male/vismale_head_ct.nii.gz, ct_tooth/tooth.nhdr (with tooth.raw) and
micro_ovule/ovule_raw.nrrd; the folder of points contains points/spot_stereo_noisy.ply, points/spot_spacecarved.ply,
points/angel_scan_points.ply and multiview/spot_rendered (cameras.json, its views and masks). www/public/data/README.md
names the sources.

visible-human-head-full.nii.gz   all voxels of the CT head; air is set to 0 where it is more than MARGIN voxels away
                                 from any voxel of AIR or more, so that every iso-surface at AIR or more, and the
                                 gradient near it, is exactly that of the source
visible-human-head.nii.gz        the same with y and z halved: each voxel is the mean of 2 x 2, so that the grid is
                                 128 x 128 x 128 and nearly isotropic; then air is cleared as above
tooth.nrrd                       the CT of a tooth, as one gzipped file; intensities (0 to 1300) rounded to multiples
                                 of STEP, below the scan's own noise, which halves the file
ovule.nrrd                       plant cells under the confocal microscope, recompressed only
spot/stereo.ply, carved.ply      unchanged points
angel.ply                        unchanged points
spot/view00.png ...              the views with their masks as alpha; masked pixels are black
spot/cameras.json                their projections only
"""

import gzip
import json
import shutil
import sys
from pathlib import Path

import numpy as np

SOURCE, OUT = Path(sys.argv[-2]), Path(sys.argv[-1])
AIR = 20
MARGIN = 2
STEP = 8


def without_air(voxels):
    from scipy.ndimage import maximum_filter

    near = maximum_filter(voxels, size=2 * MARGIN + 1, mode="nearest") >= AIR
    return np.where(near, voxels, 0).astype(voxels.dtype)


def write_nifti(voxels, affine, name):
    import nibabel as nib

    image = nib.Nifti1Image(voxels, affine)
    image.set_sform(affine, 1)
    image.set_qform(affine, 1)
    image.header.set_xyzt_units("mm", "sec")
    image.header["descrip"] = b"Visible Human male, CT; NLM, public domain"
    # A fixed time in the gzip header, so that the same input gives the same bytes.
    (OUT / name).write_bytes(gzip.compress(image.to_bytes(), 9, mtime=0))


def write_heads():
    import nibabel as nib

    image = nib.load(SOURCE / "ct_head_visible_male/vismale_head_ct.nii.gz")
    voxels = np.asarray(image.dataobj)
    write_nifti(without_air(voxels), image.affine, "visible-human-head-full.nii.gz")
    nx, ny, nz = voxels.shape
    means = voxels.reshape(nx, ny // 2, 2, nz // 2, 2).mean(axis=(2, 4))
    halved = np.floor(means + 0.5).astype(np.uint8)
    # Coarse voxel j is centred between fine voxels 2j and 2j + 1.
    step = np.diag([1.0, 2.0, 2.0, 1.0])
    step[1:3, 3] = 0.5
    write_nifti(without_air(halved), image.affine @ step, "visible-human-head.nii.gz")


def write_tooth():
    import nrrd

    voxels, header = nrrd.read(str(SOURCE / "ct_tooth/tooth.nhdr"))
    fields = {"spacings": header["spacings"], "encoding": "gzip", "endian": "little", "content": "CT of a tooth"}
    rounded = (voxels.astype(int) + STEP // 2) // STEP * STEP
    nrrd.write(str(OUT / "tooth.nrrd"), rounded.astype("<u2"), fields, compression_level=9)


def write_ovule():
    import nrrd

    voxels, header = nrrd.read(str(SOURCE / "micro_ovule/ovule_raw.nrrd"))
    nrrd.write(str(OUT / "ovule.nrrd"), voxels, header, compression_level=9)


def write_points():
    (OUT / "spot").mkdir(exist_ok=True)
    shutil.copyfile(SOURCE / "points/spot_stereo_noisy.ply", OUT / "spot/stereo.ply")
    shutil.copyfile(SOURCE / "points/spot_spacecarved.ply", OUT / "spot/carved.ply")
    shutil.copyfile(SOURCE / "points/angel_scan_points.ply", OUT / "angel.ply")


def write_views():
    from PIL import Image

    folder = SOURCE / "multiview/spot_rendered"
    given = json.loads((folder / "cameras.json").read_text())
    cameras = []
    for camera in given["cameras"]:
        view = np.asarray(Image.open(folder / camera["image"]).convert("RGB"))
        inside = np.asarray(Image.open(folder / camera["mask"]).convert("L")) > 127
        rgba = np.dstack([view * inside[..., None], np.where(inside, 255, 0)]).astype(np.uint8)
        Image.fromarray(rgba).save(OUT / "spot" / camera["image"], optimize=True)
        cameras.append({"image": camera["image"], "P": [[float(f"{x:.9g}") for x in row] for row in camera["P"]]})
    lines = ",\n".join(json.dumps(camera) for camera in cameras)
    head = f'{{"width": {given["width"]}, "height": {given["height"]}, "cameras": [\n'
    (OUT / "spot/cameras.json").write_text(f"{head}{lines}\n]}}\n")


OUT.mkdir(parents=True, exist_ok=True)
if "--points" in sys.argv:
    write_points()
    write_views()
else:
    write_heads()
    write_tooth()
    write_ovule()
