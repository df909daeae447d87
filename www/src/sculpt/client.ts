import { Channel } from '../channel';
import type { Pose, PoseMessage, Requests, ShownMessage, WorkerEvent } from './protocol';

export const spawnSculpt = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle sculpt' });

/** The Sculpt lab's worker, from the page. */
export class SculptClient extends Channel<Requests, WorkerEvent> {
  #turn = 0;

  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnSculpt, onEvent);
  }

  /** The frame last sent is on the screen: another may come. */
  shown(): void {
    const message: ShownMessage = { kind: 'shown' };
    this.tell(message);
  }

  /** Sends the ellipsoids on their way; the number that frames will tell of it. */
  pose(pose: Pose, dragging: boolean): number {
    this.#turn += 1;
    const message: PoseMessage = { kind: 'pose', pose, turn: this.#turn, dragging };
    this.tell(message);
    return this.#turn;
  }
}
