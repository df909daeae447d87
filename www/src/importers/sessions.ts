/** Recognises sessions, without what reads them. */

/** Name of the file in a session that describes it. */
export const INDEX = 'session.json';
/** Ending of the names of sessions. */
export const ENDING = '.vesicle.zip';

/** Returns whether a file is a session by its name. */
export const isNamedSession = (file: File) => file.name.toLowerCase().endsWith(ENDING);

/** Returns whether a file is a session, by its name or by the first entry of the ZIP that it is. */
export async function isSession(file: File): Promise<boolean> {
  if (isNamedSession(file)) return true;
  // The name of the first entry is after 30 bytes of a header, which begins with PK.
  const [head, name] = await Promise.all([file.slice(0, 2).text(), file.slice(30, 30 + INDEX.length).text()]);
  return head === 'PK' && name === INDEX;
}
