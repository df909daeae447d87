// A worker begins when the one before has ended, so that their memory is not taken at the same time.
import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import { EngineChannel } from '../../www/src/engine/channel';

type Requests = { open: { body: string; reply: string }; wait: { body: undefined; reply: undefined } };
interface Request {
  id: number;
  kind: string;
  body: string;
}

/** Locks of the page, each held until its worker is said to have ended. */
const held = new Map<string, () => void>();
const workers: FakeWorker[] = [];

/** A worker that answers at once, and holds its lock also when it is terminated. */
class FakeWorker {
  readonly #listeners: Record<string, (event: object) => void> = {};
  readonly kinds: string[] = [];
  isTerminated = false;
  #ended: () => void = () => undefined;

  constructor() {
    workers.push(this);
  }

  addEventListener(type: string, listener: (event: object) => void): void {
    this.#listeners[type] = listener;
  }

  /** Ends as by an error that nothing catches. */
  fail(message: string): void {
    this.#listeners.error?.({ message, preventDefault: () => undefined });
  }

  postMessage(sent: Request | { message: { kind: 'hold'; lock: string } }): void {
    if ('message' in sent) {
      const { kind, lock } = sent.message;
      this.kinds.push(kind);
      held.set(lock, () => undefined);
      this.#ended = () => held.get(lock)?.();
      return;
    }
    const { id, kind, body } = sent;
    this.kinds.push(kind);
    if (kind === 'open') queueMicrotask(() => this.#listeners.message?.({ data: { id, value: body } }));
  }

  terminate(): void {
    this.isTerminated = true;
  }

  end(): void {
    this.#ended();
  }
}

const open = () =>
  new EngineChannel<Requests, never>(
    () => new FakeWorker() as unknown as Worker,
    () => undefined,
  );
const CANCELLED = { code: 'internal', message: 'cancelled' };

beforeEach(() => {
  workers.length = 0;
  const request = (name: string) => new Promise<void>((resolve) => held.set(name, resolve));
  vi.stubGlobal('navigator', { locks: { request } });
});
afterEach(() => vi.unstubAllGlobals());

test('after a restart, requests wait until the worker before has ended', async () => {
  const channel = open();
  expect(await channel.request('open', 'a')).toBe('a');
  channel.restart(CANCELLED);
  const answer = channel.request('open', 'b');
  await new Promise(setImmediate);
  expect(workers.map(({ isTerminated }) => isTerminated)).toEqual([true]);
  workers[0]?.end();
  expect(await answer).toBe('b');
  expect(workers.map(({ kinds }) => kinds)).toEqual([
    ['hold', 'open'],
    ['hold', 'open'],
  ]);
});

test('one that is restarted again while it waits has one worker, and what was asked before is refused', async () => {
  const channel = open();
  channel.restart(CANCELLED);
  const refused = expect(channel.request('open', 'a')).rejects.toThrow('cancelled');
  channel.restart(CANCELLED);
  const answer = channel.request('open', 'b');
  workers[0]?.end();
  expect(await answer).toBe('b');
  await refused;
  expect(workers.map(({ kinds }) => kinds)).toEqual([['hold'], ['hold', 'open']]);
});

test('one that is closed while it waits starts none', async () => {
  const channel = open();
  channel.restart(CANCELLED);
  channel.close();
  workers[0]?.end();
  await new Promise(setImmediate);
  expect(workers).toHaveLength(1);
});

test('without locks nothing is waited for', async () => {
  vi.stubGlobal('navigator', {});
  const channel = open();
  channel.restart(CANCELLED);
  expect(await channel.request('open', 'a')).toBe('a');
});

test('requests of a broken worker fail, also where the channel is closed when that is said', async () => {
  const said: object[] = [];
  const channel: EngineChannel<Requests, never> = new EngineChannel<Requests, never>(
    () => new FakeWorker() as unknown as Worker,
    (event) => {
      said.push(event);
      channel.close();
    },
  );
  await channel.request('open', 'a');
  const waiting = channel.request('wait', undefined);
  workers[0]?.fail('no memory');
  await expect(waiting).rejects.toMatchObject({ code: 'internal', message: 'no memory' });
  expect(said).toEqual([{ event: 'failure', failure: { code: 'internal', message: 'no memory' } }]);
});

test('requests of a lab that is closed are never settled', async () => {
  const channel = open();
  const settled = vi.fn();
  channel.request('wait', undefined).then(settled, settled);
  channel.close();
  await new Promise(setImmediate);
  expect(settled).not.toHaveBeenCalled();
});
