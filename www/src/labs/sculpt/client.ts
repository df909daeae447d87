import { Channel } from '../../engine/channel';
import type { Pose, PoseMessage, Requests, ShownMessage, WorkerEvent } from './protocol';

/**
 * Starts the Sculpt lab's web worker, which runs the model; called by the lab's client, or earlier by `preloadWorker`.
 */
export const spawnSculpt = () =>
  new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'vesicle sculpt' });

/** The page's client of the Sculpt lab's worker: sends requests to it and receives its replies and events. */
export class SculptClient extends Channel<Requests, WorkerEvent> {
  #lastPoseId = 0;

  constructor(onEvent: (event: WorkerEvent) => void) {
    super(spawnSculpt, onEvent);
  }

  /** Tells the worker that the frame with this serial number is on the screen, so that it may send another. */
  acknowledge(serial: number): void {
    const message: ShownMessage = { kind: 'shown', serial };
    this.post(message);
  }

  /**
   * Sends a target pose of the ellipsoids to the worker; `dragging`: the pose is part of a drag that continues. Returns
   * the pose's number, which frames computed after its arrival report as `poseId`.
   */
  pose(pose: Pose, dragging: boolean): number {
    this.#lastPoseId += 1;
    const message: PoseMessage = { kind: 'pose', pose, poseId: this.#lastPoseId, dragging };
    this.post(message);
    return this.#lastPoseId;
  }
}
