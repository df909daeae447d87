/** Parts of the Sculpt lab that need no browser. */
import { beforeAll, describe, expect, test } from 'vitest';
import init, { type ControlEllipsoid, Mesh, MultiresolutionModel } from '../../pkg/index.js';
import { SurfaceCarrier } from '../../www/src/labs/sculpt/carrier';
import { deformPoints } from '../../www/src/labs/sculpt/deform';
import { DragLatency } from '../../www/src/labs/sculpt/drag-latency';
import {
  ball,
  between,
  boxOf,
  lengthsOf,
  moved,
  samePose,
  scaled,
  turned,
  turnedAbout,
  upright,
} from '../../www/src/labs/sculpt/ellipsoids';
import { SCENES, viewOf } from '../../www/src/labs/sculpt/examples';
import { type Film, lastFrame, poseAt } from '../../www/src/labs/sculpt/film';
import { fitted, principalAxes } from '../../www/src/labs/sculpt/fit';
import { filmOf, fromHash, linkOf, toHash } from '../../www/src/labs/sculpt/link';
import { Preview } from '../../www/src/labs/sculpt/preview';

beforeAll(() => init());

const LONG = upright([1, 2, 3], [3, 2, 1]);

function expectClose(one: ControlEllipsoid, other: ControlEllipsoid): void {
  const numbers = ({ center, axes }: ControlEllipsoid) => [...center, ...axes.flat()];
  const [a, b] = [numbers(one), numbers(other)];
  for (const [i, value] of a.entries()) expect(value).toBeCloseTo(b[i] ?? Number.NaN, 9);
}

describe('ellipsoids', () => {
  test('a full turn changes nothing, and axes keep their lengths', () => {
    const about: [number, number, number] = [0.6, 0, 0.8];
    expect(lengthsOf(turned(LONG, about, 1)).map((x) => Number(x.toFixed(9)))).toEqual([3, 2, 1]);
    expectClose(turned(LONG, about, 2 * Math.PI), LONG);
    expectClose(turnedAbout(turnedAbout(LONG, [5, 0, 1], about, 0.7), [5, 0, 1], about, -0.7), LONG);
  });

  test('interpolation halves the translation and the rotation, and takes the geometric mean of lengths', () => {
    const end = scaled(turned(moved(LONG, [2, 0, 0]), [0, 0, 1], 1.2), [4, 1, 1]);
    expectClose(between(LONG, end, 0.5), scaled(turned(moved(LONG, [1, 0, 0]), [0, 0, 1], 0.6), [2, 1, 1]));
    for (const half of [Math.PI, -Math.PI])
      expectClose(between(LONG, turned(LONG, [0, 1, 0], half), 1), turned(LONG, [0, 1, 0], half));
    expect(lengthsOf(between(LONG, turned(LONG, [0, 1, 0], Math.PI), 0.5))[0]).toBeCloseTo(3, 9);
  });

  test('their bounding box is tight', () => {
    expect(boxOf([LONG, ball(-5, 0, 0, 1)])).toEqual({ min: [-6, -1, -1], max: [4, 4, 4] });
  });

  test('rounding in a link keeps poses equal, moving by a hundredth does not', () => {
    expect(samePose([LONG], [moved(LONG, [1e-6, 0, 0])])).toBe(true);
    expect(samePose([LONG], [moved(LONG, [0.01, 0, 0])])).toBe(false);
    expect(samePose([LONG], [LONG, LONG])).toBe(false);
  });
});

describe('animations', () => {
  const film: Film = { keys: [[LONG], [moved(LONG, [1, 0, 0])], [ball(0, 0, 0, 1)]], between: 10, loop: false };

  test('pass through their keyframes, and a loop returns to the first', () => {
    expect(lastFrame(film)).toBe(20);
    for (const [k, key] of film.keys.entries()) expect(poseAt(film, 10 * k)).toEqual(key);
    const loop = { ...film, loop: true };
    expect(lastFrame(loop)).toBe(30);
    expect(poseAt(loop, 30)).toEqual(film.keys[0]);
  });

  test('of lava end where they began, and have no jumps', () => {
    const lava: Film = { motion: 'lava', loop: false };
    const last = lastFrame(lava);
    expect(samePose(poseAt(lava, 0), poseAt(lava, last))).toBe(true);
    for (let frame = 0; frame < last; frame++) {
      const [now, next] = [poseAt(lava, frame), poseAt(lava, frame + 1)];
      for (const [k, { center }] of now.entries())
        expect(Math.hypot(...center.map((x, i) => x - (next[k]?.center[i] ?? 0)))).toBeLessThan(0.12);
    }
  });
});

describe('fitted ellipsoids', () => {
  test('of a rod lie in a row inside it, and a model can be made of them', () => {
    const round = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 });
    const { positions, indices } = round.arrays();
    const rod = Mesh.fromArrays(
      positions.map((x, i) => (i % 3 === 1 ? 4 * x : x)),
      indices,
    );
    const row = fitted(rod);
    expect(row.length).toBeGreaterThan(2);
    const { min, max } = boxOf(row);
    for (let k = 0; k < 3; k++) {
      expect(min[k]).toBeGreaterThan(k === 1 ? -4.3 : -1.2);
      expect(max[k]).toBeLessThan(k === 1 ? 4.3 : 1.2);
    }
    expect(max[1] - min[1]).toBeGreaterThan(6);
    const model = new MultiresolutionModel({ detail: rod, ellipsoids: row, support: 'membrane' });
    expect(model.step(1).components).toBe(1);
    for (const one of [model, rod, round]) one.free();
  });

  test('principal axes are orthogonal, the longest first', () => {
    const [a, b, c] = principalAxes([2, 1, 0, 1, 3, 0.5, 0, 0.5, 9]);
    expect(Math.abs(a?.[2] ?? 0)).toBeGreaterThan(0.9);
    const dot = (x = [0], y = [0]) => x.reduce((sum, value, k) => sum + value * (y[k] ?? 0), 0);
    for (const [x, y] of [
      [a, b],
      [b, c],
      [c, a],
    ] as const)
      expect(dot(x, y)).toBeCloseTo(0, 9);
    for (const x of [a, b, c]) expect(dot(x, x)).toBeCloseTo(1, 9);
  });
});

describe('links', () => {
  const settings = {
    ...{
      file: '',
      usual: { smoothing: 10 },
      params: { smoothing: 10 },
      view: viewOf(undefined),
    },
    ...{ support: 'membrane' as const, start: [] },
  };
  const [bust] = SCENES;

  test('of the first scene in its initial state have no parameters', () => {
    expect(toHash(linkOf({ ...settings, example: bust, pose: undefined, film: bust.film }))).toBe('#sculpt');
  });

  test('restore pose, animation and parameters', () => {
    const film: Film = { keys: [[LONG], [ball(0, 1, 0, 2)]], between: 12, loop: true };
    const pose = [turned(LONG, [0, 1, 0], 0.3), ball(0, 0, 0, 1)];
    const hash = toHash(linkOf({ ...settings, params: { smoothing: 4 }, example: bust, pose, film }));
    const linked = fromHash(hash);
    expect(linked?.params).toEqual({ smoothing: 4 });
    expect(linked?.pose?.length).toBe(2);
    expect(linked?.pose?.[0]?.axes[0][0]).toBeCloseTo(3 * Math.cos(0.3), 3);
    expect(linked && filmOf(linked, bust.film)).toEqual(film);
  });

  test('of files say what supports the surface, and which ellipsoids leave it as it is', () => {
    const file = { ...settings, file: 'cow.obj', example: undefined, film: undefined };
    expect(toHash(linkOf({ ...file, pose: undefined }))).toBe('#sculpt?file=cow.obj&support=membrane');
    const surface = { ...file, support: 'surface' as const, start: [LONG] };
    expect(toHash(linkOf({ ...surface, pose: undefined }))).toBe('#sculpt?file=cow.obj&support=surface');
    const linked = fromHash(toHash(linkOf({ ...surface, pose: [moved(LONG, [1, 0, 0])] })));
    expect(linked).toMatchObject({ support: 'surface', rest: [LONG], pose: [moved(LONG, [1, 0, 0])] });
    expect(fromHash('#sculpt?file=cow.obj&support=pillar')).toEqual({
      ...{ params: {}, file: 'cow.obj', view: {} },
      unread: ['support=pillar'],
    });
  });

  test('with invalid parts are read as far as possible', () => {
    expect(fromHash('#sculpt?pose=1,2;3&key=x&between=-4&layout=row')).toEqual({
      ...{ params: {}, view: { layout: 'row' } },
      unread: ['between=-4', 'pose=1,2;3', 'key=x'],
    });
    expect(fromHash('#extract?example=bust')).toBeUndefined();
  });
});

describe('drag latency', () => {
  test('is measured from the oldest pose that a frame follows', () => {
    const answers = new DragLatency();
    answers.poseSent(1, 100);
    answers.poseSent(2, 110);
    expect(answers.frameDrawn(0, 120)).toBe(false);
    expect(answers.frameDrawn(2, 150)).toBe(true);
    expect(answers.last).toEqual({ milliseconds: 50, frames: 2 });
    expect(answers.frameDrawn(2, 160)).toBe(false);
  });
});

describe('extrapolated display of a surface', () => {
  const points = Float32Array.of(2.5, 0, 0, 0, 1.5, 0.5, -1, -1, 4, 40, 3, 2);
  const pair = [LONG, ball(-6, 0, 0, 1)];

  test('moves rigidly with ellipsoids that move alike', () => {
    const after = pair.map((one) => moved(turnedAbout(one, [0, 0, 0], [0, 0, 1], Math.PI / 2), [1, 2, 3]));
    const expected = [1, 4.5, 3, -0.5, 2, 3.5, 2, 1, 7, -2, 42, 5];
    for (const [i, x] of deformPoints(points, pair, after).entries()) expect(x).toBeCloseTo(expected[i] ?? 0, 4);
  });

  test('moves with the nearest ellipsoid, and stays with one that does not move', () => {
    const on = Float32Array.of(4, 2, 3, -6, 1, 0);
    const out = deformPoints(on, pair, [moved(LONG, [0, 0, 1]), ball(-6, 0, 0, 1)]);
    expect(out[2]).toBeGreaterThan(3.95);
    expect(out[2]).toBeLessThanOrEqual(4);
    expect(Math.abs(out[5] ?? 1)).toBeLessThan(0.05);
    expect(deformPoints(on, [LONG], [scaled(LONG, [2, 2, 2])]).slice(0, 3)).toEqual(Float32Array.of(7, 2, 3));
  });

  test('equals a first step of the model', () => {
    const [start, end] = [ball(0, 0, 0, 1), moved(ball(0, 0, 0, 1), [0.2, 0, 0])];
    const model = new MultiresolutionModel({ ellipsoids: [start], params: { edgeMin: 0.1, edgeMax: 0.25 } });
    while (!model.step(1).done);
    const before = model.mesh.arrays().positions.slice();
    model.setEllipsoids([end]);
    const [now] = model.ellipsoids;
    model.step(1);
    const after = deformPoints(before, [now ?? start], model.ellipsoids);
    const size = (list: Float32Array) => Math.max(...list.filter((_, i) => i % 3 === 0));
    expect(size(after)).toBeCloseTo(size(model.mesh.arrays().positions), 1);
    model.free();
  });

  /** Records the positions that are drawn. */
  function ahead() {
    const drawn: (number | undefined)[] = [];
    const view = { move: (_: string, positions: Float32Array) => drawn.push(positions[0]) };
    return { drawn, ahead: new SurfaceCarrier(view as unknown as ConstructorParameters<typeof SurfaceCarrier>[0]) };
  }

  /** Returns a frame with one point on a ball at x that moves to `goal`. */
  function frame(x: number, goal: number, poseId: number) {
    const one = { positions: Float32Array.of(x + 1, 0, 0), vertices: 1, origin: [0, 0, 0] };
    const event = { result: one, ellipsoids: [ball(x, 0, 0, 1)], pose: [ball(goal, 0, 0, 1)], poseId };
    return event as unknown as Parameters<SurfaceCarrier['frameShown']>[0];
  }

  test('follows the pointer while the model lags behind, and equals the model once it has caught up', () => {
    const { drawn, ahead: one } = ahead();
    expect(one.dragTo([ball(1, 0, 0, 1)], 1)).toBe(false);
    one.frameShown(frame(0, 0, 0));
    expect(one.dragTo([ball(2, 0, 0, 1)], 2)).toBe(true);
    one.frameShown(frame(0.5, 1, 1));
    one.frameShown(frame(1, 2, 2));
    expect(drawn.map((x) => Math.fround(x ?? Number.NaN))).toEqual([2, 3, 3, 3]);
    one.frameShown(frame(2, 2, 2));
    one.frameShown(frame(2.5, 3, 2));
    expect(drawn).toHaveLength(4);
  });

  test('ends when other input moves the ellipsoids, when ellipsoids are added or removed, and at rest', () => {
    const { drawn, ahead: one } = ahead();
    one.frameShown(frame(0, 0, 0));
    one.dragTo([ball(2, 0, 0, 1)], 1);
    one.frameShown(frame(0.5, -7, 1));
    one.frameShown(frame(1, -7, 1));
    expect(drawn).toEqual([3]);
    expect(one.dragTo([ball(2, 0, 0, 1), ball(5, 0, 0, 1)], 2)).toBe(false);
    one.dragTo([ball(4, 0, 0, 1)], 3);
    one.stop();
    one.stop();
    expect(drawn).toEqual([3, 5, 2]);
  });
});

describe('the preview', () => {
  test('is coarse only during a drag with slow frames, and restores all parameters', () => {
    const set = { edgeMin: 0.1, edgeMax: 0.25, supersample: 2 };
    const model = new MultiresolutionModel({ ellipsoids: [ball(0, 0, 0, 1)], params: set });
    const preview = new Preview();
    preview.prepare(model, 'path', 200);
    expect(model.params).toMatchObject({ ...set, supersample: 0 });
    preview.prepare(model, 'none', 10);
    expect(preview.on).toBe(false);
    expect(model.params).toMatchObject(set);
    preview.prepare(model, 'drag', 10);
    expect(model.params).toMatchObject({ ...set, supersample: 0 });
    preview.prepare(model, 'drag', 200);
    preview.prepare(model, 'drag', 200);
    expect(model.params).toMatchObject({ edgeMin: 0.2, edgeMax: 0.5, supersample: 0 });
    preview.prepare(model, 'none', 10);
    expect(model.params).toMatchObject(set);
    model.free();
  });

  test('refuses no pose that the parameters of the user allow', () => {
    // Edges may be 1.6 times as long as the radius of a tip.
    const set = { edgeMin: 0.1, edgeMax: 0.25, supersample: 0 };
    const model = new MultiresolutionModel({ ellipsoids: [ball(0, 0, 0, 1)], params: set });
    const preview = new Preview();
    preview.prepare(model, 'drag', 200);
    expect(model.params).toMatchObject({ edgeMax: 0.5 });
    preview.aim(model, [ball(0, 0, 0, 0.2)]);
    expect(model.params).toMatchObject(set);
    preview.prepare(model, 'drag', 200);
    expect(model.params).toMatchObject(set);
    const { targets } = model;
    expect(() => preview.aim(model, [ball(0, 0, 0, 0.1)])).toThrow('tips of radius 0.1');
    expect(model.targets).toEqual(targets);
    model.free();
  });
});
