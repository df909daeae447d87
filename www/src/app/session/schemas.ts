import type { LabId } from '../../lab/address';
import type { SessionSchema } from '../../lab/session/check';
import * as extract from '../../labs/extract/schema';
import * as reconstruct from '../../labs/reconstruct/schema';
import * as sculpt from '../../labs/sculpt/schema';
import * as segment from '../../labs/segment/schema';
import * as track from '../../labs/track/schema';

/** The schemas of sessions, by lab. */
export const SCHEMAS: ReadonlyMap<unknown, SessionSchema> = new Map<string, SessionSchema>(
  Object.entries({ extract, reconstruct, sculpt, segment, track } satisfies Record<LabId, SessionSchema>),
);
