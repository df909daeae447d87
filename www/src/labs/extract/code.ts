/** Code of the Extract lab's runs. */
import type { Volume } from 'vesicle';
import { bytesOf, callsOf, chosen, type Program, volumeOf } from '../../engine/code';
import { literal } from '../../engine/literal';

import { startOf } from './models';
import type { LargeSource, Setup } from './protocol';

/**
 * Volume of a run: a frame of files, of which a computed volume has none, or an image larger than memory and the number
 * of its coarser levels.
 */
export type RunData =
  | { files: { name: string }[]; frame: number | undefined; volume: Volume }
  | { source: LargeSource; name: string; coarserLevels: number };

/** Returns how code makes the model of a set-up. */
export function programOf(setup: Setup, data: RunData, stem: string): Program {
  const { levels, edge, attractors, params } = setup;
  const rest = {
    start: startOf(setup, Number(params.iso)),
    ...(edge !== undefined && { edge }),
    params: chosen('deformable', params),
  };
  const attracted = attractors.length > 0 ? [`model.setAttractors(${literal(attractors)});`] : [];
  const made = (volume: string, options: object) => [
    `const model = new DeformableModel({ volume${volume}, ${literal(options).slice(2)});`,
    ...attracted,
  ];
  const calls = callsOf('step', 'setParams', 'setAttractors', 'seed');
  if ('coarserLevels' in data) {
    const options = { finest: data.coarserLevels - levels, ...(setup.box && { box: setup.box }), ...rest };
    const image = imageOf(data.source, data.name);
    // A step may have to wait for data.
    const step = (count: unknown) => `await model.run({ maxIterations: ${literal(count)} });`;
    return { ...image, begin: [...image.begin, ...made('', options)], calls: { ...calls, step } };
  }
  const { files, frame, volume } = data;
  const { volume: read, ...program } = volumeOf(files, volume, stem);
  // A saved volume has one frame.
  const one = frame === undefined || program.needs === 'saved' ? read : `${read}.frame(${frame})`;
  return { ...program, names: ['DeformableModel', 'Volume'], calls, begin: made(`: ${one}`, { ...rest, levels }) };
}

/** Returns the part of a program that opens an image larger than memory. */
function imageOf({ zarr }: LargeSource, name: string): Omit<Program, 'calls'> {
  const names = ['DeformableModel'];
  const imports = [`import { openZarr } from 'vesicle/zarr';`];
  const opened = (source: string) => [`const volume = await openZarr(${source});`];
  if (typeof zarr === 'string') return { names, imports, begin: opened(literal(zarr)) };
  if (zarr instanceof Blob)
    return { ...bytesOf([name], ['bytes']), names, imports, begin: opened('new Blob([bytes])') };
  const given = `the path of the folder ${literal(name)}`;
  const more = [...imports, `import FileSystemStore from '@zarrita/storage/fs';`];
  const begin = opened('new FileSystemStore(folder)');
  return { ...{ needs: 'folder', files: [name] }, names, imports: more, parameters: ['folder'], given, begin };
}
