import type { SculptClient } from '../sculpt/client';
import { SCENES, type SculptExample } from '../sculpt/examples';
import { isSculptPreset, sceneById } from '../sculpt/presets';
import type { OpenedScene, SceneSource } from '../sculpt/protocol';
import { text } from '../texts';
import type { LabStates } from './lab-states';
import type { Handoff } from './labs';
import { fromExample, fromFiles } from './mesh-files';
import { Opening, type Source } from './opening';
import { fromHash, type LinkedScene } from './sculpt-link';
import type { SculptParts } from './sculpt-parts';

export type SculptSource = Source<SculptExample, LinkedScene, SceneSource>;

/**
 * Parameters for the user's own meshes: each edge of the base may be halved twice where the detail needs more vertices,
 * since the base has fewer triangles than the detail.
 */
const OWN_PARAMS = { supersample: 2 };

/** Opens meshes in the Sculpt lab, and builds models of them. */
export class SculptOpening extends Opening<SculptExample, LinkedScene, SceneSource, OpenedScene> {
  protected readonly first = SCENES[0];
  readonly #client: SculptClient;
  readonly #onOpened: (opened: OpenedScene, source: SculptSource) => Promise<void>;

  constructor(
    client: SculptClient,
    ui: SculptParts,
    states: LabStates,
    onOpened: (opened: OpenedScene, source: SculptSource) => Promise<void>,
  ) {
    super(client, ui, states);
    this.#client = client;
    this.#onOpened = onOpened;
  }

  /** Opens a mesh passed on by another lab. */
  override passedOn({ name, bytes }: Handoff): Promise<void> {
    return this.open({ name, load: async () => ({ detail: { file: { name, bytes } } }) });
  }

  protected find(id: string): SculptExample | undefined {
    return sceneById(id);
  }

  protected linkedBy(hash: string): LinkedScene | undefined {
    return fromHash(hash);
  }

  protected fromExample(example: SculptExample): SculptSource {
    return { name: example.name, load: () => fromExample(example), example };
  }

  protected fromFiles(files: File[]): SculptSource {
    return { name: files.map((file) => file.name).join(' + '), load: () => fromFiles(files) };
  }

  protected load({ name, example, linked }: SculptSource, meshes: SceneSource): Promise<OpenedScene> {
    if (meshes.detail && !meshes.base) this.states.load(text('sculpt.computingBase', { name }));
    const params = { ...(example?.params ?? OWN_PARAMS), ...linked?.params };
    const [variant] = isSculptPreset(example) ? example.variants : [];
    const usual = linked?.keys ? undefined : (variant?.pose ?? example?.pose);
    const setup = { start: example?.start, params, pose: linked?.pose ?? usual };
    return this.#client.request('open', { source: meshes, setup });
  }

  protected adopt(opened: OpenedScene, source: SculptSource): Promise<void> {
    return this.#onOpened(opened, source);
  }
}
