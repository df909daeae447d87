/** Reads sessions in a worker of their own, so that the page answers meanwhile. */
import { LANGUAGE } from '../../texts';
import type { Reply } from './protocol';
import type { Session } from './schema';

/** Does what `readSession` does, in a worker; `bytes` are transferred to it. */
export async function readApart(bytes: Uint8Array): Promise<Session> {
  // Its name is the language of its messages.
  const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: LANGUAGE });
  try {
    const reply = await new Promise<Exclude<Reply, 'ready'>>((resolve, reject) => {
      worker.onmessage = ({ data }: MessageEvent<Reply>) => {
        if (data === 'ready') worker.postMessage(bytes, [bytes.buffer]);
        else resolve(data);
      };
      worker.onerror = ({ message }) => reject(new Error(message));
    });
    if ('session' in reply) return reply.session;
    throw new Error(reply.message);
  } finally {
    worker.terminate();
  }
}
