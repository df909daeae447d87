/** Tells formats of other programs by the first bytes of files. */

/** Number of bytes of a file that are tested. */
export const HEAD = 132;

const hasBytes = (bytes: Uint8Array, at: number, expected: number[]) =>
  expected.every((byte, k) => bytes[at + k] === byte);

/** Whether a file is DICOM: by the letters after the preamble, by its ending, or, without either, by its first element. */
export function isDicom(head: Uint8Array, name: string): boolean {
  if (hasBytes(head, 128, [0x44, 0x49, 0x43, 0x4d]) || /\.(dcm|dicom|ima)$/i.test(name)) return true;
  return (
    hasBytes(head, 0, [8, 0]) &&
    head[3] === 0 &&
    (head[2] ?? 0) <= 0x20 &&
    head.length === HEAD &&
    !/\.\w{2,4}$/.test(name)
  );
}

/** Whether a file is a TIFF of either byte order; includes BigTIFF with 64-bit offsets. */
export function isTiff(head: Uint8Array): boolean {
  return [42, 43].some((kind) => hasBytes(head, 0, [0x49, 0x49, kind, 0]) || hasBytes(head, 0, [0x4d, 0x4d, 0, kind]));
}
