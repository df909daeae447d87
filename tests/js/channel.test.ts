// Requests between a page and a worker of one's own, as by the documentation of `vesicle/channel`.
import { readFileSync } from 'node:fs';
import { Worker as NodeWorker } from 'node:worker_threads';
import { afterEach, expect, test } from 'vitest';
import { Channel, type ChannelOptions, VesicleCrash, VesicleError } from '../../pkg/channel.js';

interface Requests {
  double: { body: Float32Array; reply: Float32Array };
  count: { body: number; reply: string; report: number };
  fail: { body: string; reply: never };
  unsendable: { body: undefined; reply: unknown };
  wait: { body: undefined; reply: string };
}

const library = new URL('../../pkg/channel.js', import.meta.url).href;
const SCRIPT = `
  import(${JSON.stringify(library)}).then(({ send, serve, VesicleCrash, VesicleError, withTransfer }) => {
    const errors = {
      known: () => new VesicleError('bad-file', 'NRRD: sizes'),
      crash: () => new VesicleCrash('unreachable'),
      type: () => new TypeError('not a function'),
      dom: () => new DOMException('gone', 'NotFoundError'),
      text: () => 'only words',
    };
    serve(
      {
        double: (array) => {
          const doubled = array.map((x) => 2 * x);
          return withTransfer(doubled, [doubled]);
        },
        async count(most, { signal, report }) {
          for (let i = 1; i <= most; i++) {
            signal.throwIfAborted();
            report?.(i);
            await new Promise((resolve) => setTimeout(resolve));
          }
          return report ? 'reported' : 'silent';
        },
        fail: (which) => {
          throw errors[which]();
        },
        unsendable: () => () => 1,
        // Comes to an end although it is aborted.
        wait: (_, { signal }) => new Promise((resolve) => signal.addEventListener('abort', () => resolve('all the same'))),
      },
      ({ shout }) => send({ event: shout.toUpperCase() }),
    );
    send({ event: 'ready' });
  });`;

interface Shout {
  shout: string;
}

const opened: Channel<Requests, { event: string }, Shout>[] = [];

function open(options?: ChannelOptions<{ event: string }>, script = SCRIPT) {
  const channel = new Channel<Requests, { event: string }, Shout>(new NodeWorker(script, { eval: true }), options);
  opened.push(channel);
  return channel;
}

afterEach(() => {
  for (const channel of opened.splice(0)) channel.end(new Error('the test ended'));
});

test('requests have replies; arrays are copied or transferred', async () => {
  const channel = open();
  const array = Float32Array.of(1, 2.5);
  expect(await channel.request('double', array)).toEqual(Float32Array.of(2, 5));
  expect(await channel.request('double', array, { transfer: [array.buffer] })).toEqual(Float32Array.of(2, 5));
  expect(array.length).toBe(0);
});

test('reports come to those who listen, before the reply', async () => {
  const channel = open();
  const reports: number[] = [];
  expect(await channel.request('count', 4, { onReport: (i) => reports.push(i) })).toBe('reported');
  expect(reports).toEqual([1, 2, 3, 4]);
  expect(await channel.request('count', 4)).toBe('silent');
});

test('a signal aborts, also before the request and in a report, which may throw', async () => {
  const channel = open();
  const stop = new AbortController();
  const reports: number[] = [];
  const counted = channel.request('count', 1e6, {
    signal: stop.signal,
    onReport: (i) => {
      reports.push(i);
      stop.abort('enough');
    },
  });
  await expect(counted).rejects.toBe('enough');
  expect(reports).toEqual([1]);
  await expect(channel.request('count', 1, { signal: stop.signal })).rejects.toBe('enough');
  const thrown = new Error('no more');
  const onReport = () => {
    throw thrown;
  };
  await expect(channel.request('count', 1e6, { onReport })).rejects.toBe(thrown);
});

test('an aborted request rejects although it comes to an end, and its reply is received', async () => {
  const channel = open();
  const stop = new AbortController();
  const received: unknown[] = [];
  const waiting = channel.request('wait', undefined, { signal: stop.signal, receive: (reply) => received.push(reply) });
  stop.abort('enough');
  await expect(waiting).rejects.toBe('enough');
  expect(received).toEqual(['all the same']);
});

test('errors keep what they are', async () => {
  const channel = open();
  const known = await channel.request('fail', 'known').catch((error: unknown) => error);
  expect(known).toBeInstanceOf(VesicleError);
  expect(known).toMatchObject({ code: 'bad-file', message: 'NRRD: sizes' });
  await expect(channel.request('fail', 'type')).rejects.toMatchObject({ name: 'TypeError', message: 'not a function' });
  await expect(channel.request('fail', 'dom')).rejects.toMatchObject({ name: 'NotFoundError', message: 'gone' });
  await expect(channel.request('fail', 'text')).rejects.toThrow('only words');
  await expect(channel.request('unsendable', undefined)).rejects.toThrow('could not be cloned');
  const unknown = channel as unknown as Channel<{ other: { body: undefined; reply: undefined } }>;
  for (const kind of ['other', 'constructor', '__proto__'])
    await expect(unknown.request(kind as 'other', undefined)).rejects.toThrow(`${kind}: the worker has no handler`);
  const body = (() => 1) as unknown as Float32Array;
  expect(() => channel.request('double', body)).toThrow('cannot be sent');
  expect(await channel.request('count', 0)).toBe('silent');
});

test('a crash ends the channel, with all that is pending', async () => {
  const ends: Error[] = [];
  const channel = open({ onEnd: (error) => ends.push(error) });
  const pending = channel.request('wait', undefined);
  const crashed = channel.request('fail', 'crash');
  await expect(crashed).rejects.toBeInstanceOf(VesicleCrash);
  await expect(pending).rejects.toThrow('unreachable');
  expect(() => channel.request('count', 1)).toThrow('unreachable');
  expect(ends).toEqual([channel.ended]);
});

test('messages have no reply, and events come of themselves', async () => {
  const events: string[] = [];
  const heard = new Promise<void>((resolve) => {
    const channel = open({
      onEvent: ({ event }) => {
        events.push(event);
        if (event === 'ready') channel.post({ shout: 'hello' });
        else resolve();
      },
    });
  });
  await heard;
  expect(events).toEqual(['ready', 'HELLO']);
});

test('a worker that ends by itself, or does not start, ends the channel', async () => {
  const ended = async (script: string) => {
    let channel: Channel<Requests, { event: string }, Shout> | undefined;
    const error = await new Promise<Error>((onEnd) => {
      channel = open({ onEnd }, script);
      channel.request('wait', undefined).catch(() => undefined);
    });
    expect(() => channel?.request('count', 1)).toThrow(error);
    channel?.post({ shout: 'into the void' });
    return error;
  };
  expect((await ended('throw new Error("no luck")')).message).toContain('could not be started: no luck');
  const late = `${SCRIPT} setTimeout(() => process.exit(3), 200);`;
  const error = await ended(late);
  expect(error).toBeInstanceOf(VesicleCrash);
  expect(error.message).toContain('exited with code 3');
});

test('a channel that its owner ends rejects what is pending with the reason, and says nothing', async () => {
  const ends: Error[] = [];
  const channel = open({ onEnd: (error) => ends.push(error) });
  const pending = channel.request('wait', undefined);
  const reason = new Error('closed');
  channel.end(reason);
  await expect(pending).rejects.toBe(reason);
  expect(channel.ended).toBe(reason);
  expect(ends).toEqual([]);
});

test('the example of the documentation runs', async () => {
  const path = (file: string) => new URL(`../../${file}`, import.meta.url);
  const [, code = ''] = /```js\n([\s\S]*?)```/.exec(readFileSync(path('js/channel.ts'), 'utf8')) ?? [];
  const [host = '', page = ''] = code.replaceAll(/^ \* ?/gm, '').split('// page.js');
  const local = (text: string) =>
    text
      .replaceAll(
        /from '(vesicle[^']*)'/g,
        (_, name) => `from '${path(`pkg/${name.replace(/^vesicle\/?/, '') || 'index'}.js`).href}'`,
      )
      // Node's version may lack `using`.
      .replaceAll(/\busing (\w+)/g, 'const $1');
  const address = (text: string) => `data:text/javascript,${encodeURIComponent(local(text))}`;
  const worker = new NodeWorker(new URL(address(host)));
  const [, use = ''] = page.split(/const channel = [^\n]*\n/);
  const run = new Function(
    'channel',
    'file',
    'signal',
    'console',
    `return (async () => { ${use}; return [positions, indices]; })()`,
  );
  const lines: unknown[][] = [];
  const channel = new Channel<Requests>(worker);
  const file = readFileSync(path('www/public/data/visible-human-head.nii.gz'));
  const [positions, indices] = await run(channel, file, undefined, { log: (...given: unknown[]) => lines.push(given) });
  expect(indices.length % 3).toBe(0);
  expect(positions.length).toBeGreaterThan(1000);
  expect(lines.length).toBeGreaterThan(1);
  channel.end(new Error('done'));
});
