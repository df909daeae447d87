import type { MultiresolutionModel } from 'vesicle';
import { type Film, glide, lastFrame, poseAt } from './film';
import type { Pose } from './protocol';

/**
 * Sets the model's target pose of the ellipsoids before each step: along a film while it plays, else along a glide, a
 * motion of several frames to the last pose requested.
 */
export class TargetPath {
  #film: Film | undefined;
  /** Present frame of the film, from 0. */
  #frame = 0;
  #playing = false;
  /** Remaining poses of the glide to the last pose requested, one per frame. */
  #glide: Pose[] = [];
  readonly #aim: (model: MultiresolutionModel, pose: Pose) => void;

  /** `aim` sets the model's target pose, or throws if the model rejects it. */
  constructor(aim: (model: MultiresolutionModel, pose: Pose) => void) {
    this.#aim = aim;
  }

  get film(): Film | undefined {
    return this.#film;
  }

  get frame(): number {
    return this.#frame;
  }

  /** Whether a film is playing or poses of a glide remain. */
  get isUnderWay(): boolean {
    return this.#playing || this.#glide.length > 0;
  }

  /**
   * Returns the pose in which the ellipsoids will arrive: the final pose of the glide, or else the model's present
   * target.
   */
  finalTarget(model: MultiresolutionModel): Pose {
    return this.#glide.at(-1) ?? model.targets;
  }

  /** Loads a film and goes to one of its frames, at most the last, without playing it; undefined removes the film. */
  setFilm(film: Film | undefined, frame: number): void {
    this.#film = film;
    this.#frame = film ? Math.min(frame, lastFrame(film)) : 0;
    this.#playing = false;
  }

  /** Plays the film from its present frame, or from the start if it is at its end. */
  play(): void {
    if (!this.#film) return;
    if (this.#frame >= lastFrame(this.#film)) this.#frame = 0;
    this.#playing = true;
    this.#glide = [];
  }

  /** Makes the next call of `next` advance the film by a frame, if one is left; used when the user steps through it. */
  playOne(): void {
    const film = this.#film;
    this.#playing = film !== undefined && (film.loop || this.#frame < lastFrame(film));
    if (this.#playing) this.#glide = [];
  }

  stop(): void {
    this.#playing = false;
  }

  /** Sets the film to another frame, and ends playing and gliding. */
  rewind(frame: number): void {
    this.#frame = frame;
    this.#glide = [];
    this.#playing = false;
  }

  /** Sets the model's target pose at once, as during a drag; ends playing and gliding. */
  jumpTo(model: MultiresolutionModel, pose: Pose): void {
    this.#aim(model, pose);
    this.#glide = [];
    this.#playing = false;
  }

  /** Starts a glide to a pose, frame by frame. Throws at once if the model rejects the pose. */
  glideTo(model: MultiresolutionModel, pose: Pose): void {
    const from = model.targets;
    this.#aim(model, pose);
    this.#aim(model, from);
    this.#glide = glide(from, pose);
    this.#playing = false;
  }

  /** Sets the model's target to the next pose of the film or glide, if there is one; called before each step. */
  next(model: MultiresolutionModel): void {
    const next = this.#playing ? this.#nextOfFilm() : this.#glide.shift();
    if (next) this.#aim(model, next);
  }

  #nextOfFilm(): Pose | undefined {
    const film = this.#film;
    if (!film) return undefined;
    const last = lastFrame(film);
    this.#frame = film.loop ? (this.#frame + 1) % last : Math.min(last, this.#frame + 1);
    if (this.#frame === last) this.#playing = false;
    return poseAt(film, this.#frame);
  }
}
