/**
 * `vesicle` with the implicit surface as its only method, in a smaller WebAssembly module of its own.
 *
 * All else is as in `vesicle`, but without the readers of files, and without `enrichSlices`, `Volume.fromFrames` and
 * `animationGlb`, which are for sequences. Results are bit-identical.
 * Objects belong to their module: a `Mesh` or `Volume` of another entry point is a different type, and is passed on as
 * arrays (`Mesh.fromArrays`, `new Volume`), which `vesicle/import` returns for files. Errors are those of `vesicle`.
 *
 * @module vesicle/implicit
 */
import { type ParamSpec, paramSpecsOf } from '../params.js';
import { implicitParamSpecs } from '../vesicle.js';

export * from '../common.js';
export { default } from '../common.js';
export * from '../implicit.js';

const specsOf = paramSpecsOf({ implicit: implicitParamSpecs });

/**
 * Returns descriptions of the parameters of the method, in their recommended order of display.
 *
 * @throws {@link VesicleError} `invalid-argument`: another method, which this module does not have.
 */
export function paramSpecs(method: 'implicit'): ParamSpec[] {
  return specsOf(method);
}
