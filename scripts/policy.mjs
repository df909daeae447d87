// Content security policies of the built app: what its pages and workers may load, and from where. The build writes them
// into the pages, the local server sends them, and docs/security.md has them for other servers.

const written = (directives) =>
  Object.entries(directives)
    .map(([name, sources]) => `${name} ${sources}`)
    .join('; ');

/** Policy of the app's pages. */
export const APP_POLICY = written({
  'default-src': "'self'",
  'script-src': "'self' 'wasm-unsafe-eval'",
  'style-src': "'self'",
  // Pictures and photographs come from memory.
  'img-src': "'self' data: blob:",
  'connect-src': "'self'",
  'object-src': "'none'",
  'base-uri': "'none'",
  'form-action': "'none'",
});

/** Policy of workers but one. A worker has the policy that comes with its own script, not that of the page. */
export const WORKER_POLICY = written({
  'default-src': "'none'",
  'script-src': "'self' 'wasm-unsafe-eval'",
  // geotiff's decoder of Zstandard is in its code as data.
  'connect-src': "'self' data:",
});

/** Policy of the worker of the Extract lab, which reads images from servers that the user names. */
export const EXTRACT_WORKER_POLICY = written({
  'default-src': "'none'",
  // numcodecs' decoders of Blosc, LZ4 and Zstandard make functions from strings when they start.
  'script-src': "'self' 'unsafe-eval'",
  'connect-src': "'self' https: http://localhost:* http://127.0.0.1:*",
});

/** Policy of the documentation. */
export const DOCS_POLICY = written({
  'default-src': "'none'",
  'script-src': "'self'",
  // typedoc's script writes the styles of its filters into the page.
  'style-src': "'self' 'unsafe-inline'",
  'img-src': "'self'",
  'base-uri': "'none'",
  'form-action': "'none'",
});

/** Name of the script of the Extract lab's worker, without its hash. */
export const EXTRACT_WORKER = 'extract-worker';

/** Returns the policy of a file by its path within the built app. */
export function policyOf(file) {
  if (file.startsWith('docs/')) return DOCS_POLICY;
  if (file.startsWith(`assets/${EXTRACT_WORKER}-`)) return EXTRACT_WORKER_POLICY;
  return /^assets\/(worker|computeWorker)-|^offline\.js$/.test(file) ? WORKER_POLICY : APP_POLICY;
}
