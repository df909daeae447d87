/** Recognises sessions, without what reads them. */
import { text } from '../texts';
import type { ContentOf, Session } from './schema';

/** Name of the file in a session that describes it. */
export const INDEX = 'session.json';
const ENDING = '.vesicle.zip';

/** Returns whether a file is a session by its name. */
export const isNamedSession = (file: File) => file.name.toLowerCase().endsWith(ENDING);

/** Returns whether a file is a session, by its name or by the first entry of the ZIP that it is. */
export async function isSession(file: File): Promise<boolean> {
  if (isNamedSession(file)) return true;
  // The name of the first entry is after 30 bytes of a header, which begins with PK.
  const [head, name] = await Promise.all([file.slice(0, 2).text(), file.slice(30, 30 + INDEX.length).text()]);
  return head === 'PK' && name === INDEX;
}

/** Returns the content of a session that is opened in the lab `lab`, which is that of the session. */
export function contentOf<Lab extends Session['lab']>(session: Session, lab: Lab): ContentOf<Lab> {
  if (session.lab !== lab) throw new Error(text('sessions.otherLab', { lab: session.lab }));
  return session.content as unknown as ContentOf<Lab>;
}
