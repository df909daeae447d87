// The segments of DICOM segmentations (PS3.3, C.8.20.2 and C.8.20.4).
import type { DataSet } from 'dicom-parser';
import { shortened } from '../short-text.js';
import { integerOf, textOf } from './elements.js';
import type { Segment } from './types.js';

/** Classes of segmentations: with one frame for each segment and slice, and with the label of each voxel. */
export const SEGMENTATION = '1.2.840.10008.5.1.4.1.1.66.4';
export const LABEL_MAP = '1.2.840.10008.5.1.4.1.1.66.7';

/** Returns the segments that a file describes, the first of each number; none if it is no segmentation. */
export function segmentsOf(data: DataSet): Segment[] {
  const segments = new Map<number, Segment>();
  for (const segment of describedIn(data)) if (!segments.has(segment.value)) segments.set(segment.value, segment);
  return [...segments.values()];
}

function describedIn(data: DataSet): Segment[] {
  const items = data.elements.x00620002?.items ?? [];
  return items.flatMap(({ dataSet }) => {
    const value = integerOf(dataSet, 'x00620004');
    // The background of a label map is described like a segment.
    if (!dataSet || value === undefined || value === 0) return [];
    const name = shortened(textOf(dataSet, 'x00620005', data) || textOf(dataSet, 'x00620006', data));
    const color = colorOf(dataSet);
    return [{ value, ...(name && { name }), ...(color && { color }) }];
  });
}

/** Returns the stored value that stands for a whole voxel; 0 for segmentations that have no fractions. */
export function wholeFractionOf(data: DataSet): number {
  return textOf(data, 'x00620001') === 'FRACTIONAL' ? (integerOf(data, 'x0062000e') ?? 255) : 0;
}

/**
 * Returns the recommended colour, which is in CIELab (PS3.3, C.10.7.1.1). The white point is D65 as in DCMTK, dcmqi and
 * dcmjs, which write nearly all of these files, where the standard has D50: colours differ by 3 of 255.
 */
function colorOf(data: DataSet): string | undefined {
  const [l, a, b] = [0, 1, 2].map((k) => integerOf(data, 'x0062000d', k));
  if (l === undefined || a === undefined || b === undefined) return undefined;
  return rgbOf((l / 65535) * 100, (a / 65535) * 255 - 128, (b / 65535) * 255 - 128);
}

/** Returns a colour of CIELab (D65) as `#rrggbb` of sRGB, by the formulas of CIE and IEC 61966-2-1. */
function rgbOf(l: number, a: number, b: number): string {
  const f = (l + 16) / 116;
  const inverse = (t: number) => (t > 6 / 29 ? t ** 3 : 3 * (6 / 29) ** 2 * (t - 4 / 29));
  const [x, y, z] = [0.95047 * inverse(f + a / 500), inverse(f), 1.08883 * inverse(f - b / 200)];
  const linear = [
    3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
    -0.969266 * x + 1.8760108 * y + 0.041556 * z,
    0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
  ];
  const bytes = linear.map((value) => {
    const v = Math.min(Math.max(value, 0), 1);
    return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
  });
  return `#${bytes.map((byte) => byte.toString(16).padStart(2, '0')).join('')}`;
}
