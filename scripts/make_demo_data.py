"""Makes the volumes that the app ships, in www/public/data.

    pip install nibabel==5.4.2 pynrrd==1.1.3 numpy scipy
    python scripts/make_demo_data.py <folder of the source volumes> www/public/data

The source folder holds ct_head_visible_male/vismale_head_ct.nii.gz, ct_tooth/tooth.nhdr (with tooth.raw) and
micro_ovule/ovule_raw.nrrd; www/public/data/README.md says where these come from.

visible-human-head-full.nii.gz   all voxels of the CT head; air is set to 0 where it is more than MARGIN voxels away
                                 from anything of AIR or more, so that every surface of an intensity of AIR or more,
                                 and the gradient beside it, is exactly that of the source
visible-human-head.nii.gz        the same with y and z halved: each voxel is the mean of 2 x 2, so that the grid is
                                 128 x 128 x 128 and nearly isotropic; then air is cleared as above
tooth.nrrd                       the CT of a tooth, as one gzipped file; intensities (0 to 1300) rounded to multiples
                                 of STEP, below the scan's own noise, which halves the file
ovule.nrrd                       plant cells under the confocal microscope, recompressed only
"""

import gzip
import sys
from pathlib import Path

import nibabel as nib
import nrrd
import numpy as np
from scipy.ndimage import maximum_filter

SOURCE, OUT = Path(sys.argv[1]), Path(sys.argv[2])
AIR = 20
MARGIN = 2
STEP = 8


def without_air(voxels):
    near = maximum_filter(voxels, size=2 * MARGIN + 1, mode="nearest") >= AIR
    return np.where(near, voxels, 0).astype(voxels.dtype)


def write_nifti(voxels, affine, name):
    image = nib.Nifti1Image(voxels, affine)
    image.set_sform(affine, 1)
    image.set_qform(affine, 1)
    image.header.set_xyzt_units("mm", "sec")
    image.header["descrip"] = b"Visible Human male, CT; NLM, public domain"
    # A fixed time in the gzip header: the same input gives the same bytes.
    (OUT / name).write_bytes(gzip.compress(image.to_bytes(), 9, mtime=0))


def write_heads():
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
    voxels, header = nrrd.read(str(SOURCE / "ct_tooth/tooth.nhdr"))
    fields = {"spacings": header["spacings"], "encoding": "gzip", "endian": "little", "content": "CT of a tooth"}
    rounded = (voxels.astype(int) + STEP // 2) // STEP * STEP
    nrrd.write(str(OUT / "tooth.nrrd"), rounded.astype("<u2"), fields, compression_level=9)


def write_ovule():
    voxels, header = nrrd.read(str(SOURCE / "micro_ovule/ovule_raw.nrrd"))
    nrrd.write(str(OUT / "ovule.nrrd"), voxels, header, compression_level=9)


OUT.mkdir(parents=True, exist_ok=True)
write_heads()
write_tooth()
write_ovule()
