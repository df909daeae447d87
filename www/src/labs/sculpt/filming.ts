import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import type { SculptClient } from './client';
import type { Film } from './film';
import { poseAt } from './film';
import type { SculptParts } from './parts';
import type { SculptSettings } from './settings';

/** Duration of a frame in a recorded film, in seconds. */
const FRAME_SECONDS = 1 / 25;

/** Edits the Sculpt lab's film, a motion of the ellipsoids given by keyframes, and records it as a file. */
export class Filming {
  readonly #client: SculptClient;
  readonly #ui: SculptParts;
  readonly #states: LabStates;
  readonly #settings: SculptSettings;

  constructor(client: SculptClient, ui: SculptParts, states: LabStates, settings: SculptSettings) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#settings = settings;
  }

  /** Appends the present pose of the ellipsoids to the film as a keyframe, and makes it the film's present frame. */
  addKey(): void {
    const { film, pose } = this.#settings;
    const known =
      film && 'keys' in film ? film : { keys: [], between: this.#ui.film.between.peek(), loop: film?.loop ?? false };
    const keys = [...known.keys, pose];
    this.#change({ ...known, keys }, text('sculpt.newKeyframeChange'), known.between * (keys.length - 1));
    this.#ui.page.status.say(text('sculpt.keyframeAdded', { number: keys.length }));
  }

  removeKey(index: number): void {
    const { film } = this.#settings;
    if (!film || !('keys' in film)) return;
    const keys = film.keys.filter((_, k) => k !== index);
    this.#change(keys.length > 0 ? { ...film, keys } : undefined, text('sculpt.removedKeyframeChange'), 0);
  }

  setBetween(between: number): void {
    const { film, frame } = this.#settings;
    if (!film || !('keys' in film)) return;
    const at = Math.round((frame / film.between) * between);
    this.#change({ ...film, between }, text('sculpt.betweenChange'), at);
  }

  setLoop(loop: boolean): void {
    const { film, frame } = this.#settings;
    if (film) this.#change({ ...film, loop }, text('sculpt.loopChange'), frame);
  }

  /** Makes a frame the film's present one, and moves the ellipsoids to its pose, without playing the film. */
  seek(frame: number): void {
    const { film } = this.#settings;
    if (!film || !this.#states.canChange) return;
    this.#settings.checkpoint(text('sculpt.frameChange', { frame }), 'seek');
    this.#settings.send(poseAt(film, frame), false);
    void this.#settings.setFilm(film, frame).catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }

  /** Records the whole film as a GLB file with an animated surface, and saves the file. */
  async record(): Promise<void> {
    if (!this.#states.canChange) return;
    this.#ui.film.recording.value = 0;
    this.#ui.page.status.say(text('sculpt.recording'));
    try {
      const bytes = await this.#client.request('record', { frameSeconds: FRAME_SECONDS });
      if (bytes) this.#ui.page.saving.bytes('film.glb', bytes, 'model/gltf-binary');
      else this.#ui.page.status.say(text('sculpt.recordingCancelled'));
    } catch (error) {
      this.#states.fail(text('sculpt.recordingFailed'), error);
    }
    this.#ui.film.recording.value = undefined;
  }

  #change(film: Film | undefined, what: string, frame: number): void {
    if (!this.#states.canChange) return;
    this.#settings.checkpoint(what);
    void this.#settings.setFilm(film, frame).catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }
}
