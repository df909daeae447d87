// What the live pages share, and is nothing of Vesicle's: the line that says how it stands.
import type { StepReport } from 'vesicle';

const line = document.querySelector<HTMLElement>('[data-state]');

function state(name: 'running' | 'done' | 'error', text: string): void {
  if (line) [line.dataset.state, line.textContent] = [name, text];
}

/** Says what the surface has become, and lets the browser draw it. */
export function shown({ iteration, phase, vertices, components }: StepReport): Promise<unknown> {
  const parts = components === 1 ? '1 part' : `${components} parts`;
  state('running', `Step ${iteration}, ${phase}: ${vertices.toLocaleString('en')} vertices, ${parts}`);
  return new Promise(requestAnimationFrame);
}

/** Runs the page, and says how it ended. */
export async function page(work: () => Promise<StepReport>): Promise<void> {
  try {
    const { iteration, vertices } = await work();
    state('done', `At rest after ${iteration} steps, ${vertices.toLocaleString('en')} vertices.`);
  } catch (error) {
    state('error', error instanceof Error ? error.message : String(error));
  }
}
