"""Writes tests/data/volumes/segmentation: DICOM segmentations of one made volume, by highdicom.

    pip install highdicom==0.28.2 numpy
    python scripts/make_test_segmentations.py tests/data/volumes/segmentation

The volume is an oblique grid of 20 x 16 x 12 voxels. Segment 2 is a small ellipsoid, segment 1 a shell around it, and
segment 3 a box beside both. Files are cropped to the slices that have segments.

binary.dcm      BINARY, segments that share no voxel
overlap.dcm     BINARY, segment 1 with its inside, which is segment 2
fractional.dcm  FRACTIONAL, 0.9 where a voxel is in a segment, and 0.3 of segment 1 in segment 2
labelmap.dcm    LABELMAP, of the newer class of objects
"""

import sys
from pathlib import Path

import highdicom as hd
import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sr.codedict import codes
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian

OUT = Path(sys.argv[1])
DIMS = (20, 16, 12)
SPACING = (1.2, 0.8, 2.0)
ORIGIN = np.array([-12.5, 31.25, 7.75])
ROW = np.array([0.8, 0.6, 0.0])
COLUMN = np.array([-0.36, 0.48, 0.8])
NORMAL = np.cross(ROW, COLUMN)

count = 0


def uid():
    global count
    count += 1
    return f"1.2.826.0.1.3680043.8.498.77.{count}"


STUDY, SERIES, FRAME = uid(), uid(), uid()


def ct_slice(z):
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.SOPClassUID, ds.SOPInstanceUID = CTImageStorage, uid()
    ds.StudyInstanceUID, ds.SeriesInstanceUID, ds.FrameOfReferenceUID = STUDY, SERIES, FRAME
    ds.PatientID = ds.PatientName = "made"
    ds.PatientBirthDate = ds.PatientSex = ds.AccessionNumber = ds.ReferringPhysicianName = ""
    ds.StudyID, ds.StudyDate, ds.StudyTime = "1", "20260101", "120000"
    ds.SeriesNumber, ds.InstanceNumber, ds.Modality, ds.Manufacturer = 1, z + 1, "CT", "made"
    ds.PositionReferenceIndicator = ""
    ds.ImageOrientationPatient = [*ROW, *COLUMN]
    ds.ImagePositionPatient = [round(float(x), 6) for x in ORIGIN + NORMAL * SPACING[2] * z]
    ds.PixelSpacing, ds.SliceThickness = [SPACING[1], SPACING[0]], SPACING[2]
    ds.Columns, ds.Rows, _ = DIMS
    ds.SamplesPerPixel, ds.PhotometricInterpretation, ds.PixelRepresentation = 1, "MONOCHROME2", 1
    ds.BitsAllocated, ds.BitsStored, ds.HighBit = 16, 16, 15
    ds.PixelData = bytes(2 * DIMS[0] * DIMS[1])
    return ds


def lab(rgb):
    """CIELab as DICOM stores it, of 8-bit sRGB."""
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in np.array(rgb) / 255]
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]]
    xyz = np.array(to_xyz) @ linear / [0.95047, 1, 1.08883]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    l, a, b = 116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])
    return [round(l / 100 * 65535), round((a + 128) / 255 * 65535), round((b + 128) / 255 * 65535)]


def segment(number, name, rgb, kind):
    description = hd.seg.SegmentDescription(number, name, codes.SCT.Organ, kind, "MANUAL")
    description.RecommendedDisplayCIELabValue = lab(rgb)
    return description


SEGMENTS = [
    segment(1, "Liver", (220, 130, 100), codes.SCT.Liver),
    segment(2, "Left kidney", (185, 102, 83), codes.SCT.Kidney),
    segment(3, "Spleen", (157, 108, 162), codes.SCT.Spleen),
]
SLICES = [ct_slice(z) for z in range(DIMS[2])]


def write(name, kind, voxels, **more):
    seg = hd.seg.Segmentation(
        SLICES, voxels, kind, SEGMENTS, uid(), 2, uid(), 1, "made", "made", "1", "1", content_creator_name="made", **more
    )
    seg.save_as(OUT / name)


z, y, x = np.meshgrid(*(np.arange(n) for n in reversed(DIMS)), indexing="ij")
squared = (x - 9) ** 2 + (y - 8) ** 2 + 2 * (z - 6) ** 2
whole, inside = squared < 36, squared < 9
box = (x >= 15) & (x < 19) & (y >= 2) & (y < 13) & (z >= 2) & (z < 10) & ~whole
disjoint = np.stack([whole & ~inside, inside, box], axis=-1)
write("binary.dcm", "BINARY", disjoint.astype(np.uint8))
write("overlap.dcm", "BINARY", np.stack([whole, inside, box], axis=-1).astype(np.uint8))
fractions = disjoint * 0.9
fractions[inside, 0] = 0.3
write("fractional.dcm", "FRACTIONAL", fractions.astype(np.float32), max_fractional_value=200)
write("labelmap.dcm", "LABELMAP", (disjoint * [1, 2, 3]).sum(axis=-1).astype(np.uint8))
print([int(part.sum()) for part in (whole & ~inside, inside, box)])
