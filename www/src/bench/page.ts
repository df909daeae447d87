/** Benchmarks of the app itself: start-up time, longest task, frame rate and memory. */

import { count } from '../kit/format';
import { text } from '../texts';
import type { Report } from './report';
import type { Section } from './sections';
import { atLeast, atMost, type Figure, shortHost, type Target } from './targets';

export function pageSection(page: NonNullable<Report['page']>): Section {
  const { host, cold, warm, runs, motion, memory } = page;
  const figure = (name: string, value: number, target?: Target): Figure => ({
    name,
    bars: [{ label: shortHost(host), value }],
    target,
  });
  const seconds = (name: string, milliseconds: number, target?: Target) => figure(name, milliseconds / 1000, target);
  const turning = (name: string, { fps, triangles }: { fps: number; triangles: number }) =>
    figure(text('bench.pageTriangles', { name, triangles: count(triangles) }), fps, atLeast(30));
  const held = {
    [text('bench.pageObjects')]: memory.heap,
    [text('bench.pageArrays')]: memory.arrays,
    [text('bench.pageModule')]: memory.wasm,
    GPU: memory.gpu,
  };
  return {
    id: 'page',
    title: text('bench.pageTitle'),
    measured: text('bench.pageMeasured'),
    command: 'npm run bench -- page',
    notes: [],
    charts: [
      {
        ...{ title: text('bench.pageStart'), unit: 's', kind: 'linear' },
        figures: [
          seconds(text('bench.pageUsableFirst'), cold.interactive, atMost(1)),
          seconds(text('bench.pageUsableLater'), warm.interactive, atMost(1)),
          seconds(text('bench.pageSurfaceFirst'), cold.surface),
          seconds(text('bench.pageSurfaceLater'), warm.surface),
        ],
      },
      {
        ...{ title: text('bench.pageLongestTask'), unit: 'ms', kind: 'linear' },
        figures: runs.map(({ name, longest }) =>
          figure(text('bench.pageLongestTaskOf', { name }), longest, atMost(50)),
        ),
      },
      {
        ...{ title: text('bench.pageRotation'), unit: 'frames/s', kind: 'linear' },
        figures: [
          turning(text('bench.pageRotationResting'), motion.resting),
          turning(text('bench.pageRotationRunning'), motion.running),
        ],
      },
      {
        ...{ title: text('bench.memory'), unit: 'MB', kind: 'linear' },
        figures: Object.entries(held).flatMap(([name, bytes]) =>
          bytes === undefined ? [] : [figure(name, bytes / 1e6)],
        ),
      },
    ],
  };
}
