/** Runs the code of a lab's worker in Node, and talks to it as the page does. */

type Reply = { id: number; ok: boolean; body?: unknown; failure?: { code: string; message: string } };
type Table<Requests> = { [K in keyof Requests]: { body: unknown; reply: unknown } };

/**
 * Loads a worker's code, one in a test file, and returns the page's end of the connection. `onEvent` receives what the
 * worker sends by itself.
 */
export async function startWorker<Requests extends Table<Requests>>(
  load: () => Promise<unknown>,
  onEvent: (event: object) => void = () => undefined,
) {
  const pending = new Map<number, (reply: Reply) => void>();
  const scope = {
    onmessage: undefined as ((event: { data: unknown }) => void) | undefined,
    postMessage: (message: object, options: StructuredSerializeOptions) => {
      const data = structuredClone(message, options) as Reply;
      if (!('id' in data)) return onEvent(data);
      pending.get(data.id)?.(data);
      pending.delete(data.id);
    },
  };
  Object.assign(globalThis, { self: scope });
  await load();
  let last = 0;
  return {
    post: (message: object) => scope.onmessage?.({ data: structuredClone(message) }),
    request: async <K extends keyof Requests>(kind: K, body: Requests[K]['body']): Promise<Requests[K]['reply']> => {
      const id = ++last;
      const answer = new Promise<Reply>((resolve) => pending.set(id, resolve));
      scope.onmessage?.({ data: structuredClone({ id, kind, body }) });
      const { ok, body: reply, failure } = await answer;
      if (!ok) throw new Error(failure?.message);
      return reply;
    },
  };
}
