/** Unpacks archives in a worker of their own, so that the page answers meanwhile. */
import { ArchiveTooLarge } from '.';
import type { Reply, Request } from './protocol';

/** Does what {@link unpack} does, in a worker; `archive` is transferred to it. */
export async function unpackApart(
  archive: Uint8Array,
  mostBytes: number,
  refusal: string,
): Promise<Record<string, Uint8Array>> {
  const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle archive' });
  try {
    const reply = await new Promise<Reply>((resolve, reject) => {
      worker.onmessage = ({ data }) => resolve(data);
      worker.onerror = ({ message }) => reject(new Error(message));
      worker.postMessage({ archive, mostBytes, refusal } satisfies Request, [archive.buffer]);
    });
    if ('files' in reply) return reply.files;
    throw reply.isTooLarge ? new ArchiveTooLarge(reply.message) : new Error(reply.message);
  } finally {
    worker.terminate();
  }
}
