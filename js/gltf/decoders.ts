// Libraries that decode compressed meshes, each imported when the first document that needs it is read.
import { invalid } from '../check.js';
import { type DecoderSource, installed } from '../decoder-source.js';
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
    const { load, wasm } = decoders[name] ?? installed(MODULES[name].module);
    return await start(await load(), wasm);
  } catch (error) {
    const what = `the meshes are compressed, and the decoder is not there (${reasonOf(error)})`;
    throw invalid(`decoders.${name}`, `${what}: install the package ${MODULES[name].package}, and in a page pass it`);
  }
}
