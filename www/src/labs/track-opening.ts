import { toFailure } from '../channel';
import { exampleUrl } from '../examples';
import type { TrackClient } from '../track/client';
import { FILMS, type TrackExample } from '../track/examples';
import { filmById } from '../track/presets';
import type { FilmSource, Opened, Setup } from '../track/protocol';
import { readFiles } from '../ui/files';
import { fetched } from './downloads';
import type { LabStates } from './lab-states';
import { fromHash, type LinkedTrack, setupOf } from './track-link';
import type { TrackParts } from './track-parts';

/** What the present image came from, to open it again after a failure of the engine. */
export interface Source {
  name: string;
  opened: () => Promise<FilmSource>;
  example?: TrackExample;
  linked?: LinkedTrack;
}

/** Opens examples, files and links: gets the image and has the worker make a tracker. What is asked for last counts. */
export class Opening {
  readonly #client: TrackClient;
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #adopt: (opened: Opened, setup: Setup, source: Source) => Promise<void>;
  #source: Source | undefined;
  /** A link that waits for its file. */
  #awaiting: LinkedTrack | undefined;
  /** Counts what was asked to be opened. */
  #turn = 0;

  constructor(
    client: TrackClient,
    ui: TrackParts,
    states: LabStates,
    adopt: (opened: Opened, setup: Setup, source: Source) => Promise<void>,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#adopt = adopt;
  }

  /** What is open. */
  get source(): Source | undefined {
    return this.#source;
  }

  /** What is still being opened is not taken any more. */
  close(): void {
    this.#turn += 1;
  }

  example(example: TrackExample, linked?: LinkedTrack): Promise<void> {
    const { name } = example;
    return this.#open({ name, opened: () => fromExample(example), example, ...(linked && { linked }) });
  }

  files(files: File[]): Promise<void> {
    const [first] = files;
    const name = files.length === 1 && first ? first.name : `${first?.name ?? ''} + ${files.length - 1}`;
    const linked = this.#awaiting;
    return this.#open({ name, opened: async () => ({ files: await readFiles(files) }), ...(linked && { linked }) });
  }

  byId(id: string): void {
    const example = filmById(id);
    if (example) void this.example(example);
  }

  /** What is open once more, as it was when it was opened. */
  async again(): Promise<void> {
    if (this.#source) await this.#open(this.#source);
  }

  /** Stops what is being opened or prepared: the worker is in the midst of it, so it is started anew. */
  async cancel(): Promise<void> {
    if (this.#states.value !== 'loading') return;
    this.#turn += 1;
    this.#states.engineBroken = true;
    await this.#open(this.#source ?? { name: FILMS[0].name, opened: () => fromExample(FILMS[0]), example: FILMS[0] });
    this.#ui.status.say('Cancelled.');
  }

  /** Opens what the page's address asks for; says why where that cannot be. `otherwise` is opened then. */
  async link(otherwise?: TrackExample): Promise<void> {
    const linked = fromHash(location.hash);
    const example = filmById(linked?.example ?? (linked && !linked.file ? FILMS[0].id : ''));
    if (linked && example) return this.example(example, linked);
    if (otherwise) await this.example(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#ui.banner.show('This link needs a file.', `Open ${linked.file} from your disk: its settings will follow.`);
    else this.#ui.banner.show('This link cannot be followed.', `There is no example “${linked.example ?? ''}”.`);
  }

  /** Opens an image and tracks. When it fails, everything stays as it was. */
  async #open(source: Source): Promise<void> {
    const turn = ++this.#turn;
    const calm = this.#states.open(`Opening ${source.name}.`);
    try {
      if (this.#states.engineBroken) await this.#restartEngine();
      await calm;
      const film = await source.opened();
      if (turn !== this.#turn) return;
      const { example, linked, name } = source;
      const setup = setupOf(example, linked);
      const opened = await this.#client.request('open', { name, source: film, setup });
      if (turn !== this.#turn) return;
      this.#states.opened();
      this.#source = source;
      this.#awaiting = undefined;
      await this.#adopt(opened, setup, source);
    } catch (error) {
      if (turn !== this.#turn) return;
      this.#states.opened();
      if (source.linked) return this.#openWithoutLink(source, toFailure(error).message);
      this.#ui.data.choose(this.#source?.example);
      this.#states.fail(`${source.name} could not be opened.`, error);
    }
  }

  /** What a link leads to without what it says of settings: something in them is refused. */
  async #openWithoutLink({ linked: _, ...source }: Source, why: string): Promise<void> {
    await this.#open(source);
    if (this.#states.value === 'error' || this.#source !== source) return;
    this.#ui.banner.show('The link’s settings are left out.', `One of them cannot be: ${why}.`);
  }

  async #restartEngine(): Promise<void> {
    this.#client.restart({ code: 'internal', message: 'the engine was started again' });
    await this.#client.request('hello', undefined);
    this.#states.engineBroken = false;
  }
}

async function fromExample({ source }: TrackExample): Promise<FilmSource> {
  if ('cine' in source) return source;
  const response = await fetched(exampleUrl(source.file));
  return { files: [{ name: source.file, bytes: new Uint8Array(await response.arrayBuffer()) }] };
}
