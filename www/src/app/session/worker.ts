/** Worker that reads a session, so that the page answers meanwhile. */
import { readSession } from '../../lab/session/file';
import type { Reply } from '../../lab/session/protocol';
import { SCHEMAS } from './schemas';

self.onmessage = async ({ data }: MessageEvent<Uint8Array>) => {
  try {
    const session = await readSession(data, SCHEMAS);
    self.postMessage({ session } satisfies Reply, { transfer: [...buffersIn(session)] });
  } catch (error) {
    const message = error instanceof Error ? error.message : String(error);
    self.postMessage({ message } satisfies Reply);
  }
};
self.postMessage('ready' satisfies Reply);

/** Returns the buffers of all typed arrays in a value, each of which has its own. */
function buffersIn(value: unknown, found = new Set<Transferable>()): Set<Transferable> {
  if (ArrayBuffer.isView(value)) found.add(value.buffer as ArrayBuffer);
  else if (typeof value === 'object' && value !== null) for (const one of Object.values(value)) buffersIn(one, found);
  return found;
}
