/** Reads sessions in a worker of their own, so that the page answers meanwhile. */
import { Channel } from 'vesicle/channel';
import { LANGUAGE } from '../../texts';
import type { Session } from './check';
import type { Requests } from './protocol';

/**
 * Does what `readSession` does, in a worker that `spawn` starts; `bytes` are transferred to it. Its name is the language of its
 * messages.
 */
export async function readApart(bytes: Uint8Array, spawn: (name: string) => Worker): Promise<Session> {
  const channel = await new Promise<Channel<Requests, 'ready'>>((resolve, reject) => {
    const opened = new Channel<Requests, 'ready'>(spawn(LANGUAGE), { onEvent: () => resolve(opened), onEnd: reject });
  });
  try {
    return await channel.request('read', bytes, { transfer: [bytes.buffer] });
  } finally {
    channel.end(new Error('the session was read'));
  }
}
