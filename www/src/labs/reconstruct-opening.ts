import { toFailure } from '../channel';
import type { ReconstructClient } from '../reconstruct/client';
import { CLOUDS, type CloudExample } from '../reconstruct/examples';
import { type CloudVariant, cloudById, isCloudPreset } from '../reconstruct/presets';
import type { Cloud, CloudSource, ParamValues, Setup } from '../reconstruct/protocol';
import type { CloudChoice } from '../ui/cloud-setup';
import type { LabStates } from './lab-states';
import type { Photograph } from './photographs';
import { NO_EDITS } from './picking';
import { fromExample, fromFiles, type Opened } from './point-files';
import { fromHash, type LinkedCloud, withLink } from './reconstruct-link';
import type { ReconstructParts } from './reconstruct-parts';
import type { ModelSettings } from './reconstruct-settings';

/** What the present points were made of, to open them again after a failure of the engine. */
export interface Source {
  name: string;
  opened: () => Promise<Opened>;
  example?: CloudExample;
  linked?: LinkedCloud;
}

/** What has been opened: the worker has a model of it that has not begun. */
export interface OpenedCloud {
  cloud: Cloud;
  params: ParamValues;
  photographs: Photograph[];
  setup: Setup;
  /** As it was asked for; {@link Opening.source} has the name of the points where only cameras came. */
  source: Source;
}

/** Opens examples, files and links: gets the points and has the worker load them. What is asked for last counts. */
export class Opening {
  readonly #client: ReconstructClient;
  readonly #ui: ReconstructParts;
  readonly #states: LabStates;
  readonly #settings: ModelSettings;
  readonly #adopt: (opened: OpenedCloud) => Promise<void>;
  #source: Source | undefined;
  /** A link that waits for its file. */
  #awaiting: LinkedCloud | undefined;
  /** Counts what was asked to be opened. */
  #turn = 0;
  /** What the method's parameters are where nothing is said. */
  defaults: ParamValues = {};

  constructor(
    client: ReconstructClient,
    ui: ReconstructParts,
    states: LabStates,
    settings: ModelSettings,
    adopt: (opened: OpenedCloud) => Promise<void>,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#settings = settings;
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

  example(example: CloudExample, linked?: LinkedCloud): Promise<void> {
    const name = 'file' in example.source ? example.source.file : example.source.shape;
    return this.#open({ name, opened: () => fromExample(example), example, ...(linked && { linked }) });
  }

  files(files: File[]): Promise<void> {
    const name = files.find((file) => !/\.(json|png|jpe?g|webp)$/i.test(file.name))?.name;
    const linked = this.#awaiting;
    return this.#open({
      name: name ?? files.map((file) => file.name).join(' + '),
      opened: () => fromFiles(files),
      ...(linked && { linked }),
    });
  }

  byId(id: string): void {
    const example = cloudById(id);
    if (example) void this.example(example);
  }

  /** What is open once more, as it was when it was opened. */
  async again(): Promise<void> {
    if (this.#source) await this.#open(this.#source);
  }

  /** Opens what the page's address asks for; says why where that cannot be. `otherwise` is opened then. */
  async link(otherwise?: CloudExample): Promise<void> {
    const linked = fromHash(location.hash);
    const id = linked?.example ?? (linked && !linked.file ? CLOUDS[0].id : '');
    const example = cloudById(id);
    if (linked && example) return this.example(example, linked);
    if (otherwise) await this.example(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#ui.banner.show('This link needs a file.', `Open ${linked.file} from your disk: its settings will follow.`);
    else this.#ui.banner.show('This link cannot be followed.', `There is no example “${linked.example ?? ''}”.`);
  }

  /** Opens points and runs the model on them. When it fails, everything stays as it was. */
  async #open(source: Source): Promise<void> {
    const turn = ++this.#turn;
    const calm = this.#states.open(`Opening ${source.name}.`);
    try {
      if (this.#states.engineBroken) await this.#restartEngine();
      await calm;
      const { source: points, photographs } = await source.opened();
      if (turn !== this.#turn) return;
      const from = points ?? (await this.#presentPoints());
      const setup = this.#setupFor(source, points === undefined);
      const cameras = photographs.map(({ view }) => view);
      const { cloud, params } = await this.#client.request('load', { source: from, cameras, setup });
      if (turn !== this.#turn) return;
      this.#states.opened();
      const whole = async () => ({ source: from, photographs });
      this.#source = points ? source : { ...source, name: this.#source?.name ?? source.name, opened: whole };
      this.#awaiting = undefined;
      await this.#adopt({ cloud, params, photographs, setup, source });
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

  /** For cameras that come after their points. */
  async #presentPoints(): Promise<CloudSource> {
    if (!this.#source) throw new Error('Open points first, or together with their cameras.');
    const { source } = await this.#source.opened();
    if (!source) throw new Error('Open points together with their cameras.');
    return source;
  }

  #setupFor(source: Source, samePoints: boolean): Setup {
    const { linked } = source;
    const { params, ...choice } = this.#usual(source, samePoints);
    return {
      params: { ...params, ...linked?.params },
      ...withLink(choice, linked ?? {}),
      edits: linked?.edits ?? NO_EDITS,
    };
  }

  /** The settings before a link says otherwise: an example's own; those in force from file to file; else the method's. */
  #usual({ example, linked }: Source, samePoints: boolean): CloudChoice & { params: ParamValues } {
    if (example) {
      const first = variantOf(example);
      const params = { ...this.defaults, ...example.params, ...(linked ? {} : first?.params) };
      return { params, maxPoints: first?.maxPoints ?? example.maxPoints, keepComponents: example.keepComponents };
    }
    const { params, choice } = this.#settings;
    if (samePoints) return { params, ...choice };
    if (linked || !this.#source || this.#source.example)
      return { params: this.defaults, maxPoints: undefined, keepComponents: undefined };
    // A cell is a length in the units of other points.
    const { cell: _, ...others } = params;
    return { params: others, ...choice };
  }
}

function variantOf(example: CloudExample): CloudVariant | undefined {
  return isCloudPreset(example) ? example.variants[0] : undefined;
}
