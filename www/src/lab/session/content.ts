import { text } from '../../texts';
import type { LabId } from '../address';
import type { Session } from './check';

/** Returns the content of a session that is opened in the lab `lab`, which is that of the session. */
export function contentOf<Content extends Session['content']>(session: Session, lab: LabId): Content {
  if (session.lab !== lab) throw new Error(text('sessions.otherLab', { lab: session.lab }));
  return session.content as Content;
}
