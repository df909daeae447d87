/** Recognises sessions, without what reads them. */

/** Name of the file in a session that describes it. */
export const INDEX = 'session.json';
const ENDING = '.vesicle.zip';

/** Returns whether a file is a session, by its name or by the first entry of the ZIP that it is. */
export async function isSession(file: File): Promise<boolean> {
  if (file.name.toLowerCase().endsWith(ENDING)) return true;
  // The name of the first entry is after 30 bytes of a header, which begins with PK.
  const [head, name] = await Promise.all([file.slice(0, 2).text(), file.slice(30, 30 + INDEX.length).text()]);
  return head === 'PK' && name === INDEX;
}

export function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

/** Tests whether a value may be the log of a run, or that of a run whose beginning is not known. */
export function isLog(value: unknown): boolean {
  return value === undefined || (isRecord(value) && isRecord(value.setup) && Array.isArray(value.calls));
}

/** Passes the view of a session to `show`. A damaged one is left out: nothing else depends on it. */
export function restoreView(view: unknown, show: (view: Record<string, unknown>) => void): void {
  if (!isRecord(view)) return;
  try {
    show(view);
  } catch {
    // The view stays.
  }
}
