// Libraries that decode compressed meshes, each imported when the first document that needs it is read.
import { invalid } from '../check.js';
import type { DecoderSource } from '../dicom/codecs.js';
import { reasonOf } from './error.js';

/**
 * Decoders of compressed meshes. In Node, those that are installed are found; a page gives those that its files need, so
 * that bundlers see what is imported. The modules, and the `.wasm` file of the package:
 *
 * - `draco`: `draco3dgltf/draco_decoder_gltf_nodejs.js`, `draco_decoder_gltf.wasm`
 * - `meshopt`: `meshoptimizer/decoder`, without a file
 */
export type MeshDecoders = Partial<Record<'draco' | 'meshopt', DecoderSource>>;

const MODULES = {
  draco: { module: 'draco3dgltf/draco_decoder_gltf_nodejs.js', package: 'draco3dgltf' },
  meshopt: { module: 'meshoptimizer/decoder', package: 'meshoptimizer' },
} as const;

/** Imports a library, and calls `start` with its module; throws `invalid-argument` naming the package if that fails. */
export async function started<T>(
  name: keyof MeshDecoders,
  decoders: MeshDecoders,
  start: (module: unknown, wasm: DecoderSource['wasm']) => Promise<T>,
): Promise<T> {
  try {
    const { load, wasm } = decoders[name] ?? installed(name);
    return await start(await load(), wasm);
  } catch (error) {
    const what = `the meshes are compressed, and the decoder is not there (${reasonOf(error)})`;
    throw invalid(`decoders.${name}`, `${what}: install the package ${MODULES[name].package}, and in a page pass it`);
  }
}

function installed(name: keyof MeshDecoders): DecoderSource {
  const { process } = globalThis as { process?: { versions?: { node?: string } } };
  if (process?.versions?.node === undefined) throw new Error('it was not given');
  const { module } = MODULES[name];
  // Bundlers leave an import by a variable alone.
  return { load: () => import(/* webpackIgnore: true */ /* @vite-ignore */ module) };
}
