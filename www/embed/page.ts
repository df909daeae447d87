// Shared by the live pages and independent of Vesicle: the status line.
import type { StepReport } from 'vesicle';

const line = document.querySelector<HTMLElement>('[data-state]');

function state(name: 'running' | 'done' | 'error', text: string): void {
  if (line) [line.dataset.state, line.textContent] = [name, text];
}

/**
 * Shows the progress of a step in the status line; resolves at the next animation frame, which lets the browser draw.
 */
export function shown({ iteration, phase, vertices, components }: StepReport): Promise<unknown> {
  const parts = components === 1 ? '1 component' : `${components} components`;
  state('running', `Step ${iteration}, ${phase}: ${vertices.toLocaleString('en')} vertices, ${parts}`);
  return new Promise(requestAnimationFrame);
}

/** Runs the page's work, and shows in the status line how it ended: the final counts, or the error message. */
export function page(work: () => Promise<StepReport>): Promise<void> {
  return status(async (say) => {
    const { iteration, vertices } = await work();
    say(`Converged after ${iteration} steps: ${vertices.toLocaleString('en')} vertices.`);
  });
}

/** Runs the work of a page that waits for its user; what it says is shown in the status line, and its error. */
export async function status(work: (say: (text: string) => void) => Promise<void>): Promise<void> {
  try {
    await work((text) => state('done', text));
  } catch (error) {
    state('error', error instanceof Error ? error.message : String(error));
  }
}
