/** Worker that unpacks an archive, so that the page answers meanwhile. */
import { ArchiveTooLarge, unpack } from '.';
import type { Reply, Request } from './protocol';

self.onmessage = ({ data: { archive, mostBytes, refusal } }: MessageEvent<Request>) => {
  try {
    const files = unpack(archive, mostBytes, refusal);
    const buffers = new Set(Object.values(files).map(({ buffer }) => buffer as ArrayBuffer));
    self.postMessage({ files } satisfies Reply, { transfer: [...buffers] });
  } catch (error) {
    const message = error instanceof Error ? error.message : String(error);
    self.postMessage({ message, isTooLarge: error instanceof ArchiveTooLarge } satisfies Reply);
  }
};
