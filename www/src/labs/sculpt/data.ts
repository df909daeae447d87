import type { Handoff } from '../../lab/lab';
import type { LabData, Opening, Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import type { SculptClient } from './client';
import { SCENES, type SculptExample } from './examples';
import { fromHash, type LinkedScene } from './link';
import { fromExample, fromFiles } from './mesh-files';
import { poseOf, sceneById } from './presets';
import type { NamedBytes, OpenedScene, SceneSource, Support } from './protocol';
import type { SculptContent } from './schema';
import type { SculptMoments } from './settings';

export type SculptSource = Source<SculptExample, LinkedScene, SceneSource>;
export type SculptOpening = Opening<SculptExample, LinkedScene, SceneSource, OpenedPose>;

/** A scene opened in the Sculpt lab, and the states of the session that is continued. */
export interface OpenedPose extends OpenedScene {
  moments?: SculptMoments;
}

/**
 * Parameters for the user's own meshes: each edge of the base may be halved twice where the detail needs more vertices,
 * since the base has fewer triangles than the detail.
 */
const OWN_PARAMS = { supersample: 2 };

/** Meshes of the Sculpt lab, and how models of them are built. */
export class SculptData implements LabData<SculptExample, LinkedScene, SceneSource, OpenedPose> {
  readonly first = SCENES[0];
  readonly #client: SculptClient;
  readonly #states: LabStates;
  readonly adopt: (opened: OpenedPose, source: SculptSource) => Promise<void>;

  /** `adopt` displays what was opened. */
  constructor(
    client: SculptClient,
    states: LabStates,
    adopt: (opened: OpenedPose, source: SculptSource) => Promise<void>,
  ) {
    this.#client = client;
    this.#states = states;
    this.adopt = adopt;
  }

  find(id: string): SculptExample | undefined {
    return sceneById(id);
  }

  linkedBy(hash: string): LinkedScene | undefined {
    return fromHash(hash);
  }

  fromExample(example: SculptExample): SculptSource {
    return { name: example.name, load: () => fromExample(example), example };
  }

  fromFiles(files: File[]): SculptSource {
    return { name: files.map((file) => file.name).join(' + '), load: () => fromFiles(files) };
  }

  fromHandoff({ name, bytes, warnings = [] }: Handoff): SculptSource {
    return { name, load: async () => ({ detail: { file: { name, bytes } } }), isMade: true, warnings };
  }

  filesOf({ detail, base }: SceneSource): NamedBytes[] {
    const files = [detail, base].flatMap((mesh) => (mesh && 'file' in mesh ? [mesh.file] : []));
    const texture = detail && 'file' in detail ? detail.texture : undefined;
    return texture
      ? [...files, { name: text('sculpt.textureFile', { type: texture.type.slice(6) }), bytes: texture.bytes }]
      : files;
  }

  async load({ name, example, linked, session }: SculptSource, meshes: SceneSource): Promise<OpenedPose> {
    if (session) {
      const { unpackMoments } = await import('../../lab/session/moments');
      const content = contentOf<SculptContent>(session, 'sculpt');
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
      this.#states.load(text('sculpt.computingBase', { name }));
    const params = { ...(example?.params ?? OWN_PARAMS), ...linked?.params };
    const usual = linked?.keys ? undefined : poseOf(example);
    const start = example?.start ?? (support === 'surface' ? linked?.rest : undefined);
    const setup = { start, params, pose: linked?.pose ?? usual, support };
    return this.#client.request('open', { source: meshes, setup });
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
