import { text } from '../../texts';

/** Names of this computer that the policy of the worker permits; a policy cannot name an IPv6 address. */
const LOOPBACK = ['localhost', '127.0.0.1'];

/**
 * Returns why an image cannot be read from an address, or undefined if it can. The policy of the Extract lab's worker
 * (`scripts/policy`) permits the same servers.
 */
export function addressProblem(
  address: string,
  page: Pick<Location, 'href' | 'origin'> = location,
): string | undefined {
  const url = parsed(address, page.href);
  if (!url) return text('extractPanels.largeNoAddress');
  const { protocol, username, password, host, hostname } = url;
  if (!/^https?:$/.test(protocol)) return text('extractPanels.largeScheme', { scheme: protocol });
  if (username || password) return text('extractPanels.largeCredentials');
  const isSafe = protocol === 'https:' || url.origin === page.origin || LOOPBACK.includes(hostname);
  return isSafe ? undefined : text('extractPanels.largeUnencrypted', { host });
}

function parsed(address: string, base: string): URL | undefined {
  try {
    return new URL(address, base);
  } catch {
    return undefined;
  }
}
