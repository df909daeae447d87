import type { MultiresolutionModel } from 'vesicle';
import { type Film, glide, lastFrame, poseAt } from './film';
import type { Pose } from './protocol';

/** Where the ellipsoids go, frame by frame: along a film while it plays, else the way to where they were sent. */
export class Course {
  #film: Film | undefined;
  /** The film's frame that the ellipsoids were sent to last. */
  #frame = 0;
  #playing = false;
  /** The poses on the way to where the ellipsoids were sent. */
  #way: Pose[] = [];

  get film(): Film | undefined {
    return this.#film;
  }

  get frame(): number {
    return this.#frame;
  }

  /** There are frames to come. */
  get isUnderWay(): boolean {
    return this.#playing || this.#way.length > 0;
  }

  /** Where the ellipsoids are to be in the end, as far as it is known. */
  goalOf(model: MultiresolutionModel): Pose {
    return this.#way.at(-1) ?? model.goals;
  }

  setFilm(film: Film | undefined, frame: number): void {
    this.#film = film;
    this.#frame = film ? Math.min(frame, lastFrame(film)) : 0;
    this.#playing = false;
  }

  /** From where the film is, from the start where it is at its end. */
  play(): void {
    if (!this.#film) return;
    if (this.#frame >= lastFrame(this.#film)) this.#frame = 0;
    this.#playing = true;
    this.#way = [];
  }

  /** One frame of the film, where there is one left: for those who play it step by step. */
  playOne(): void {
    const film = this.#film;
    this.#playing = film !== undefined && (film.loop || this.#frame < lastFrame(film));
    if (this.#playing) this.#way = [];
  }

  stop(): void {
    this.#playing = false;
  }

  /** The film is at another frame, and nobody is on the way. */
  rewind(frame: number): void {
    this.#frame = frame;
    this.#way = [];
    this.#playing = false;
  }

  /** At once. */
  goTo(model: MultiresolutionModel, pose: Pose): void {
    model.setEllipsoids(pose);
    this.#way = [];
    this.#playing = false;
  }

  /** Frame by frame. A pose that is refused is refused now. */
  glideTo(model: MultiresolutionModel, pose: Pose): void {
    const from = model.goals;
    model.setEllipsoids(pose);
    model.setEllipsoids(from);
    this.#way = glide(from, pose);
    this.#playing = false;
  }

  /** Sends the ellipsoids to where they are in the next frame. */
  next(model: MultiresolutionModel): void {
    const next = this.#playing ? this.#nextOfFilm() : this.#way.shift();
    if (next) model.setEllipsoids(next);
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
