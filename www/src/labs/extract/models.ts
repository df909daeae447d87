/**
 * Creates deformable models from the page's settings, and computes the values at their vertices by which surfaces are
 * coloured.
 */
import { DeformableModel, type Volume } from 'vesicle';
import type { VertexQuantity } from '../../engine/protocol';
import { EXTRACT_OF_SMALL } from '../../engine/small-files';
import { otsu } from '../../engine/threshold';
import { HISTOGRAM_BINS } from '../../engine/volumes';
import type { SavedRun, Setup } from './protocol';

type Options = ConstructorParameters<typeof DeformableModel>[0];

/** Returns the initial surface of a set-up, whose iso value is `iso`. */
export function startOf({ start }: Setup, iso: number): Options['start'] {
  switch (start.kind) {
    case 'contour':
    case 'enclosing':
      return start.kind;
    case 'bubbles':
      return { bubbles: start.count };
    case 'isosurface':
      return { marchingCubes: iso };
    case 'sphere':
      return { seeds: new Float64Array(start.center), radius: start.radius };
  }
}

/** Returns the options of the model of a set-up; if that has no iso value, one is chosen from the histogram of `volume`. */
export function modelOptions(volume: Volume, setup: Setup, isSmall = false) {
  const chosen = setup.params.iso;
  const iso = typeof chosen === 'number' ? chosen : otsu(volume.histogram({ bins: HISTOGRAM_BINS }), volume.range);
  return {
    start: startOf(setup, iso),
    levels: setup.levels,
    ...(setup.edge === undefined ? {} : { edge: setup.edge }),
    ...(isSmall && EXTRACT_OF_SMALL),
    params: { ...setup.params, iso },
  };
}

/** Builds the model of a set-up with the attractors in it; `make` is called without them. */
export function withAttractors(setup: Setup, make: () => DeformableModel): DeformableModel {
  const model = make();
  // Setting none would wake the model, which then takes more iterations from a contour.
  if (setup.attractors.length === 0) return model;
  try {
    model.setAttractors(setup.attractors);
  } catch (error) {
    model.free();
    throw error;
  }
  return model;
}

/** Returns a set-up with no more pyramid levels than a volume allows: those of another volume may be more. */
export function fittingSetup(setup: Setup, volume: Volume): Setup {
  return { ...setup, levels: Math.min(setup.levels, DeformableModel.maxLevels(volume)) };
}

export function buildModel(volume: Volume, setup: Setup, isSmall?: boolean): DeformableModel {
  return withAttractors(setup, () => new DeformableModel({ ...modelOptions(volume, setup, isSmall), volume }));
}

/** Builds a model with the state of a saved run; its own initial surface is replaced at once. */
export function restoredModel(volume: Volume, { state, levels }: SavedRun, isSmall?: boolean): DeformableModel {
  const model = new DeformableModel({ volume, levels, start: 'enclosing', ...(isSmall && EXTRACT_OF_SMALL) });
  try {
    model.restore(state);
  } catch (error) {
    model.free();
    throw error;
  }
  return model;
}

/**
 * For each quantity by which the surface can be coloured, a function that returns one value per vertex, in the order of
 * the mesh's arrays. A new quantity needs an entry here and one in `view/shading`.
 */
const QUANTITIES: Record<VertexQuantity, (model: DeformableModel) => Float32Array> = {
  /**
   * Outward speed along the normal, negative inwards, as displacement per time step in units of the sampling distance
   * δ.
   */
  speed: (model) => {
    const factor = model.params.timeStep / model.delta;
    return model.speeds().map((speed) => speed * factor);
  },
  'mean curvature': ({ mesh }) => mesh.curvature('mean'),
  'gaussian curvature': ({ mesh }) => mesh.curvature('gaussian'),
};

export function valuesFor(model: DeformableModel, quantity: VertexQuantity): Float32Array {
  return QUANTITIES[quantity](model);
}
