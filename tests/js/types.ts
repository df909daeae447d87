// Compiled, never run: what a page in strict TypeScript does with the package.
import type * as vesicle from '../../pkg/index.js';
import { animationGlb } from '../../pkg/index.js';

/** All four models are steppers. */
export const steppers = (
  ...[deformable, implicit, tracker, multires]: [
    vesicle.DeformableModel,
    vesicle.ImplicitSurface,
    vesicle.SurfaceTracker,
    vesicle.MultiresolutionModel,
  ]
): vesicle.Stepper[] => [deformable, implicit, tracker, multires];

/** Files of the browser from all that is written. */
export const files = (mesh: vesicle.Mesh, volume: vesicle.Volume, model: vesicle.DeformableModel): Blob =>
  new Blob([mesh.toBytes('stl'), volume.toNifti(), volume.toBytes('nrrd'), model.save(), animationGlb([mesh])]);
