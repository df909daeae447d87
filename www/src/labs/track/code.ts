/** Code of the Track lab's runs. */
import type { Volume } from 'vesicle';
import { callsOf, chosen, type Program, volumeOf } from '../../engine/code';
import { literal } from '../../engine/literal';
import type { Preparation, Setup } from './protocol';
import { factorsOf, trackerOptions } from './source';

/** An image as opened, and as prepared for tracking; one that was computed has no files. */
interface RunImage {
  files: { name: string }[];
  original: Volume;
  preparedVolume: Volume;
}

/** Returns how code makes the tracker of a set-up; its result is the surface of `frame`, or else the newest one. */
export function programOf(
  setup: Setup,
  { files, original, preparedVolume }: RunImage,
  frame: number | undefined,
  stem: string,
): Program {
  const { volume, ...read } = volumeOf(files, original, stem);
  const { params, ...options } = trackerOptions(preparedVolume, setup);
  const { threshold } = setup.params;
  const given = literal({ ...options, params: chosen('tracking', params) }).slice(2);
  return {
    ...read,
    names: ['SurfaceTracker', 'Volume'],
    begin: [
      `const volume = ${volume}${prepared(original, setup.preparation)};`,
      `const model = new SurfaceTracker({ volume, ${given});`,
      ...(threshold === undefined ? [] : [`model.setParams(${literal({ threshold })});`]),
    ],
    calls: callsOf('step', 'setParams'),
    ...(frame !== undefined && { mesh: `model.meshAt(${frame})` }),
  };
}

/** Returns the calls that prepare an image. */
function prepared(image: Volume, { binning, enrichment, factor }: Preparation): string {
  const binned = binning > 1 ? `.binned(${literal(factorsOf(image, binning))})` : '';
  if (enrichment === 'none' || factor === 1) return binned;
  return `${binned}.enrichSlices(${literal({ method: enrichment, ...(factor > 0 && { factor }) })})`;
}
