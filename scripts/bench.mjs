// Runs the benches of all methods in Node and Chromium and, for those that have a native program, natively; measures
// the app in Chromium; and compares with other software. Prints tables and writes bench.json. `npm run bench -- points`
// runs a single bench and writes nothing. `hosts`, `latency` and `tools` run only when they are named; `tools` writes the figures of
// docs/performance.md.
import { readFile, writeFile } from 'node:fs/promises';
import { cpus } from 'node:os';
import { buildApp } from './app.mjs';
import { remeshNatively, stepsNatively } from './bench-native.mjs';
import { comparePeers, peerRows } from './bench-peers.mjs';
import { compareTools, toolRows, writePerformance } from './bench-tools.mjs';
import { build } from './build.mjs';
import { launchChromium } from './chromium.mjs';
import { serve } from './serve.mjs';
import { setup } from './setup.mjs';
import { at, root, script } from './shell.mjs';

const SCAN = 'www/public/data/visible-human-head-full.nii.gz';
const BUST = 'www/public/data/nefertiti.ply';
const REPEATS = 3;

/** The benches and how their results are printed. Each imports its own module, with an empty wasm memory. */
const BENCHES = {
  points: {
    inNode: async () => (await import('../bench/points.mjs')).measure(REPEATS),
    rows: pointRows,
  },
  remesh: {
    native: remeshNatively,
    inNode: async () => (await import('../bench/remesh.mjs')).measure(REPEATS),
    rows: remeshRows,
  },
  voxelise: {
    inNode: async () => (await import('../bench/voxelise.mjs')).measure(REPEATS),
    rows: voxeliseRows,
  },
  strokes: {
    inNode: async () => (await import('../bench/strokes.mjs')).measure(),
    rows: strokeRows,
  },
  skin: {
    file: BUST,
    inNode: async () => (await import('../bench/skin.mjs')).measure(new Uint8Array(await readFile(at(BUST))), REPEATS),
    rows: skinRows,
  },
  track: {
    inNode: async () => (await import('../bench/track.mjs')).measure(REPEATS),
    rows: trackRows,
  },
  steps: {
    native: stepsNatively,
    inNode: async () => (await import('../bench/steps.mjs')).measure(),
    rows: stepRows,
  },
  head: {
    file: SCAN,
    inNode: async () => (await import('../bench/head.mjs')).measure(new Uint8Array(await readFile(at(SCAN))), REPEATS),
    rows: headRows,
  },
  phantom: {
    inNode: async () => (await import('../bench/head.mjs')).measurePhantom(REPEATS),
    rows: headRows,
  },
  page: {
    // Measures the whole app, in a browser only.
    alone: async () => {
      await buildApp();
      return (await import('../bench/page.mjs')).measure(at('dist'), REPEATS);
    },
    rows: pageRows,
  },
  hosts: {
    // For docs/hosts.md; not part of the report.
    apart: true,
    alone: async () => {
      await buildApp();
      return (await import('../bench/hosts.mjs')).measure(at('dist'));
    },
    rows: hostRows,
  },
  latency: {
    // The app's ways from a click or a movement of the pen to the picture; not part of the report.
    apart: true,
    alone: async () => {
      await buildApp();
      return (await import('../bench/latency.mjs')).measure(at('dist'));
    },
    rows: latencyRows,
  },
  tools: {
    // For docs/performance.md; not part of the report.
    apart: true,
    alone: async () => writePerformance(await compareTools(REPEATS)),
    rows: toolRows,
  },
  peers: {
    alone: () => comparePeers(SCAN, REPEATS),
    rows: peerRows,
  },
};

async function inChromium(name) {
  const server = await serve(root);
  const browser = await launchChromium();
  try {
    const page = await browser.newPage();
    await page.goto(`${server.address}bench/index.html`);
    await page.waitForFunction(() => 'measure' in window);
    const given = [name, REPEATS, `/${BENCHES[name].file}`];
    const measured = await page.evaluate(([what, repeats, file]) => window.measure[what](repeats, file), given);
    return { host: `Chromium ${browser.version()}`, ...measured };
  } finally {
    await browser.close();
    await server.close();
  }
}

const seconds = (milliseconds) => `${(milliseconds / 1000).toFixed(2)} s`;

function headRows({ host, cubes, model, ratio }) {
  const parts = Object.entries(model.parts).sort(([, a], [, b]) => b - a);
  return [
    [host, '', ''],
    ['  marching cubes', seconds(cubes.milliseconds), `${cubes.vertices} vertices`],
    ['  deformable model', seconds(model.milliseconds), `${model.vertices} vertices, ${model.iterations} iterations`],
    ['  model / marching cubes', ratio.toFixed(1), model.converged ? 'converged' : 'NOT CONVERGED'],
    ['  self-intersections', String(model.selfIntersections), model.closed ? 'closed' : 'NOT CLOSED'],
    ...parts.map(([part, milliseconds]) => [`    ${part}`, seconds(milliseconds), '']),
  ];
}

function pointRows({ host, few, many, perConstraint, edit, bytes }) {
  const solved = ({ points, exterior, first, solve, residual }) => [
    `  solve ${points} + ${exterior}`,
    seconds(solve),
    `first ${seconds(first.solve)}, residual ${residual.toExponential(1)}`,
  ];
  const extracted = ({ points, first, extract, vertices, components, euler }) => [
    `  extract, ${points} points`,
    seconds(extract),
    `first ${seconds(first.extract)}, ${vertices} vertices, ${components} component, χ ${euler}`,
  ];
  return [
    [host, '', `128 cells along the box; best of ${REPEATS}`],
    ...[solved(few), solved(many), extracted(few), extracted(many)],
    ['  solve per constraint', perConstraint.toFixed(2), 'many to few'],
    ['  solve, one point by hand', edit.toFixed(2), 'of the solve of many'],
    ['  memory', `${(bytes / 1e6).toFixed(0)} MB`, 'of the module, at the end'],
  ];
}

function remeshRows({ host, rows }) {
  const row = ({ name, factor, milliseconds, before, triangles, minAngleDegrees, selfIntersections, distance }) => [
    `  ${name}, edges x ${factor}`,
    `${((1000 * milliseconds) / triangles).toFixed(2)} µs`,
    `a triangle, ${before} to ${triangles}; ${minAngleDegrees.toFixed(0)}° at least, ${distance.toFixed(2)} edges away, ` +
      `${selfIntersections} self-intersections`,
  ];
  return [[host, '', `best of ${REPEATS}`], ...rows.map(row)];
}

function voxeliseRows({ host, sizes }) {
  const row = ({ kind, milliseconds, ratio }) => [
    `  ${kind}`,
    seconds(milliseconds),
    `${ratio.toFixed(2)} of marching cubes of the distances`,
  ];
  const part = ({ size, triangles, rows }) => [
    [`  ${size} x ${size} x ${size}`, '', `from ${triangles} triangles`],
    ...rows.map(row),
  ];
  return [[host, '', `best of ${REPEATS}`], ...sizes.flatMap(part)];
}

function strokeRows({ host, rows }) {
  const row = ({ labels, vertices, median, longest, full }) => [
    `  ${labels === 1 ? 'one label' : `${labels} labels`}, ${vertices} vertices`,
    `${median.toFixed(1)} ms`,
    `longest ${longest.toFixed(1)} ms; marching cubes of all labels ${(full / median).toFixed(1)} times the median`,
  ];
  return [[host, '', 'median of the strokes of a brush, settled'], ...rows.map(row)];
}

function latencyRows({ host, step, stroke }) {
  return [
    [host, '', 'medians'],
    [
      '  step to picture',
      `${step.milliseconds.toFixed(0)} ms`,
      `${step.requests} messages there, ${step.answers} back; ${step.triangles} triangles: ${step.uploads.toFixed(1)} MB to the GPU, ` +
        `${step.copied.toFixed(1)} MB copied before`,
    ],
    [
      '  frame with a movement of the pen',
      `${stroke.frame.toFixed(0)} ms`,
      `${stroke.draws.toFixed(1)} images drawn on slices for each movement`,
    ],
    ['  pen lifted to smooth surfaces', `${stroke.surfaces.toFixed(0)} ms`, `${stroke.requests} messages a stroke`],
  ];
}

function skinRows({ host, rows }) {
  const row = ({ name, milliseconds, mean, longest, triangles, parts }) => {
    const most = Object.entries(parts).toSorted(([, a], [, b]) => b - a);
    const named = most.slice(0, 3).map(([part, took]) => `${part} ${took.toFixed(0)}`);
    return [
      `  ${name}, ${triangles}`,
      `${(1000 / milliseconds).toFixed(1)} /s`,
      `frames; ${milliseconds.toFixed(0)} ms in the middle, ${mean.toFixed(0)} in the mean, ${longest.toFixed(0)} the longest; ` +
        `${named.join(', ')}`,
    ];
  };
  return [[host, '', `the middle of ${20 * REPEATS} frames`], ...rows.map(row)];
}

function trackRows({ host, dims, frames, cubes, run, ratio, trueEjection, bytes }) {
  const percent = (share) => `${(100 * share).toFixed(1)} %`;
  const found = `ejected ${percent(run.ejection)} of ${percent(trueEjection)}, folded ${percent(run.folded)} at most`;
  return [
    [host, '', `${dims.join(' x ')} voxels, ${frames} frames; best of ${REPEATS}`],
    ['  marching cubes', seconds(cubes), 'all frames, as they were measured'],
    ['  enrichment', seconds(run.enrich), 'all frames'],
    ['  votes', seconds(run.votes), `all frames; ${seconds(run.begin)} before them`],
    ['  first frame', seconds(run.first), `up to ${run.triangles} triangles`],
    ['  a tracked frame', seconds(run.frame), `in the middle, ${seconds(run.worst)} the longest`],
    ['  all surfaces', seconds(run.tracked), `and ${seconds(run.closingTime)} back to the first`],
    ['  the whole', seconds(run.milliseconds), found],
    ['  whole / marching cubes', ratio.toFixed(0), `closing ${run.closing.toFixed(2)} mm`],
    ['  self-intersections', String(run.selfIntersections), run.closed ? 'closed' : 'NOT CLOSED'],
    ['  memory', `${(bytes / 1e6).toFixed(0)} MB`, 'of the module, at the end'],
  ];
}

/** Returns rows for mesh sizes, relative to the smallest one and, if given, to the native timings. */
function stepRows({ host, rows }, native) {
  const row = ({ vertices, step, topology }, k) => {
    const remarks = [`${(step / rows[0].step).toFixed(2)} of the smallest`, `topology ${topology.toFixed(1)} ms`];
    if (native) remarks.push(`${(step / native.rows[k].step).toFixed(2)} of native`);
    return [`  ${vertices} vertices`, `${step.toFixed(0)} ns`, `a vertex and step; ${remarks.join(', ')}`];
  };
  return [[host, '', 'all vertices moving, the best of 6 to 36 steps'], ...rows.map(row)];
}

/** Returns rows for start-up, long tasks of the main thread, frame rates, memory and transferred bytes. */
function pageRows({ host, viewport, cold, warm, runs, motion, memory }) {
  const megabytes = (bytes) => `${((bytes ?? 0) / 1e6).toFixed(1)} MB`;
  const milliseconds = (took) => `${took.toFixed(0)} ms`;
  const perSecond = ({ fps }) => `${fps.toFixed(1)} /s`;
  const started = (name, { paint, engine, interactive, surface }) => [
    `  ${name} start`,
    milliseconds(engine),
    `until the engine answers; first paint ${milliseconds(paint)}, a model to play ${milliseconds(interactive)}, ` +
      `first surface ${milliseconds(surface)}`,
  ];
  const held = ({ name, triangles, over, longest, by }) => [
    `  ${name}, ${triangles}`,
    milliseconds(longest),
    `the longest task while it runs, ${over} over 50 ms${by ? `; ${by}` : ''}`,
  ];
  const { frames, sent, onPage, buffers } = memory;
  return [
    [host, '', `${Object.values(viewport).join(' x ')}, ${motion.renderer}; the middle of ${REPEATS} starts`],
    ...[started('cold', cold), started('warm', warm)],
    ...runs.map(held),
    [
      `  turning, ${motion.triangles}`,
      perSecond(motion.resting),
      `frames; ${motion.resting.triangles} drawn meanwhile`,
    ],
    ['  turning, slices alone', perSecond(motion.without), 'frames: what there is without a surface'],
    ['  turning, model runs', perSecond(motion.running), 'frames'],
    ['  memory', megabytes(memory.heap), `heap, ${megabytes(memory.arrays)} arrays, ${megabytes(memory.wasm)} module`],
    [
      '  buffers of the GPU',
      megabytes(memory.gpu),
      `made ${buffers.made} times, filled again ${buffers.refilled} times`,
    ],
    [
      '  sent by the worker',
      megabytes(sent.handedOver),
      `handed over in ${frames} messages, ${megabytes(sent.cloned)} copied`,
    ],
    ['  uploaded', megabytes(onPage.uploaded), `${megabytes(onPage.copied)} copied on the page before`],
  ];
}

function hostRows({ host, rows }) {
  const row = ({ name, vertices, update, draw }) => [
    `  ${name}`,
    `${update.toFixed(1)} ms`,
    `to take over ${vertices} vertices with other triangles; ${draw.toFixed(1)} ms until the page goes on after drawing`,
  ];
  return [[host, '', 'the middle of 30 frames'], ...rows.map(row)];
}

function print(rows) {
  for (const [what, figure, remark] of rows) {
    process.stdout.write(`${what.padEnd(28)}${figure.padStart(10)}  ${remark}\n`);
  }
}

function printed(result, rows) {
  print(rows(result));
  return result;
}

async function run(name) {
  const { alone, native, inNode, rows } = BENCHES[name];
  if (alone) return printed(await alone(), rows);
  const reference = await native?.();
  const results = [{ host: `Node ${process.versions.node}`, ...(await inNode()) }, await inChromium(name)];
  print([...(reference ? rows(reference) : []), ...results.flatMap((result) => rows(result, reference))]);
  return reference ? [reference, ...results] : results;
}

await script(async () => {
  const asked = process.argv.slice(2);
  const unknown = asked.filter((name) => !(name in BENCHES));
  if (unknown.length > 0) throw new Error(`nothing to measure is called ${unknown}; there are ${Object.keys(BENCHES)}`);
  await setup();
  await build();
  const all = {};
  const names = Object.keys(BENCHES).filter((name) => !BENCHES[name].apart);
  for (const name of asked.length > 0 ? asked : names) all[name] = await run(name);
  if (asked.length > 0) return;
  const report = { scan: SCAN, bestOf: REPEATS, processor: cpus()[0]?.model, ...all };
  await writeFile(at('bench.json'), `${JSON.stringify(report, null, 2)}\n`);
});
