/** Opening data in a lab: what is open after something could be opened in part only. */
import { expect, test } from 'vitest';
import { RequestError } from '../../www/src/engine/failure';
import { type LabData, Opening, type Source } from '../../www/src/lab/opening';
import type { Session } from '../../www/src/lab/session/check';
import { LabStates } from '../../www/src/lab/states';

type Example = { id: string };
type Linked = { example?: string };
type AnySource = Source<Example, Linked, string>;

/** The page of a lab: its content, and the message in its banner. */
class Page {
  shown = '';
  message = '';
  restarts = 0;
  readonly banner = {
    show: (title: string, message = '') => {
      this.message = `${title} ${message}`;
    },
    hide: () => {
      this.message = '';
    },
  };
  readonly states = new LabStates(
    this.banner as never,
    { say: () => undefined } as never,
    new AbortController().signal,
  );
}

/** Data that are their own names; the lab fails in the middle of showing those with an error in `faults`. */
class Names implements LabData<Example, Linked, string, string> {
  readonly first = { id: 'first' };
  readonly faults = new Map<string, Error>();
  /** Why data, by their names, are not loaded. */
  readonly unread = new Map<string, Error>();
  /** Voxels of all data. */
  voxels = 0;
  readonly #page: Page;

  constructor(page: Page) {
    this.#page = page;
  }

  find = (id: string) => ({ id });
  linkedBy = () => undefined;
  fromExample = (example: Example) => ({ name: example.id, load: async () => example.id, example });
  fromFiles = ([file]: File[]) => {
    const name = file?.name ?? '';
    const load = () => (name === 'slow' ? new Promise<string>(() => undefined) : Promise.resolve(name));
    return { name, load, isKept: name !== 'not kept' };
  };
  load = async (_: AnySource, data: string) => {
    const fault = this.unread.get(data);
    if (fault) throw fault;
    return data;
  };
  voxelsOf = () => this.voxels;
  async adopt(opened: string, source: AnySource): Promise<void> {
    this.#page.states.ready = true;
    this.#page.shown = `half ${opened}`;
    const fault = source.session && this.faults.get(source.session.source.name);
    if (fault) throw fault;
    this.#page.shown = opened;
    this.#page.states.idle('');
  }
}

/** A lab whose data are names. */
function nameLab(page: Page) {
  const engine = {
    restart: () => {
      page.restarts += 1;
    },
    request: async () => ({ specs: [] }),
  };
  const ui = { makeParams: () => undefined, banner: page.banner, status: { say: () => undefined } };
  const data = new Names(page);
  return {
    data,
    opening: new Opening(engine, { ...ui, data: { choose: () => undefined } } as never, page.states, data),
  };
}

const named = (name: string, example: string) => ({ source: { name, example, files: [] } }) as unknown as Session;
const files = [new File([], 'mine')];

test.each([
  ['the page', new TypeError('no such view'), 0],
  ['the engine', new RequestError({ code: 'internal', message: 'out of memory' }), 1],
])(
  'after a session that %s cannot show, what was open before is open, and other files open',
  async (_, fault, restarts) => {
    const page = new Page();
    const { opening, data } = nameLab(page);
    data.faults.set('bad', fault);
    await opening.files(files);
    await opening.session(named('bad', 'other'), []);
    expect(page).toMatchObject({
      shown: 'mine',
      message: `The session with bad could not be opened. ${fault.message}`,
      restarts,
    });
    expect(opening.source?.name).toBe('mine');
    expect(page.states.value).toBe('paused');
    await opening.session(named('good', 'other'), []);
    expect(page).toMatchObject({ shown: 'other', message: '' });
    await opening.session(named('bad', 'third'), []);
    expect(page.shown).toBe('other');
  },
);

test('after a session that cannot be shown in a lab with nothing open, the first example opens', async () => {
  const page = new Page();
  const { opening, data } = nameLab(page);
  data.faults.set('bad', new Error('no'));
  await opening.session(named('bad', 'other'), []);
  expect(page.shown).toBe('first');
  expect(page.message).toContain('The session with bad could not be opened');
});

test('the first data can be cancelled from the beginning, unless there is nothing else to open', async () => {
  const page = new Page();
  const offers: boolean[] = [];
  page.states.subscribeCancellable((isCancellable) => offers.push(isCancellable));
  const { opening } = nameLab(page);
  const first = opening.default();
  expect(offers).toEqual([false]);
  void opening.files([new File([], 'slow')]);
  expect(offers).toEqual([false, true]);
  await opening.cancel();
  await first;
  expect(page).toMatchObject({ shown: 'first', restarts: 1 });
  expect(offers).toEqual([false, true, false]);
});

test('what is open gives back its memory before other data are read, and is opened again if they cannot be', async () => {
  const page = new Page();
  const { opening, data } = nameLab(page);
  data.unread.set('bad', new RequestError({ code: 'bad-file', message: 'no image' }));
  data.voxels = 2 ** 25;
  await opening.files(files);
  expect(page.restarts).toBe(0);
  await opening.files([new File([], 'other')]);
  expect(page).toMatchObject({ shown: 'other', restarts: 1 });
  await opening.files([new File([], 'bad')]);
  expect(page).toMatchObject({ shown: 'other', message: 'bad could not be opened. no image' });
  expect(page.states.value).toBe('paused');
});

test.each([
  ['light data', 'mine', 2 ** 20],
  ['data that are not kept, and may be gone', 'not kept', 2 ** 25],
])('%s stay in the engine until others are open', async (_, name, voxels) => {
  const page = new Page();
  const { opening, data } = nameLab(page);
  data.voxels = voxels;
  await opening.files([new File([], name)]);
  await opening.files([new File([], 'other')]);
  expect(page).toMatchObject({ shown: 'other', restarts: 0 });
});
