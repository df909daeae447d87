/** Messages of the worker that reads sessions: first that it listens, since its texts may have to be fetched. */
import type { Session } from './check';

export type Reply = 'ready' | { session: Session } | { message: string };
