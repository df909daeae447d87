/** Tells pages of the app apart, and which of them are open. */

const PREFIX = 'vesicle.page.';

/** Returns a name that nothing else has; pages without https, but for those of this computer, have no `randomUUID`. */
export const newName = (): string => crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}`;

/** The name of this page. */
export const PAGE = newName();

/** Has other pages see, as long as this one is open, that it is: the browser releases its lock with it. */
export function announcePage(): void {
  void navigator.locks?.request(PREFIX + PAGE, () => new Promise(() => undefined));
}

/** Returns the names of the pages that are open, this one among them. */
export async function openPages(): Promise<Set<string>> {
  const { held = [] } = (await navigator.locks?.query()) ?? {};
  const names = held.flatMap(({ name = '' }) => (name.startsWith(PREFIX) ? [name.slice(PREFIX.length)] : []));
  return new Set([PAGE, ...names]);
}
