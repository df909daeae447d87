/** Links and sessions of the Reconstruct lab from before parameters were chosen from the points. */
import { expect, test } from 'vitest';
import { completed } from '../../www/src/labs/reconstruct/before';
import { CLOUDS, PAPER, viewOf } from '../../www/src/labs/reconstruct/examples';
import { fromHash, linkOf, toHash } from '../../www/src/labs/reconstruct/link';
import type { ParamValues } from '../../www/src/labs/reconstruct/protocol';
import type { ReconstructContent } from '../../www/src/labs/reconstruct/schema';

const NONE = { added: [], removed: [], outside: [] };

test('a link to a file without a version means the values of the paper, and a new one those of today', () => {
  expect(fromHash('#reconstruct?file=a.xyz')?.params).toEqual(PAPER);
  expect(fromHash('#reconstruct?file=a.xyz&p.delta=9')?.params).toEqual({ ...PAPER, delta: 9 });
  expect(fromHash('#reconstruct?file=a.xyz&v=2')?.params).toEqual({});
});

test('links to examples state the values of the paper by the examples, with or without a version', () => {
  for (const { params } of CLOUDS) expect(params).toMatchObject(PAPER);
  for (const version of ['', '&v=2'])
    expect(fromHash(`#reconstruct?example=figure-5&p.tau=0.01${version}`)?.params).toEqual({ tau: 0.01 });
});

test('a new link to a file leads to the same parameters', () => {
  const defaults = { delta: 'auto', lambdaSurface: 'auto', lambdaExterior: 'auto', sides: 'auto', tau: 0.025 };
  const choice = { maxPoints: undefined, keepComponents: undefined };
  const usual = { example: undefined, file: 'a.xyz', choice, defaults, edits: NONE, size: 1 };
  for (const changed of [{}, PAPER, { lambdaSurface: 0.004 }]) {
    const params: ParamValues = { ...defaults, ...changed };
    const hash = toHash(linkOf({ ...usual, params, view: viewOf(undefined), photo: undefined }));
    expect({ ...defaults, ...fromHash(hash)?.params }).toEqual(params);
  }
});

test('parameters that a session does not state are those of the paper', () => {
  const setup = { params: { tau: 0.1, delta: 'auto' }, edits: NONE };
  const entry = { label: 'change', bytes: 1, state: { ...setup, choice: {} } };
  const model = { setup, log: { setup, calls: [{ call: 'setParams', given: { tau: 0.2 } }] } };
  const content = { model, undo: [entry], redo: [entry] } as unknown as ReconstructContent;
  const found = completed(content);
  const expected = { ...PAPER, tau: 0.1, delta: 'auto' };
  const settings = [
    found.model.setup,
    found.model.log?.setup,
    ...[...found.undo, ...found.redo].map((one) => one.state),
  ];
  for (const setting of settings) expect(setting?.params).toEqual(expected);
  expect(found.model.log?.calls).toEqual(model.log.calls);
});
