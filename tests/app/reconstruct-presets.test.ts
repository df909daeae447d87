/**
 * The figures of the points paper: results are as the page says. Run with the package in Node, which gives the same
 * bits.
 */
import { readFile } from 'node:fs/promises';
import { beforeAll, describe, expect, test } from 'vitest';
import init, { type Camera, ImplicitSurface, paramSpecs, parsePoints } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { computedCloud } from '../../www/src/labs/reconstruct/clouds';
import { CLOUDS, type CloudExample } from '../../www/src/labs/reconstruct/examples';
import { phi } from '../../www/src/labs/reconstruct/kernel';
import { distances } from '../../www/src/labs/reconstruct/nearest';
import {
  CLOUD_PRESETS,
  type CloudOutcome,
  type CloudPreset,
  type CloudVariant,
  type Count,
  variantInForce,
} from '../../www/src/labs/reconstruct/presets';
import { LONG } from './long';

beforeAll(() => init());

const CASES = CLOUD_PRESETS.flatMap((preset) =>
  preset.variants.map((variant) => [variant.id, preset, variant] as [string, CloudPreset, CloudVariant]),
);

/** Pictures and examples that take about a second each. */
const isQuick = (id: string) => ['3e', '5b', '5c', '7r', '8', '8l', '10', 'torus', 'two-balls'].includes(id);

async function fileOf(name: string): Promise<Uint8Array> {
  return new Uint8Array(await readFile(at('www/public/data', name)));
}

async function camerasOf({ photographs }: CloudExample): Promise<Camera[]> {
  if (!photographs) return [];
  const list = JSON.parse(new TextDecoder().decode(await fileOf(`${photographs}/cameras.json`)));
  const { width, height } = list;
  return list.cameras.map(({ P }: { P: number[][] }) => ({ projection: P.flat(), width, height }));
}

/** Measures of a run. */
type Found = Record<keyof CloudOutcome, number>;

async function outcomeOf(
  example: CloudExample,
  params = example.params,
  maxPoints = example.maxPoints,
): Promise<Found> {
  const { source, keepComponents } = example;
  const { points } = 'shape' in source ? computedCloud(source.shape) : parsePoints(await fileOf(source.file));
  const model = new ImplicitSurface({
    points,
    cameras: await camerasOf(example),
    params,
    ...(maxPoints !== undefined && { maxPoints }),
    ...(keepComponents !== undefined && { keepComponents }),
  });
  try {
    expect((await model.run()).done).toBe(true);
    expect(model.mesh.check()).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
    expect(model.mesh.warnings).toEqual([]);
    const { components, genus } = model.mesh.info();
    const { mean: fitness, meanCurvature } = model.fitness();
    return { components, genus, fitness, meanCurvature };
  } finally {
    model.free();
  }
}

function expectCount(found: number, said: Count) {
  const [least, most] = typeof said === 'number' ? [said, said] : said;
  expect(found).toBeGreaterThanOrEqual(least);
  expect(found).toBeLessThanOrEqual(most);
}

function expectOutcome(found: Found, said: CloudOutcome) {
  expectCount(found.components, said.components);
  expectCount(found.genus, said.genus);
  for (const name of ['meanCurvature', 'fitness'] as const) {
    const value = said[name];
    if (value !== undefined) expect(Math.abs(found[name] / value - 1), name).toBeLessThan(0.1);
  }
}

describe.each(CASES)('figure %s', (id, preset, variant) => {
  test('gives the result that the page states', isQuick(id) ? {} : LONG, async () => {
    const params = { ...preset.params, ...variant.params };
    expectOutcome(await outcomeOf(preset, params, variant.maxPoints ?? preset.maxPoints), variant.expected);
  });
});

test("every figure has an id of its own, and states the paper's result and its own", () => {
  expect(new Set(CLOUD_PRESETS.map(({ id }) => id)).size).toBe(CLOUD_PRESETS.length);
  for (const [, { paperResult }, { ourResult }] of CASES) {
    for (const text of [paperResult, ourResult]) expect(text).toMatch(/^\S.{40,}\.$/);
    expect(ourResult).toMatch(/^Here/);
  }
});

test.each(CASES)('the settings of figure %s are recognised as its own', (_, preset, variant) => {
  const defaults = Object.fromEntries(paramSpecs('implicit').map(({ name, default: value }) => [name, value]));
  const params = { ...defaults, ...preset.params, ...variant.params };
  const maxPoints = variant.maxPoints ?? preset.maxPoints;
  expect(variantInForce(preset, params, maxPoints, defaults)?.id).toBe(variant.id);
  expect(variantInForce(preset, { ...params, lambdaExterior: 7 }, maxPoints, defaults)).toBeUndefined();
});

describe.each(CLOUDS.map((example) => [example.id, example] as const))('%s', (id, example) => {
  test('is one closed surface', isQuick(id) ? {} : LONG, async () => {
    const { components, genus } = await outcomeOf(example);
    expect(components).toBe(id === 'two-balls' ? 2 : 1);
    if (id !== 'angel') expect(genus).toBe(id === 'torus' ? 1 : 0);
  });
});

test('the plotted kernel has the theoretical height, slope and tail', () => {
  for (const [delta, tau] of [
    [5, 0.025],
    [10, 0.01],
    // Here equation 6 of the paper needs complex numbers, and here both roots are equal.
    [40, 0.025],
    [20, 0.025],
  ] as const) {
    const at = (r: number) => phi({ kernel: 'multi-order', delta, tau, sigma: 1 }, r);
    const top = 1 / (4 * Math.PI * delta * Math.sqrt(1 + 2 * delta * tau));
    expect(at(0) / top).toBeCloseTo(1, 9);
    expect(at(1e-5) / top).toBeCloseTo(1, 4);
    expect(at(2) * 4 * Math.PI * delta ** 2 * 2).toBeCloseTo(1, 3);
    for (let r = 0; r < 2; r += 0.01) expect(at(r + 0.01)).toBeLessThan(at(r));
  }
});

test('the nearest of many points is found from any query', () => {
  const { points } = computedCloud('torus');
  const places = Float32Array.of(0, 0, 0, 1, 0, 0.4, -3, 2, 7, ...points.subarray(30, 33));
  const found = distances(places, points);
  for (const [i, distance] of found.entries()) {
    let least = Number.POSITIVE_INFINITY;
    for (let j = 0; j < points.length; j += 3) {
      const [x = 0, y = 0, z = 0] = [0, 1, 2].map((k) => (points[j + k] ?? 0) - (places[3 * i + k] ?? 0));
      least = Math.min(least, Math.hypot(x, y, z));
    }
    expect(distance).toBeCloseTo(least, 5);
  }
  expect(distances(places, new Float32Array(0))[0]).toBe(Number.POSITIVE_INFINITY);
});
