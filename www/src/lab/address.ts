/** Reads and writes the page's address; its hash names the open lab and contains its settings. */

import type { Status } from '../kit/status';
import { text } from '../texts';

/** Ids of the labs, as they appear in addresses. */
export const LAB_IDS = ['extract', 'reconstruct', 'track', 'sculpt', 'segment'] as const;

export type LabId = (typeof LAB_IDS)[number];

/** Returns the id of the lab that the hash of an address names, undefined if none. */
export const labOf = (hash: string): string | undefined =>
  LAB_IDS.find((id) => hash === `#${id}` || hash.startsWith(`#${id}?`));

/**
 * Writes the open lab's state, `hash`, into the address, without a new entry in the browser's history. An address that
 * names another lab is kept: the user has just asked for that lab, and it is about to open. An empty one is kept, too,
 * while it means the same: it opens the first lab.
 */
export function showAddress(hash: string): void {
  const named = labOf(location.hash);
  const isSame = hash === location.hash || (!location.hash && hash === `#${LAB_IDS[0]}`);
  if (isSame || (named && named !== labOf(hash))) return;
  window.history.replaceState(null, '', hash);
}

/** Message when a link is copied while one of the user's own files is open: the link does not contain the file. */
export const FILE_NOTE = text('labs.linkLacksFile');

/**
 * Copies the page's address to the clipboard, and reports it in the status line, followed by `notes` on what the link
 * lacks (false: none); if the clipboard is not available, refers to the address bar.
 */
export async function copyAddress(status: Status, notes: (string | false)[]): Promise<void> {
  const say = (done: string) => status.say([done, ...notes].filter(Boolean).join(' '));
  try {
    await navigator.clipboard.writeText(location.href);
    say(text('labs.linkCopied'));
  } catch {
    say(text('labs.linkInAddressBar'));
  }
}
