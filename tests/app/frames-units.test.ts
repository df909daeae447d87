/** Buffers and simplified surfaces for rendering, without a browser. */
import { beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh } from '../../pkg/index.js';
import { type FineMesh, simplifiedIndices } from '../../www/src/scene/simplify';

beforeAll(() => init());

const ball = (edge: number) => Mesh.icosphere({ center: [5, 6, 7], radius: 2, maxEdge: edge });

function fineOf(mesh: Mesh): FineMesh {
  const { positions, normals, indices, vertices, triangles } = mesh.snapshot();
  return { positions, normals, indices, vertices, corners: 3 * triangles };
}

describe('a coarse surface', () => {
  test('has about the requested number of triangles, on vertices of the fine one', () => {
    const mesh = ball(0.08);
    const fine = fineOf(mesh);
    for (const wanted of [500, 2000]) {
      const corners = simplifiedIndices(fine, wanted);
      expect(corners.length / 3).toBeGreaterThan(wanted / 2.5);
      expect(corners.length / 3).toBeLessThan(wanted * 2.5);
      expect(Math.max(...corners)).toBeLessThan(fine.vertices);
    }
    mesh.free();
  });

  test('faces outwards and encloses nearly the same volume', () => {
    const mesh = ball(0.08);
    const fine = fineOf(mesh);
    const whole = enclosed(fine.positions, fine.indices.subarray(0, fine.corners));
    expect(enclosed(fine.positions, simplifiedIndices(fine, 1000)) / whole).toBeGreaterThan(0.93);
    expect(enclosed(fine.positions, simplifiedIndices(fine, 1000)) / whole).toBeLessThan(1.01);
    mesh.free();
  });

  test('keeps the two sides of a thin sheet apart', () => {
    const sheet = [0, 0.01].flatMap((z) => gridAt(z, 30));
    const positions = Float32Array.from(sheet);
    const normals = positions.map((_, i) => (i % 3 === 2 ? (i < positions.length / 2 ? -1 : 1) : 0));
    const vertices = positions.length / 3;
    const [below, above] = [gridCorners(30, 0), gridCorners(30, vertices / 2)];
    const indices = Uint32Array.from([...below, ...above]);
    const corners = simplifiedIndices({ positions, normals, indices, vertices, corners: indices.length }, 200);
    expect(corners.length).toBeGreaterThan(100);
    for (let i = 0; i < corners.length; i += 3) {
      const sides = [0, 1, 2].map((k) => (corners[i + k] ?? 0) < vertices / 2);
      expect(new Set(sides).size).toBe(1);
    }
  });
});

function gridAt(z: number, side: number): number[] {
  return Array.from({ length: side * side }, (_, i) => [i % side, Math.floor(i / side), z]).flat();
}

function gridCorners(side: number, first: number): number[] {
  const cells = Array.from({ length: (side - 1) ** 2 }, (_, i) => (i % (side - 1)) + side * Math.floor(i / (side - 1)));
  return cells.flatMap((a) => [a, a + 1, a + side, a + 1, a + side + 1, a + side]).map((corner) => corner + first);
}

/** Returns six times the volume that triangles enclose. */
function enclosed(positions: Float32Array, indices: Uint32Array): number {
  let sum = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) =>
      positions.subarray(3 * (indices[i + k] ?? 0), 3 * (indices[i + k] ?? 0) + 3),
    );
    if (!a || !b || !c) continue;
    const at = (p: Float32Array, k: number) => p[k] ?? 0;
    sum +=
      at(a, 0) * (at(b, 1) * at(c, 2) - at(b, 2) * at(c, 1)) +
      at(a, 1) * (at(b, 2) * at(c, 0) - at(b, 0) * at(c, 2)) +
      at(a, 2) * (at(b, 0) * at(c, 1) - at(b, 1) * at(c, 0));
  }
  return sum;
}
