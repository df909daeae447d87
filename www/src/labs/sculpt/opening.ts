import type { Handoff } from '../../lab/lab';
import { Opening, type Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import type { SculptClient } from './client';
import { SCENES, type SculptExample } from './examples';
import { fromHash, type LinkedScene } from './link';
import { fromExample, fromFiles } from './mesh-files';
import type { SculptParts } from './parts';
import { poseOf, sceneById } from './presets';
import type { NamedBytes, OpenedScene, SceneSource, Support } from './protocol';
import type { SculptMoments } from './settings';

export type SculptSource = Source<SculptExample, LinkedScene, SceneSource>;

/** A scene opened in the Sculpt lab, and the states of the session that is continued. */
export interface OpenedPose extends OpenedScene {
  moments?: SculptMoments;
}

/**
 * Parameters for the user's own meshes: each edge of the base may be halved twice where the detail needs more vertices,
 * since the base has fewer triangles than the detail.
 */
const OWN_PARAMS = { supersample: 2 };

/** Opens meshes in the Sculpt lab, and builds models of them. */
export class SculptOpening extends Opening<SculptExample, LinkedScene, SceneSource, OpenedPose> {
  protected readonly first = SCENES[0];
  readonly #client: SculptClient;
  readonly #onOpened: (opened: OpenedPose, source: SculptSource) => Promise<void>;

  constructor(
    client: SculptClient,
    ui: SculptParts,
    states: LabStates,
    onOpened: (opened: OpenedPose, source: SculptSource) => Promise<void>,
  ) {
    super(client, ui, states);
    this.#client = client;
    this.#onOpened = onOpened;
  }

  /** Opens a mesh passed on by another lab. */
  override passedOn({ name, bytes, warnings = [] }: Handoff): Promise<void> {
    return this.open({ name, load: async () => ({ detail: { file: { name, bytes } } }), isMade: true, warnings });
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

  override filesOf({ detail, base }: SceneSource): NamedBytes[] {
    const files = [detail, base].flatMap((mesh) => (mesh && 'file' in mesh ? [mesh.file] : []));
    const texture = detail && 'file' in detail ? detail.texture : undefined;
    return texture
      ? [...files, { name: text('sculpt.textureFile', { type: texture.type.slice(6) }), bytes: texture.bytes }]
      : files;
  }

  protected async load({ name, example, linked, session }: SculptSource, meshes: SceneSource): Promise<OpenedPose> {
    if (session) {
      const { unpackMoments } = await import('../../lab/session/moments');
      const content = contentOf(session, 'sculpt');
      const moments: SculptMoments = unpackMoments(content);
      const { saved } = moments.now;
      const { log } = content;
      // The state fits a model of the parameters that its own was built with, not of those in force.
      const params = log?.setup.params ?? content.params;
      const setup = { start: saved.start, params, pose: undefined, support: saved.support ?? 'membrane' };
      return { ...(await this.#client.request('open', { source: meshes, setup, saved, log })), moments };
    }
    const support = supportOf(meshes, example, linked);
    if (support === 'membrane' && meshes.detail && !meshes.base)
      this.states.load(text('sculpt.computingBase', { name }));
    const params = { ...(example?.params ?? OWN_PARAMS), ...linked?.params };
    const usual = linked?.keys ? undefined : poseOf(example);
    const start = example?.start ?? (support === 'surface' ? linked?.rest : undefined);
    const setup = { start, params, pose: linked?.pose ?? usual, support };
    return this.#client.request('open', { source: meshes, setup });
  }

  protected adopt(opened: OpenedPose, source: SculptSource): Promise<void> {
    return this.#onOpened(opened, source);
  }
}

/**
 * Returns what supports a surface: itself, if it is the user's own and has no base, unless its link says otherwise. Links
 * of versions that knew only the membrane say nothing.
 */
function supportOf(meshes: SceneSource, example?: SculptExample, linked?: LinkedScene): Support {
  if (example || meshes.base || !meshes.detail) return 'membrane';
  return linked ? (linked.support ?? 'membrane') : 'surface';
}
