import { text } from '../../texts';
import type { ContentOf, Session } from './schema';

/** Returns the content of a session that is opened in the lab `lab`, which is that of the session. */
export function contentOf<Lab extends Session['lab']>(session: Session, lab: Lab): ContentOf<Lab> {
  if (session.lab !== lab) throw new Error(text('sessions.otherLab', { lab: session.lab }));
  return session.content as unknown as ContentOf<Lab>;
}
