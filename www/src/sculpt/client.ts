import { Channel } from '../channel';
import type { Pose, PoseMessage, Requests, ShownMessage, WorkerEvent } from './protocol';

/** Starts the Sculpt lab's worker. */
export const spawnSculpt = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle sculpt' });

/** The page's client of the Sculpt lab's worker. */
export class SculptClient extends Channel<Requests, WorkerEvent> {
  #lastPoseId = 0;

  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnSculpt, onEvent);
  }

  /** Tells the worker that the frame with this serial number is on the screen. */
  acknowledge(serial: number): void {
    const message: ShownMessage = { kind: 'shown', serial };
    this.post(message);
  }

  /** Sends a target pose of the ellipsoids; returns its number, which the frames that follow it report as `poseId`. */
  pose(pose: Pose, dragging: boolean): number {
    this.#lastPoseId += 1;
    const message: PoseMessage = { kind: 'pose', pose, poseId: this.#lastPoseId, dragging };
    this.post(message);
    return this.#lastPoseId;
  }
}
