// Requests between a page and a worker of one's own, as by the documentation of `vesicle/channel`.
import { readFileSync } from 'node:fs';
import { Worker as NodeWorker } from 'node:worker_threads';
import { afterEach, expect, test } from 'vitest';
import { Channel, type ChannelOptions, VesicleCrash, VesicleError } from '../../pkg/channel.js';

interface Requests {
  double: { body: Float32Array; reply: Float32Array };
  count: { body: number; reply: string; report: number };
  echo: { body: unknown; reply: unknown };
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
      bare: () => Object.create(null),
      odd: () => Object.assign(new Error('odd'), { message: () => 1, name: Symbol('odd') }),
      nested: () => new VesicleCrash('unreachable', { cause: new Error('a', { cause: () => 1 }) }),
      own: () => Object.assign(new Error('of another copy'), { name: 'VesicleError', code: 'precision' }),
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
        echo: (value) => value,
        fail: (which) => {
          throw errors[which]();
        },
        unsendable: () => () => 1,
        // Comes to an end although it is aborted.
        wait: (_, { signal }) => new Promise((resolve) => signal.addEventListener('abort', () => resolve('all the same'))),
      },
      (message) => send({ ...message, event: message.shout?.toUpperCase() }),
    );
    send({ event: 'ready' });
  });`;

interface Shout {
  shout: string;
  [more: string]: unknown;
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
  await expect(channel.request('fail', 'type')).rejects.toBeInstanceOf(TypeError);
  await expect(channel.request('fail', 'own')).rejects.toMatchObject({ code: 'precision', message: 'of another copy' });
  await expect(channel.request('fail', 'text')).rejects.toThrow('only words');
  await expect(channel.request('fail', 'bare')).rejects.toThrow('cannot be sent');
  await expect(channel.request('fail', 'odd')).rejects.toThrow('cannot be sent');
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
  await expect(open().request('fail', 'nested')).rejects.toMatchObject({ code: 'crash', cause: 'Error: a' });
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

test('keys of bodies, messages and events are never taken for those of the channel', async () => {
  const like = { id: 1, kind: 'echo', value: 2, report: 3, failure: 4, abort: 1, message: 5 };
  const events: object[] = [];
  let channel: Channel<Requests, { event: string }, Shout> | undefined;
  const heard = new Promise<void>((resolve) => {
    channel = open({ onEvent: (event) => events.push(event) === 2 && resolve() });
  });
  const pending = channel?.request('echo', like);
  channel?.post({ ...like, shout: 'a' });
  expect(await pending).toEqual(like);
  await heard;
  expect(events).toEqual([{ event: 'ready' }, { ...like, shout: 'a', event: 'A' }]);
});

test('a request whose reply cannot be converted rejects', async () => {
  const receive = () => {
    throw new Error('not that');
  };
  await expect(open().request('echo', 1, { receive })).rejects.toThrow('not that');
});

test('events are in order from the first on', async () => {
  const script = `import(${JSON.stringify(library)}).then(async ({ send }) => {
    for (let k = 0; k < 50; k++) { send({ event: String(k) }); await null; }
  });`;
  const events: string[] = [];
  await new Promise<void>((resolve) => {
    open({ onEvent: ({ event }) => events.push(event) === 50 && resolve() }, script);
  });
  expect(events).toEqual(Array.from({ length: 50 }, (_, k) => String(k)));
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
  expect((await ended(late)).message).toBe('the worker ended: exited with code 3');
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
