/** Reads sessions in a worker of their own, so that the page answers meanwhile. */
import { LANGUAGE } from '../../texts';
import type { Session } from './check';
import type { Reply } from './protocol';

/**
 * Does what `readSession` does, in a worker that `spawn` starts; `bytes` are transferred to it. Its name is the language of its
 * messages.
 */
export async function readApart(bytes: Uint8Array, spawn: (name: string) => Worker): Promise<Session> {
  const worker = spawn(LANGUAGE);
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
