import type { NamedBytes, ParamSpec, ParamValues } from '../../engine/protocol';
import { isOfSmall } from '../../engine/small-files';
import { nameOf, reading } from '../../importers/files';

import { count } from '../../kit/format';
import { initialOptions } from '../../kit/view';
import { dataUrl, fetchBytes, preload } from '../../lab/downloads';
import type { Handoff } from '../../lab/lab';
import { LinkError, readLink } from '../../lab/link-query';
import type { LabData, Loading, Opening, Source } from '../../lab/opening';
import type { Session } from '../../lab/session/check';
import { contentOf } from '../../lab/session/content';
import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import type { ExtractClient } from './client';
import { EXAMPLES, type Example } from './examples';
import { fromHash, type Linked, withLink } from './link';
import type { ExtractParts } from './parts';
import { defaultStart, exampleById } from './presets';
import type { ImageSource, Loaded, Setup } from './protocol';
import type { ExtractResults } from './results';
import type { ExtractContent } from './schema';
import type { ExtractMoments, ExtractSettings } from './settings';
import { type StartChoice, USUAL_START } from './start';
import { EXTRACT_VIEW } from './view';

export type ExtractSource = Source<Example, Linked, ImageSource>;
export type ExtractOpening = Opening<Example, Linked, ImageSource, OpenedVolume>;

/** A volume opened in the Extract lab, and the settings of its model, which has done no step yet. */
export interface OpenedVolume extends Loaded {
  choice: StartChoice;
  setup: Setup;
  /** The states of the session that is continued. */
  moments?: ExtractMoments | undefined;
}

/** Volumes of the Extract lab, and how models of them are built. */
export class ExtractData implements LabData<Example, Linked, ImageSource, OpenedVolume> {
  readonly first = EXAMPLES[0];
  readonly #client: ExtractClient;
  readonly #ui: ExtractParts;
  readonly #states: LabStates;
  readonly #settings: ExtractSettings;
  readonly #results: ExtractResults;
  /** Sends the view's settings to the worker again, after a restart of the engine. */
  readonly #onRestart: () => Promise<unknown>;
  /**
   * Default parameters of the method, without the iso value, whose default depends on the volume; links contain only
   * the parameters that differ.
   */
  defaults: ParamValues = {};

  constructor(
    client: ExtractClient,
    ui: ExtractParts,
    states: LabStates,
    settings: ExtractSettings,
    results: ExtractResults,
    onRestart: () => Promise<unknown>,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#settings = settings;
    this.#results = results;
    this.#onRestart = onRestart;
  }

  /** Returns a volume passed on by another lab, with the parameters passed on with it. */
  fromHandoff({ name, bytes, params, warnings = [] }: Handoff): ExtractSource {
    const load = async () => ({ files: [{ name, bytes: bytes.slice() }] });
    return { name, load, linked: { params, attractors: [], view: {} }, unit: '', isMade: true, warnings };
  }

  find(id: string): Example | undefined {
    return exampleById(id);
  }

  linkedBy(hash: string): Linked | undefined {
    return fromHash(hash);
  }

  fromExample(example: Example): ExtractSource {
    const { source } = example;
    if ('shape' in source) return { name: source.shape, load: async () => source, example };
    const { file } = source;
    const load = async () => ({ files: [{ name: file, bytes: await fetchBytes(dataUrl(file)) }] });
    return { name: file, load, example };
  }

  /** Returns another frame of the open volume, with the settings in force. */
  atFrame({ session: _, ...present }: ExtractSource, frame: number): ExtractSource {
    const { params, attractors, sphere } = this.#settings;
    const { kind: start, edge = 0, ...choice } = this.#ui.start.inForce;
    const linked = { ...choice, view: {}, frame, start, edge, sphere, params, attractors };
    return { ...present, linked, isChange: true };
  }

  fromFiles(files: File[]): ExtractSource {
    const [archive] = files;
    if (files.length === 1 && archive && /\.zip$/i.test(archive.name))
      return { name: archive.name, load: async () => ({ zarr: archive }) };
    return { name: nameOf(files), ...reading(files) };
  }

  async load(
    source: ExtractSource,
    volume: ImageSource,
    { reopening }: Loading<Example, Linked, ImageSource>,
  ): Promise<OpenedVolume> {
    const moments = source.session && !reopening ? await momentsOf(source.session) : undefined;
    const { saved, page } = moments?.now ?? {};
    const choice = page?.choice ?? (reopening ? this.#ui.start.inForce : this.#startFor(source, volume));
    const setup = reopening || page ? this.#settings.setup(choice) : this.#setupFor(source, volume, choice);
    const isSmall = isOfSmall(source.session, storedIn(volume));
    const body = {
      name: source.name,
      source: volume,
      setup,
      frame: frameOf(source),
      saved,
      isSmall,
      isShown: reopening,
    };
    const loaded = await this.#client.request('load', body, transferable(volume));
    return { ...loaded, choice: { ...choice, levels: loaded.levels }, setup, moments };
  }

  async adopt(opened: OpenedVolume, source: ExtractSource, reopening: boolean): Promise<void> {
    if (reopening) return this.#takeUp(opened, source);
    const { volume, choice, params, setup, moments, labels = 0 } = opened;
    this.#states.ready = true;
    this.#ui.adopt(volume, source, labels);
    this.#settings.adopt(volume, choice, params, setup);
    // The address, which is written then, has the settings.
    if (source.linked && !source.isChange)
      this.#ui.options.set({ ...initialOptions(EXTRACT_VIEW), ...source.linked.view });
    if (moments)
      return this.#resume(moments, source.session && contentOf<ExtractContent>(source.session, 'extract').view);
    this.#settings.checkpoint(text('labs.play'));
    await this.#client.request('play', undefined);
  }

  /**
   * Continues with a newly loaded engine after the previous one broke, with volume and settings unchanged: restores the
   * newest saved state, or begins a new model if there is none.
   */
  async #takeUp({ choice, params }: OpenedVolume, { example }: ExtractSource): Promise<void> {
    this.#ui.page.data.choose(example);
    // Sends the slice planes to the new engine.
    this.#ui.stage.goTo(this.#ui.stage.crosshair);
    const { newest } = this.#settings;
    if (newest) {
      await this.#client.request('restore', newest.saved);
      this.#settings.adoptMoment(newest);
    } else this.#settings.begin(choice, params);
    this.#ui.page.status.say(
      newest ? text('extract.restartedFrom', { iteration: count(newest.saved.iteration) }) : text('extract.restarted'),
    );
  }

  /** Continues a session: shows its state and view, and does not run it. */
  #resume(moments: ExtractMoments, view: ExtractContent['view']): void {
    this.#settings.resume(moments);
    if (!view) return;
    this.#ui.options.set(view.options);
    this.#ui.stage.view = view;
  }

  kept(present: ExtractSource | undefined): void {
    if (present) this.#ui.showFrame(present);
  }

  voxelsOf({ volume }: OpenedVolume): number {
    return volume.voxels.length;
  }

  filesOf(source: ImageSource): NamedBytes[] {
    return 'files' in source ? source.files : [];
  }

  superseded(): void {
    this.#client.request('cancelLoad', undefined).catch(() => undefined);
  }

  save(): void {
    this.#settings.save();
  }

  saved(): Promise<unknown> {
    return this.#settings.saved;
  }

  onEngineReady(specs: ParamSpec[]): void {
    const known = specs.filter(({ name }) => name !== 'iso');
    this.defaults = Object.fromEntries(known.map(({ name, default: value }) => [name, value]));
  }

  restarted(): Promise<unknown> {
    this.#results.forgetBuffers();
    return this.#onRestart();
  }

  /**
   * Returns the settings for a model of an example or of the user's file: an example's own parameters; for a file,
   * those in force except the iso value, which is specific to a volume; for a volume larger than memory, and for the
   * file of a link, which leaves them out, the defaults; without attractors. A link's settings take precedence.
   */
  #setupFor({ example, linked }: ExtractSource, volume: ImageSource, choice: StartChoice): Setup {
    const { iso: _, ...params } = this.#settings.params;
    const own = 'zarr' in volume || linked ? {} : params;
    const wanted: ParamValues = { ...(example?.params ?? own), ...linked?.params };
    const setup = this.#settings.setup(choice, wanted, linked?.attractors ?? []);
    if (linked?.sphere && choice.kind === 'sphere') setup.start = { kind: 'sphere', ...linked.sphere };
    return setup;
  }

  /**
   * Returns the choice of the initial surface: an example's own; for a file the one in force, but with the contour
   * (kind 'contour') in place of a sphere, and with an edge length that the model chooses, since positions and lengths
   * are specific to a volume; for a volume larger than memory always the contour, and one finer level; for the file of
   * a link the usual one. A link's settings take precedence.
   */
  #startFor({ example, linked }: ExtractSource, volume: ImageSource): StartChoice {
    const choice = this.#ui.start.shown.peek();
    const own: StartChoice =
      'zarr' in volume
        ? { ...choice, kind: 'contour', levels: 1, edge: undefined, box: undefined }
        : { ...choice, kind: choice.kind === 'sphere' ? 'contour' : choice.kind, edge: undefined };
    const suits: StartChoice = example
      ? { ...choice, ...defaultStart(example), levels: example.levels, edge: example.edge }
      : own;
    return linked ? withLink(example ? suits : USUAL_START, linked) : suits;
  }
}

/**
 * Starts to download the volume of the example that the address names, or of the first example if it names none,
 * while the engine loads.
 */
export function fetchLinked(): void {
  const linked = readLink(() => fromHash(location.hash));
  // Opening says what is wrong.
  if (linked instanceof LinkError) return;
  const example = linked?.example ? exampleById(linked.example) : EXAMPLES[0];
  if (example && !linked?.file && 'file' in example.source) preload(dataUrl(example.source.file));
}

async function momentsOf(session: Session): Promise<ExtractMoments> {
  const { unpackMoments } = await import('../../lab/session/moments');
  return unpackMoments(contentOf<ExtractContent>(session, 'extract'));
}

/** Returns the frame of a 4D volume that a source opens, counted from 0: that of its link or session. */
export function frameOf({ linked, session }: ExtractSource): number {
  const settings = session ? readLink(() => fromHash(session.hash)) : linked;
  return settings instanceof LinkError ? 0 : (settings?.frame ?? 0);
}

/** Returns the files that an image is in; undefined if it is computed, or has an address or a folder. */
function storedIn(source: ImageSource): readonly (Blob | NamedBytes)[] | undefined {
  if ('files' in source) return source.files;
  return 'zarr' in source && source.zarr instanceof Blob ? [source.zarr] : undefined;
}

function transferable(source: ImageSource): Transferable[] {
  return 'files' in source ? source.files.map(({ bytes }) => bytes.buffer as ArrayBuffer) : [];
}
