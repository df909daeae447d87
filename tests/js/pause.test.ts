// Work that lets other things happen.
import { readFile } from 'node:fs';
import { expect, test } from 'vitest';
import { withPause } from '../../pkg/pause.js';

/** Returns a promise of what happens next after a file is read: timers have their turn later than other callbacks. */
const afterFile = () => new Promise<void>((resolve) => readFile('package.json', () => resolve()));

function work(milliseconds: number): void {
  for (const end = performance.now() + milliseconds; performance.now() < end; );
}

test('a timer that is due aborts work at its next pause, whenever it began', async () => {
  for (let run = 0; run < 5; run++) {
    await afterFile();
    const controller = new AbortController();
    setTimeout(() => controller.abort(), 1);
    const working = withPause(controller.signal, async (pause) => {
      work(20);
      await pause.turn();
    });
    await expect(working).rejects.toMatchObject({ name: 'AbortError' });
  }
});
