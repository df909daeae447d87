import { Channel } from '../channel';
import type { Pose, PoseMessage, Requests, ShownMessage, WorkerEvent } from './protocol';

/** Starts the Sculpt lab's worker. */
export const spawnSculpt = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle sculpt' });

/** The page's client of the Sculpt lab's worker. */
export class SculptClient extends Channel<Requests, WorkerEvent> {
  #turn = 0;

  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnSculpt, onEvent);
  }

  /** Tells the worker that the frame it sent last is on the screen, so that it may send another. */
  shown(): void {
    const message: ShownMessage = { kind: 'shown' };
    this.tell(message);
  }

  /** Sends a target pose of the ellipsoids; returns its number, which the frames that follow it report as `turn`. */
  pose(pose: Pose, dragging: boolean): number {
    this.#turn += 1;
    const message: PoseMessage = { kind: 'pose', pose, turn: this.#turn, dragging };
    this.tell(message);
    return this.#turn;
  }
}
