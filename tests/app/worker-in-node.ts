/** Runs the code of a lab's worker in Node, and talks to it as the page does. */

type Answer = { id: number; value?: unknown; failure?: { message: string } };
type Reply = Answer | { event: object };
type Table<Requests> = { [K in keyof Requests]: { body: unknown; reply: unknown } };

/**
 * Loads a worker's code, one in a test file, and returns the page's end of the connection. `onEvent` receives what the
 * worker sends by itself.
 */
export async function startWorker<Requests extends Table<Requests>>(
  load: () => Promise<unknown>,
  onEvent: (event: object) => void = () => undefined,
) {
  const pending = new Map<number, (reply: Answer) => void>();
  let listener: ((event: { data: unknown }) => void) | undefined;
  const scope = {
    addEventListener: (_: 'message', given: typeof listener) => {
      listener = given;
    },
    postMessage: (message: object, transfer: Transferable[] = []) => {
      const data = structuredClone(message, { transfer }) as Reply;
      if ('event' in data) return onEvent(data.event);
      pending.get(data.id)?.(data);
      pending.delete(data.id);
    },
  };
  Object.assign(globalThis, scope);
  await load();
  let last = 0;
  const send = (message: object) => listener?.({ data: structuredClone(message) });
  return {
    post: (message: object) => send({ message }),
    request: async <K extends keyof Requests>(kind: K, body: Requests[K]['body']): Promise<Requests[K]['reply']> => {
      const id = ++last;
      const answer = new Promise<Answer>((resolve) => pending.set(id, resolve));
      send({ id, kind, body, reports: false });
      const { value, failure } = await answer;
      if (failure) throw new Error(failure.message);
      return value;
    },
  };
}
