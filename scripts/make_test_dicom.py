"""Writes tests/data/dicom: one made volume of 16 × 12 × 3 voxels as enhanced multi-frame CT in each compression.

Needs pydicom 3.0.2 and imagecodecs 2026.3.6.
"""

from pathlib import Path

import imagecodecs
import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import (
    UID,
    DeflatedExplicitVRLittleEndian,
    EnhancedCTImageStorage,
    JPEG2000Lossless,
    JPEGBaseline8Bit,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
)

FOLDER = Path(__file__).parent.parent / "tests/data/dicom"
ROOT = "1.2.826.0.1.3680043.10.999.8"
HTJ2K_LOSSLESS = UID("1.2.840.10008.1.2.4.201")


def frame(z, depth):
    y, x = np.mgrid[0:12, 0:16]
    if depth == 8:
        return (40 + 8 * x + 5 * y + 10 * z).astype("u1")
    return ((x * 37 + y * 101 + z * 53 + (x * y) % 17 * 11) % 4096).astype("<u2")


def item(**values):
    dataset = Dataset()
    for name, value in values.items():
        setattr(dataset, name, value)
    return dataset


def image(syntax, depth):
    dataset = Dataset()
    meta = FileMetaDataset()
    meta.TransferSyntaxUID = syntax
    meta.MediaStorageSOPClassUID = EnhancedCTImageStorage
    meta.MediaStorageSOPInstanceUID = f"{ROOT}.1"
    dataset.file_meta = meta
    dataset.SOPClassUID = EnhancedCTImageStorage
    dataset.SOPInstanceUID = f"{ROOT}.1"
    dataset.StudyInstanceUID = f"{ROOT}.2"
    dataset.SeriesInstanceUID = f"{ROOT}.3"
    dataset.Modality = "CT"
    dataset.PatientName = "made"
    dataset.SeriesDescription = "made"
    dataset.InstanceNumber = 1
    dataset.NumberOfFrames = 3
    dataset.Rows, dataset.Columns = 12, 16
    dataset.SamplesPerPixel = 1
    dataset.PhotometricInterpretation = "MONOCHROME2"
    dataset.BitsAllocated = depth
    dataset.BitsStored = 8 if depth == 8 else 12
    dataset.HighBit = dataset.BitsStored - 1
    dataset.PixelRepresentation = 0
    orientation = item(ImageOrientationPatient=[0, 1, 0, 0, 0, -1])
    measures = item(PixelSpacing=[0.5, 0.75], SliceThickness=2)
    scale = item(RescaleIntercept=-1000, RescaleSlope=2, RescaleType="HU")
    shared = item(
        PlaneOrientationSequence=Sequence([orientation]),
        PixelMeasuresSequence=Sequence([measures]),
        PixelValueTransformationSequence=Sequence([scale]),
    )
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    # The normal is −x: the first frame is the last slice.
    positions = [item(ImagePositionPatient=[-10 + 1.5 * z, 20, 30]) for z in range(3)]
    dataset.PerFrameFunctionalGroupsSequence = Sequence(
        [item(PlanePositionSequence=Sequence([position])) for position in positions]
    )
    return dataset


def write(name, syntax, encode=None, depth=16):
    dataset = image(syntax, depth)
    frames = [frame(z, depth) for z in range(3)]
    if encode is None:
        dataset.PixelData = b"".join(one.tobytes() for one in frames)
    else:
        dataset.PixelData = encapsulate([encode(one) for one in frames])
    dataset["PixelData"].VR = "OB" if encode or depth == 8 else "OW"
    dataset.save_as(FOLDER / name, enforce_file_format=True)


def rle(one):
    from pydicom.pixels.encoders.native import _encode_frame
    from pydicom.pixels.encoders.base import EncodeRunner

    runner = EncodeRunner(RLELossless)
    runner.set_options(rows=12, columns=16, samples_per_pixel=1, bits_allocated=16, bits_stored=12,
                       photometric_interpretation="MONOCHROME2", pixel_representation=0, number_of_frames=1)
    return _encode_frame(one.tobytes(), runner)


FOLDER.mkdir(exist_ok=True)
write("plain.dcm", UID("1.2.840.10008.1.2.1"))
write("deflated.dcm", DeflatedExplicitVRLittleEndian)
write("rle.dcm", RLELossless, rle)
write("jpeg.dcm", JPEGBaseline8Bit, lambda one: imagecodecs.jpeg8_encode(one, level=100), depth=8)
write("jpeg-lossless.dcm", JPEGLosslessSV1, lambda one: imagecodecs.ljpeg_encode(one, bitspersample=12))
write("jpeg-ls.dcm", JPEGLSLossless, imagecodecs.jpegls_encode)
write("jpeg-2000.dcm", JPEG2000Lossless, lambda one: imagecodecs.jpeg2k_encode(one, codecformat="j2k", reversible=True, level=0))
write("htj2k.dcm", HTJ2K_LOSSLESS, lambda one: imagecodecs.htj2k_encode(one, reversible=True))
