/**
 * The scenes and figures of the Sculpt lab: results are as the page says. Run with the package in Node, which gives the
 * same bits.
 */
import { readFile } from 'node:fs/promises';
import { beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh, MultiresolutionModel, paramSpecs } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { type ExampleMesh, SCENES, type SculptExample } from '../../www/src/labs/sculpt/examples';
import { glide, lastFrame, poseAt } from '../../www/src/labs/sculpt/film';
import { factsOf } from '../../www/src/labs/sculpt/model';
import {
  SCULPT_PRESETS,
  type SculptPreset,
  type SculptVariant,
  variantInForce,
} from '../../www/src/labs/sculpt/presets';
import { plainMesh } from '../../www/src/labs/sculpt/shapes';
import { stagesOf } from '../../www/src/labs/sculpt/stages';
import { LONG } from './long';

beforeAll(() => init());

const CASES = SCULPT_PRESETS.flatMap((preset) =>
  preset.variants.map((variant) => [variant.id, preset, variant] as [string, SculptPreset, SculptVariant]),
);
/** Largest number of frames until the ellipsoids have arrived and the surface has converged. */
const PATIENCE = 80;

async function meshOf(mesh: ExampleMesh | undefined): Promise<Mesh | undefined> {
  if (!mesh) return undefined;
  if ('shape' in mesh) return plainMesh(mesh.shape);
  return Mesh.parse(new Uint8Array(await readFile(at('www/public/data', mesh.file))));
}

async function modelOf({ detail, base, start = [], params }: SculptExample): Promise<MultiresolutionModel> {
  const [finest, coarse] = [await meshOf(detail), await meshOf(base)];
  return new MultiresolutionModel({
    ellipsoids: start,
    params,
    ...(finest && { detail: finest }),
    ...(coarse && { base: coarse }),
  });
}

function expectSound(mesh: Mesh): void {
  expect(mesh.check()).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
}

function expectWithin(found: number, [least, most]: [number, number] = [-1e9, 1e9], what = ''): void {
  expect(found, what).toBeGreaterThanOrEqual(least);
  expect(found, what).toBeLessThanOrEqual(most);
}

const POSED = CASES.filter(([, , { expected }]) => expected);

/** Pictures that take less than a second each. */
const isQuick = (id: string) => ['10a', '10b', '10c'].includes(id);

describe.each(POSED)('figure %s', (id, preset, { pose, expected }) => {
  test('gives the result that the page states', isQuick(id) ? {} : LONG, async () => {
    const model = await modelOf(preset);
    for (const way of pose ? glide(model.targets, pose) : []) {
      model.setEllipsoids(way);
      model.step(1);
    }
    let frames = 0;
    while (!model.step(1).done && frames < PATIENCE) frames += 1;
    expect(frames).toBeLessThan(PATIENCE);
    expectSound(model.mesh);
    expect(model.mesh.warnings).toEqual([]);
    const { folded, areaLow, areaHigh } = factsOf(model);
    expectWithin(model.mesh.info().components, expected?.components, 'components');
    expectWithin(folded, expected?.folded, 'folded');
    expectWithin(areaLow, expected?.areaLow, 'areaLow');
    expectWithin(areaHigh, expected?.areaHigh, 'areaHigh');
    model.free();
  });
});

test('the lava lamp splits and joins, without self-intersections', async () => {
  const lava = SCENES.find(({ id }) => id === 'lava');
  const film = lava?.film;
  if (!lava || !film) throw new Error('there is no lava lamp');
  const model = await modelOf({ ...lava, params: { ...lava.params, edgeMin: 0.14, edgeMax: 0.32 } });
  const counts = new Set<number>();
  for (let frame = 0; frame <= lastFrame(film); frame++) {
    model.setEllipsoids(poseAt(film, frame));
    counts.add(model.step(1).components);
    if (frame % 60 === 0) expectSound(model.mesh);
  }
  expect(counts.size).toBeGreaterThan(1);
  model.free();
});

test("every figure has an id of its own, and states the paper's result and its own", () => {
  expect(new Set(SCULPT_PRESETS.map(({ id }) => id)).size).toBe(SCULPT_PRESETS.length);
  for (const [, { paperResult }, { ourResult }] of CASES) {
    for (const text of [paperResult, ourResult]) expect(text).toMatch(/^\S.{40,}\.$/);
    expect(ourResult).toMatch(/^Here/);
  }
});

test.each(CASES)('the settings of figure %s are recognised as its own', (_, preset, variant) => {
  const usual = Object.fromEntries(paramSpecs('multires').map(({ name, default: value }) => [name, value]));
  const params = { ...usual, ...preset.params, ...variant.params };
  const pose = variant.pose ?? preset.start ?? [];
  expect(variantInForce(preset, pose, params, { ...usual, ...preset.params })?.id).toBe(variant.id);
  expect(variantInForce(preset, pose, { ...params, smoothing: 7 }, { ...usual, ...preset.params })).toBeUndefined();
});

/** Parses the fraction of the worst triangles from the caption of a stage. */
const worstOf = (caption: string) => Number(/below quality ([\d.]+)$/.exec(caption)?.[1]);

test('restructuring improves triangles, and refining does not', () => {
  const [moved = 0, refined = 0, good = 0] = stagesOf('restructuring').map(({ caption }) => worstOf(caption));
  expect(Math.abs(refined - moved)).toBeLessThan(0.15);
  expect(good).toBeGreaterThan(moved + 0.2);
  const passes = stagesOf('passes').map(({ caption }) => worstOf(caption));
  expect(passes.at(-1)).toBeGreaterThan((passes[0] ?? 1) + 0.2);
});
