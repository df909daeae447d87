/** Reads the series that a DICOM file belongs to from its first bytes, without the library that reads its image. */

/** Number of bytes before the first data element: a preamble, and the letters DICM. */
const START = 132;
/** Value representations with lengths of four bytes. */
const LONG = /^(O[BDFLVW]|S[QV]|U[CNRTV])$/;
/** Length of a sequence that ends with a delimiter. */
const UNDEFINED = 0xffffffff;

const SERIES_DESCRIPTION = 0x0008103e;
const SERIES_UID = 0x0020000e;
const ITEM = 0xfffee000;
const SEQUENCE_END = 0xfffee0dd;

/** A series of DICOM files: its unique identifier, and its description, which may be empty. */
export interface Series {
  uid: string;
  description: string;
}

interface Element {
  tag: number;
  /** Number of bytes before the value. */
  header: number;
  length: number;
}

/**
 * Returns the series of the DICOM file that begins with `bytes`; the identifier is empty if it is not among them, or the
 * file is compressed as a whole or big-endian.
 */
export function seriesOf(bytes: Uint8Array): Series {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const series: Series = { uid: '', description: '' };
  // Elements of sequences have the same tags, but describe other series.
  let depth = 0;
  let at = START;
  while (at + 12 <= bytes.length) {
    const { tag, header, length } = elementAt(view, at);
    const value = () =>
      new TextDecoder().decode(bytes.subarray(at + header, at + header + length)).replace(/[\0 ]+$/, '');
    if (depth === 0 && tag === SERIES_DESCRIPTION) series.description = value();
    if (depth === 0 && tag === SERIES_UID) series.uid = value();
    // Elements are in the order of their tags.
    if (depth === 0 && tag >= SERIES_UID) break;
    const isOpen = length === UNDEFINED;
    if (isOpen && tag !== ITEM) depth += 1;
    else if (tag === SEQUENCE_END) depth -= 1;
    at += header + (isOpen ? 0 : length);
  }
  return series;
}

/** Returns the little-endian data element at an offset, with its value representation or without. */
function elementAt(view: DataView, at: number): Element {
  const tag = view.getUint16(at, true) * 0x10000 + view.getUint16(at + 2, true);
  const representation = String.fromCharCode(view.getUint8(at + 4), view.getUint8(at + 5));
  if (!/^[A-Z]{2}$/.test(representation)) return { tag, header: 8, length: view.getUint32(at + 4, true) };
  return LONG.test(representation)
    ? { tag, header: 12, length: view.getUint32(at + 8, true) }
    : { tag, header: 8, length: view.getUint16(at + 6, true) };
}
