/** The figures of the paper: results are as the page says. Run with the package in Node, which gives the same bits. */
import { readFile } from 'node:fs/promises';
import { beforeAll, expect, test } from 'vitest';
import init, { DeformableModel, Mesh, type StepReport, Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import type { Example } from '../../www/src/examples';
import { type Outcome, PRESETS, type Preset, type Variant } from '../../www/src/presets';
import { shapeVoxels } from '../../www/src/shapes';

beforeAll(() => init());

const CASES = PRESETS.flatMap((preset) =>
  preset.variants.map((variant) => [variant.id, preset, variant] as [string, Preset, Variant]),
);

async function volumeOf({ source }: Example): Promise<Volume> {
  if ('shape' in source) return new Volume(shapeVoxels(source.shape));
  return Volume.parse(new Uint8Array(await readFile(at('www/public/data', source.file))));
}

/** Outcomes by figure and number of levels; each is computed once. */
const outcomes = new Map<string, ReturnType<typeof run>>();

function outcomeOf(preset: Preset, variant: Variant, levels = preset.levels): ReturnType<typeof run> {
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
    const { vertices, components, genus, area, volume: inside } = model.mesh.info();
    // `work`: number of vertices, summed over all steps.
    return { iterations: report.iteration, vertices, components, genus, area, volume: inside, work };
  } finally {
    model.free();
    volume.free();
  }
}

/** Asserts the stated topology, and counts within a tenth, since the model may improve or degrade slightly. */
function expectOutcome(found: Outcome, said: Outcome) {
  const { iterations, vertices, components, genus } = found;
  expect({ components, genus }).toEqual({ components: said.components, genus: said.genus });
  expect(vertices / said.vertices).toBeGreaterThan(0.9);
  expect(vertices / said.vertices).toBeLessThan(1.1);
  expect(iterations / said.iterations).toBeGreaterThan(0.75);
  expect(iterations / said.iterations).toBeLessThan(1.25);
}

test.each(CASES)('figure %s gives the result that the page states', async (_, preset, variant) => {
  expectOutcome(await outcomeOf(preset, variant), variant.expected);
});

test("every figure has an id of its own, and states the paper's result and its own", () => {
  expect(new Set(PRESETS.map(({ id }) => id)).size).toBe(PRESETS.length);
  for (const [, { paperResult }, { ourResult }] of CASES) {
    for (const text of [paperResult, ourResult]) expect(text).toMatch(/^[A-Z].{40,}\.$/);
    expect(ourResult).toMatch(/^Here/);
  }
});

test('table 1: both runs give the same result, within the bounds of the paper', async () => {
  const [preset, variant] = figure('figure-15-16');
  const coarseToFine = await outcomeOf(preset, variant);
  const direct = await outcomeOf(preset, variant, 0);
  expect([direct.components, direct.genus]).toEqual([coarseToFine.components, coarseToFine.genus]);
  expect(Math.abs(coarseToFine.area / direct.area - 1)).toBeLessThan(0.003);
  expect(Math.abs(coarseToFine.volume / direct.volume - 1)).toBeLessThan(0.002);
  expect(direct.work).toBeGreaterThan(3 * coarseToFine.work);
});

test('table 2: a direct run finds the separate vessels that coarse to fine loses', async () => {
  const [preset, variant] = figure('figure-20');
  const coarseToFine = await outcomeOf(preset, variant);
  const direct = await outcomeOf(preset, variant, 0);
  expect([coarseToFine.components, direct.components]).toEqual([1, 4]);
  expect(direct.volume / coarseToFine.volume).toBeGreaterThan(1.015);
  expect(direct.volume / coarseToFine.volume).toBeLessThan(1.025);
});

test('figure 23: marching cubes have as many components and holes as stated', async () => {
  const [preset] = figure('figure-23');
  const volume = await volumeOf(preset);
  const mesh = Mesh.marchingCubes(volume, preset.params.iso);
  expect(mesh.info()).toMatchObject({ components: 372, genus: 383 });
  mesh.free();
  volume.free();
});

function figure(id: string): [Preset, Variant] {
  const preset = PRESETS.find((one) => one.id === id);
  if (!preset) throw new Error(`there is no ${id}`);
  return [preset, preset.variants[0]];
}
