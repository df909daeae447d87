/** Requests to the worker that reads sessions. It first sends an event, since its texts may have to be fetched. */
import type { Session } from './check';

export interface Requests {
  read: { body: Uint8Array; reply: Session };
}
