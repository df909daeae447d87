import { toFailure } from '../channel';
import type { SculptClient } from '../sculpt/client';
import { SCENES, type SculptExample } from '../sculpt/examples';
import { isSculptPreset, sceneById } from '../sculpt/presets';
import type { Opened, SceneSource } from '../sculpt/protocol';
import type { LabStates } from './lab-states';
import { fromExample, fromFiles } from './mesh-files';
import { fromHash, type LinkedScene } from './sculpt-link';
import type { SculptParts } from './sculpt-parts';

/** What the present meshes were made of, to open them again after a failure of the engine. */
export interface Source {
  name: string;
  opened: () => Promise<SceneSource>;
  example?: SculptExample;
  linked?: LinkedScene;
}

/** For meshes of the user's: a base has fewer triangles than a detail worth the name. */
const OWN_PARAMS = { supersample: 2 };

/** Opens examples, files and links: gets the meshes and has the worker make a model. What is asked for last counts. */
export class Opening {
  readonly #client: SculptClient;
  readonly #ui: SculptParts;
  readonly #states: LabStates;
  readonly #adopt: (opened: Opened, source: Source) => Promise<void>;
  #source: Source | undefined;
  /** A link that waits for its file. */
  #awaiting: LinkedScene | undefined;
  /** Counts what was asked to be opened. */
  #turn = 0;

  constructor(
    client: SculptClient,
    ui: SculptParts,
    states: LabStates,
    adopt: (opened: Opened, source: Source) => Promise<void>,
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

  example(example: SculptExample, linked?: LinkedScene): Promise<void> {
    const { name } = example;
    return this.#open({ name, opened: () => fromExample(example), example, ...(linked && { linked }) });
  }

  files(files: File[]): Promise<void> {
    const name = files.map((file) => file.name).join(' + ');
    const linked = this.#awaiting;
    return this.#open({ name, opened: () => fromFiles(files), ...(linked && { linked }) });
  }

  bytes(name: string, bytes: Uint8Array): Promise<void> {
    return this.#open({ name, opened: async () => ({ detail: { file: { name, bytes } } }) });
  }

  byId(id: string): void {
    const example = sceneById(id);
    if (example) void this.example(example);
  }

  /** What is open once more, as it was when it was opened. */
  async again(): Promise<void> {
    if (this.#source) await this.#open(this.#source);
  }

  /** Stops what is being opened: the worker is in the midst of it, so it is started anew. */
  async cancel(): Promise<void> {
    if (this.#states.value !== 'loading') return;
    this.#turn += 1;
    this.#states.engineBroken = true;
    const former = this.#source;
    if (former) await this.#open(former);
    else await this.example(SCENES[0]);
    this.#ui.status.say('Cancelled.');
  }

  /** Opens what the page's address asks for; says why where that cannot be. `otherwise` is opened then. */
  async link(otherwise?: SculptExample): Promise<void> {
    const linked = fromHash(location.hash);
    const id = linked?.example ?? (linked && !linked.file ? SCENES[0].id : '');
    const example = sceneById(id);
    if (linked && example) return this.example(example, linked);
    if (otherwise) await this.example(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#ui.banner.show('This link needs a file.', `Open ${linked.file} from your disk: its settings will follow.`);
    else this.#ui.banner.show('This link cannot be followed.', `There is no example “${linked.example ?? ''}”.`);
  }

  /** Opens meshes and plays. When it fails, everything stays as it was. */
  async #open(source: Source): Promise<void> {
    const turn = ++this.#turn;
    const calm = this.#states.open(`Opening ${source.name}.`);
    try {
      if (this.#states.engineBroken) await this.#restartEngine();
      await calm;
      const meshes = await source.opened();
      if (turn !== this.#turn) return;
      if (meshes.detail && !meshes.base)
        this.#states.load(`Making the base of ${source.name}: its smooth form, without detail.`);
      const { example, linked } = source;
      const params = { ...(example?.params ?? OWN_PARAMS), ...linked?.params };
      const [variant] = isSculptPreset(example) ? example.variants : [];
      const usual = linked?.keys ? undefined : (variant?.pose ?? example?.pose);
      const setup = { start: example?.start, params, pose: linked?.pose ?? usual };
      const opened = await this.#client.request('open', { source: meshes, setup });
      if (turn !== this.#turn) return;
      this.#states.opened();
      this.#source = source;
      this.#awaiting = undefined;
      await this.#adopt(opened, source);
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
