/** Links to all labs, whatever is in them: settings within bounds, or an error in words. */
import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import type { LabId } from '../../www/src/lab/address';
import { LinkError } from '../../www/src/lab/link-query';
import * as extract from '../../www/src/labs/extract/link';
import * as reconstruct from '../../www/src/labs/reconstruct/link';
import * as sculpt from '../../www/src/labs/sculpt/link';
import * as segment from '../../www/src/labs/segment/link';
import * as track from '../../www/src/labs/track/link';
import { optionsOf, VIEWS } from './made-views';

const numRuns = Number(process.env.PROPERTY_RUNS ?? 500);

const LABS = { extract, reconstruct, sculpt, segment, track } satisfies Record<LabId, unknown>;
const NAMES = [
  ...['example', 'file', 'start', 'frame', 'bubbles', 'levels', 'edge', 'sphere', 'attractor', 'color', 'v', 'p.iso'],
  ...['maxPoints', 'keepComponents', 'photo', 'add', 'outside', 'remove', 'pose', 'key', 'between', 'loop', 'layout'],
  ...['binning', 'factor', 'enrichment', 'box', 'at', 'slices', 'opacity', 'edges', 'votes', 'p.', 'p.__proto__'],
];

const number = fc.oneof(
  fc.double().map(String),
  fc.integer().map(String),
  fc.constantFrom('', 'NaN', '-Infinity', '1e999', '0x10', ' 7 ', '1e-320', '٣', '__proto__', 'true'),
);
const value = fc.oneof(
  number,
  fc.array(number, { maxLength: 14 }).map((list) => list.join(',')),
  fc
    .array(fc.array(number, { maxLength: 13 }), { maxLength: 4 })
    .map((all) => all.map((one) => one.join(',')).join(';')),
  fc.string({ unit: 'binary' }),
  fc.tuple(number, fc.integer({ min: 1, max: 300 })).map(([one, count]) => `${one},`.repeat(count)),
);
const entry = fc.tuple(fc.constantFrom(...NAMES), value, fc.oneof(fc.constant(1), fc.constantFrom(1, 1, 2, 250)));

/** All values within others. */
function* within(value: unknown): Generator<unknown> {
  yield value;
  if (typeof value === 'object' && value !== null)
    for (const [name, one] of Object.entries(value)) {
      yield name;
      yield* within(one);
    }
}

describe.each(Object.entries(LABS))('a link to %s', (lab, { fromHash }) => {
  test('gives settings within bounds, or says what it has too much of', () => {
    const query = fc.oneof(
      fc.array(entry, { maxLength: 12 }).map((entries) => {
        const all = new URLSearchParams();
        for (const [name, text, times] of entries) for (let k = 0; k < times; k++) all.append(name, text);
        return String(all);
      }),
      fc.string({ unit: 'binary', maxLength: 300 }),
    );
    fc.assert(
      fc.property(query, (query) => {
        try {
          const settings = [...within(fromHash(`#${lab}?${query}`))];
          const isBounded = (one: unknown) =>
            typeof one === 'number' ? Number.isFinite(one) : typeof one !== 'string' || one.length <= 200;
          expect(settings.find((one) => !isBounded(one))).toBeUndefined();
          expect(settings.length).toBeLessThan(6000);
        } catch (error) {
          if (!(error instanceof LinkError)) throw error;
          expect(error.message.length).toBeLessThan(300);
        }
        expect(({} as { iso?: unknown }).iso).toBeUndefined();
      }),
      { numRuns },
    );
  });
});

test('settings that a link contains are read as they were', () => {
  const finite = fc.double({ min: -1e300, max: 1e300, noNaN: true }).map((x) => x + 0);
  const point = fc.tuple(finite, finite, finite);
  const linked = fc.record<extract.Linked>(
    {
      example: fc.constantFrom('sponge', 'ovule'),
      frame: fc.nat(),
      levels: fc.nat(9),
      sphere: fc.record({ center: point, radius: finite }),
      params: fc.dictionary(
        fc.constantFrom('iso', 'rigidity', 'x y', 'ü'),
        fc.oneof(finite, fc.constantFrom('euler', 'a=b&c')),
        { minKeys: 1 },
      ),
      view: fc.constant({}),
      attractors: fc.array(fc.record({ point, strength: finite, radius: finite }), { maxLength: 9 }),
    },
    { requiredKeys: ['params', 'attractors', 'view'] },
  );
  const read = (settings: extract.Linked) => {
    expect(extract.fromHash(extract.toHash(settings))).toEqual(settings);
  };
  fc.assert(fc.property(linked, read), { numRuns });
});

/** Each lab's link with nothing but options of its view, to an example. */
const VIEWED = {
  extract: (view: object) => extract.toHash({ example: 'tooth', params: {}, attractors: [], view }),
  reconstruct: (view: object) =>
    reconstruct.toHash({ example: 'torus', params: {}, edits: { added: [], removed: [], outside: [] }, view }),
  sculpt: (view: object) => sculpt.toHash({ example: 'lava', params: {}, view }),
  segment: (view: object) => segment.toHash({ example: 'head', params: {}, view }),
  track: (view: object) => track.toHash({ example: 'heart', params: {}, preparation: {}, view }),
};

test.each(Object.entries(VIEWED))('the options of the view of %s are read as they were', (id, hashOf) => {
  const lab = id as keyof typeof VIEWED;
  const read = (view: object) => {
    expect(LABS[lab].fromHash(hashOf(view))?.view).toEqual(view);
  };
  fc.assert(fc.property<[object]>(optionsOf(VIEWS[lab]), read), { numRuns });
});

test('a value that an option of the view does not have is named', () => {
  expect(segment.fromHash('#segment?opacity=1.5&slices=upright&edges=true')).toMatchObject({
    ...{ view: { edges: true }, unread: ['slices=upright', 'opacity=1.5'] },
  });
});

test('a link of too many characters is refused', () => {
  const hash = `#extract?${'p.iso=1&'.repeat(12_000)}v=2`;
  expect(() => extract.fromHash(hash)).toThrow('A link has at most 30,000 characters, this one 96,003.');
});

test('a link with more attractors than any that the app makes is refused', () => {
  const hash = `#extract?v=2${'&attractor=1,2,3,4,5'.repeat(101)}`;
  expect(() => extract.fromHash(hash)).toThrow('at most 100 of “attractor”, this one 101');
  const attractors = Array.from({ length: 101 }, () => ({ point: [1, 2, 3], strength: 4, radius: 5 }));
  const choice = { kind: 'contour', levels: 1 } as never;
  const settings = { example: undefined, file: 'a.nrrd', frame: 0, choice, params: {}, defaults: {}, view: {} };
  const linked = extract.linkOf({ ...settings, attractors } as never);
  expect(linked.attractors).toEqual([]);
});
