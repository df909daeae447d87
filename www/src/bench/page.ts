/** Benchmarks of the app itself: start-up time, frame rate and memory. */
import { count } from '../ui/format';
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
    figure(`${name}, ${count(triangles)} triangles`, fps, atLeast(30));
  const held = {
    'the page’s objects': memory.heap,
    'its arrays': memory.arrays,
    'the module': memory.wasm,
    GPU: memory.gpu,
  };
  return {
    id: 'page',
    title: 'The app',
    measured:
      'The built app, drawn in software: its start, the longest task that holds up its main thread while a model runs, the view turned by hand, and what is held in memory when the head is done.',
    command: 'npm run bench -- page',
    notes: [],
    charts: [
      {
        ...{ title: 'Start', unit: 's', kind: 'linear' },
        figures: [
          seconds('Controls can be used, first visit', cold.interactive, atMost(1)),
          seconds('Controls can be used, later visits', warm.interactive, atMost(1)),
          seconds('First surface, first visit', cold.surface),
          seconds('First surface, later visits', warm.surface),
        ],
      },
      {
        ...{ title: 'Longest task while a model runs', unit: 'ms', kind: 'linear' },
        figures: runs.map(({ name, longest }) => figure(`Longest task, ${name}`, longest, atMost(50))),
      },
      {
        ...{ title: 'Turning the view (more is better)', unit: 'frames/s', kind: 'linear' },
        figures: [
          turning('View turned, model at rest', motion.resting),
          turning('View turned, model running', motion.running),
        ],
      },
      {
        ...{ title: 'Memory', unit: 'MB', kind: 'linear' },
        figures: Object.entries(held).flatMap(([name, bytes]) =>
          bytes === undefined ? [] : [figure(name, bytes / 1e6)],
        ),
      },
    ],
  };
}
