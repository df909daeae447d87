/** Worker that reads sessions, so that the page answers meanwhile. */
import { send, serve, withTransfer } from 'vesicle/channel';
import { readSession } from '../../lab/session/file';
import type { Requests } from '../../lab/session/protocol';
import { SCHEMAS } from './schemas';

serve<Requests>({
  async read(bytes) {
    const session = await readSession(bytes, SCHEMAS);
    return withTransfer(session, arraysIn(session));
  },
});
send('ready');

/** Returns all typed arrays in a value. */
function arraysIn(value: unknown): ArrayBufferView[] {
  if (ArrayBuffer.isView(value)) return [value];
  return typeof value === 'object' && value !== null ? Object.values(value).flatMap(arraysIn) : [];
}
