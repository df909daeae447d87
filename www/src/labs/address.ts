/** The page's address, which says what is open in which lab. */
import type { StatusLine } from '../ui/status';

export const LAB_IDS = ['extract', 'reconstruct', 'track', 'sculpt'] as const;

/** The lab that an address names. */
export const labOf = (hash: string): string | undefined =>
  LAB_IDS.find((id) => hash === `#${id}` || hash.startsWith(`#${id}?`));

/** Puts what is open into the address. One that names another lab stays: that lab was just asked for, and is about to open. */
export function showAddress(hash: string): void {
  const named = labOf(location.hash);
  if (hash === location.hash || (named && named !== labOf(hash))) return;
  window.history.replaceState(null, '', hash);
}

/** What an address lacks while a file of the user's is open. */
export const FILE_LACKS = 'Your file is not in it: whoever opens it needs the file too.';

/** Takes the address along for others; says so, and what it lacks. */
export async function copyAddress(status: StatusLine, lacks: (string | false)[]): Promise<void> {
  const say = (done: string) => status.say([done, ...lacks].filter(Boolean).join(' '));
  try {
    await navigator.clipboard.writeText(location.href);
    say('Link copied.');
  } catch {
    say('The link is in the address bar.');
  }
}
