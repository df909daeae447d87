import { readFile } from 'node:fs/promises';
import { expect } from 'vitest';
import { DeformableModel, type StepReport, Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { shapeVoxels } from '../../www/src/engine/shapes';
import type { Example } from '../../www/src/labs/extract/examples';
import { type Outcome, PRESETS, type Preset, type Variant } from '../../www/src/labs/extract/presets';

/** The pictures of all figures of the paper, by their names. */
export const CASES = PRESETS.flatMap((preset) =>
  preset.variants.map((variant) => [variant.id, preset, variant] as [string, Preset, Variant]),
);

export async function volumeOf({ source }: Example): Promise<Volume> {
  if ('shape' in source) return new Volume(shapeVoxels(source.shape));
  return Volume.parse(new Uint8Array(await readFile(at('www/public/data', source.file))));
}

/** Outcomes by figure and number of levels; each is computed once. */
const outcomes = new Map<string, ReturnType<typeof run>>();

/** Runs a figure with its number of levels, or another; the caller has initialised the package. */
export function outcomeOf(preset: Preset, variant: Variant, levels = preset.levels): ReturnType<typeof run> {
  const key = `${variant.id} ${levels}`;
  const outcome = outcomes.get(key) ?? run(preset, variant, levels);
  outcomes.set(key, outcome);
  return outcome;
}

async function run(preset: Preset, variant: Variant, levels: number | undefined) {
  const volume = await volumeOf(preset);
  const params = { ...preset.params, ...variant.params };
  const start =
    preset.start.kind === 'bubbles'
      ? { bubbles: preset.start.bubbles }
      : preset.start.kind === 'isosurface'
        ? { marchingCubes: params.iso }
        : ('enclosing' as const);
  const edge = preset.edge === undefined ? {} : { edge: preset.edge };
  const model = new DeformableModel({ volume, start, levels, ...edge, params });
  try {
    let work = 0;
    const onStep = ({ vertices }: StepReport) => {
      work += vertices;
    };
    const report = await model.run({ maxIterations: 3000, onStep });
    expect(report.done).toBe(true);
    expect(model.mesh.check()).toMatchObject({ closed: true, oriented: true });
    expect(model.mesh.warnings).toEqual([]);
    const { vertices, components, genus, area, volume: inside } = model.mesh.info();
    // `work`: number of vertices, summed over all steps.
    return { iterations: report.iteration, vertices, components, genus, area, volume: inside, work };
  } finally {
    model.free();
    volume.free();
  }
}

/** Asserts the stated topology, and counts within a tenth, since the model may improve or degrade slightly. */
export function expectOutcome(found: Outcome, said: Outcome) {
  const { iterations, vertices, components, genus } = found;
  expect({ components, genus }).toEqual({ components: said.components, genus: said.genus });
  expect(vertices / said.vertices).toBeGreaterThan(0.9);
  expect(vertices / said.vertices).toBeLessThan(1.1);
  expect(iterations / said.iterations).toBeGreaterThan(0.75);
  expect(iterations / said.iterations).toBeLessThan(1.25);
}

/** Returns a figure, and its first picture. */
export function figure(id: string): [Preset, Variant] {
  const preset = PRESETS.find((one) => one.id === id);
  if (!preset) throw new Error(`there is no ${id}`);
  return [preset, preset.variants[0]];
}
