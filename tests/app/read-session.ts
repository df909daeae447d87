import { SCHEMAS } from '../../www/src/app/session/schemas';
import type { Session } from '../../www/src/lab/session/check';
import { readSession as read } from '../../www/src/lab/session/file';
import type { ExtractContent } from '../../www/src/labs/extract/schema';
import type { ReconstructContent } from '../../www/src/labs/reconstruct/schema';
import type { SculptContent } from '../../www/src/labs/sculpt/schema';
import type { SegmentContent } from '../../www/src/labs/segment/schema';
import type { TrackContent } from '../../www/src/labs/track/schema';

/** The content of sessions, by lab. */
export interface Contents {
  extract: ExtractContent;
  reconstruct: ReconstructContent;
  sculpt: SculptContent;
  segment: SegmentContent;
  track: TrackContent;
}

/** A session of any lab, with its content. */
export type AnySession = {
  [Lab in keyof Contents]: Omit<Session, 'lab' | 'content'> & { lab: Lab; content: Contents[Lab] };
}[keyof Contents];

/** Reads a session of any lab, as the app does. */
export async function readSession(bytes: Uint8Array, unpacking?: Parameters<typeof read>[2]): Promise<AnySession> {
  return (await read(bytes, SCHEMAS, unpacking)) as AnySession;
}
