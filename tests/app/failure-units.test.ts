// Errors of workers as the page shows them.
import { expect, test } from 'vitest';
import { VesicleError } from '../../pkg/index.js';
import { workerFailure } from '../../www/src/engine/failure';

test('a message has no advice for those who call the library', () => {
  const needs = '9 bytes are needed, more than is left of the 4 GiB of WebAssembly';
  for (const advice of [': free() what is no longer needed', ' (free() what is no longer needed)']) {
    const failure = workerFailure(new VesicleError('too-large', `${needs}${advice}`));
    expect(failure).toEqual({ code: 'too-large', message: needs });
  }
  expect(workerFailure(new VesicleError('bad-file', 'NRRD: (a) sizes: 1'))).toMatchObject({
    message: 'NRRD: (a) sizes: 1',
  });
});
