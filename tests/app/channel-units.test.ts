// A worker begins when the one before has ended, so that their memory is not taken at the same time.
import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import { EngineChannel } from '../../www/src/engine/channel';

type Requests = { open: { body: string; reply: string } };
interface Message {
  id: number;
  kind: string;
  body: string;
  lock: string;
}

/** Locks of the page, each held until its worker is said to have ended. */
const held = new Map<string, () => void>();
const workers: FakeWorker[] = [];

/** A worker that answers at once, and holds its lock also when it is terminated. */
class FakeWorker {
  #listener: ((event: { data: unknown }) => void) | undefined;
  readonly kinds: string[] = [];
  isTerminated = false;
  #ended: () => void = () => undefined;

  constructor() {
    workers.push(this);
  }

  addEventListener(type: string, listener: (event: { data: unknown }) => void): void {
    if (type === 'message') this.#listener = listener;
  }

  postMessage({ id, kind, body, lock }: Message): void {
    this.kinds.push(kind);
    if (kind === 'hold') held.set(lock, () => undefined);
    if (kind === 'hold') this.#ended = () => held.get(lock)?.();
    else queueMicrotask(() => this.#listener?.({ data: { id, value: body } }));
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
