/**
 * `vesicle` with the multiresolution model as its only method, in a smaller WebAssembly module of its own.
 *
 * All else is as in `vesicle`, but without the readers of files, `enrichSlices` and `Volume.fromFrames`. Results are
 * bit-identical.
 * Objects belong to their module: a `Mesh` or `Volume` of another entry point is a different type, and is passed on as
 * arrays (`Mesh.fromArrays`, `new Volume`), which `vesicle/import` returns for files. Errors are those of `vesicle`.
 *
 * @module vesicle/multires
 */
import { type ParamSpec, paramSpecsOf } from '../params.js';
import { multiresParamSpecs } from '../vesicle.js';

export { animationGlb } from '../animation.js';
export * from '../common.js';
export { default } from '../common.js';
export * from '../multires.js';

const specsOf = paramSpecsOf({ multires: multiresParamSpecs });

/**
 * Returns descriptions of the parameters of the method, in their recommended order of display.
 *
 * @throws {@link VesicleError} `invalid-argument`: another method, which this module does not have.
 */
export function paramSpecs(method: 'multires'): ParamSpec[] {
  return specsOf(method);
}
