/** The page's address, which says what is open in which lab. */

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
