import { h } from './dom';

/** Downloads bytes as a file with the given name and media type. */
export function download(name: string, bytes: Uint8Array, type: string): void {
  const url = URL.createObjectURL(new Blob([bytes as Uint8Array<ArrayBuffer>], { type }));
  const link = h('a', { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  // The browser has read the blob once the click is handled; the delay is a safety margin.
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
