import { toFailure } from '../../engine/failure';
import type { History, HistoryMark } from '../../kit/history';
import type { Moments } from '../../lab/session/moments';
import type { LabStates } from '../../lab/states';
import { type SavedMoment, UndoHistory } from '../../lab/undo-history';
import { text } from '../../texts';
import type { SculptClient } from './client';
import { samePose } from './ellipsoids';
import type { Film } from './film';
import type { SculptParts } from './parts';
import type { FrameEvent, ParamValues, Pose, SavedPose, Support } from './protocol';

/** The page's part of a saved state; the worker saves the model. Undo restores both. */
interface PageState {
  names: string[];
  posed: boolean;
  film: Film | undefined;
  mark: (iteration: number) => HistoryMark;
}

export type SculptMoments = Moments<SavedMoment<PageState, SavedPose>>;

/** The settings that a scene (meshes and ellipsoids) of the Sculpt lab opens with. */
export interface Adopted {
  support: Support;
  /** The ellipsoids with which the model was built. */
  start: Pose;
  pose: Pose;
  names: string[];
  /** Whether the pose of the ellipsoids was set by hand, rather than by the example, so that links must contain it. */
  posed: boolean;
  /** Whether the example moves its ellipsoids when it opens, so that links must contain the start pose, too. */
  opensPosed: boolean;
  film: Film | undefined;
  params: ParamValues;
}

/**
 * Manages the ellipsoids, film and parameters of the Sculpt lab: changes them, sends them to the worker, and undoes
 * changes.
 */
export class SculptSettings {
  readonly #client: SculptClient;
  readonly #ui: SculptParts;
  readonly #states: LabStates;
  readonly #history: History;
  readonly #onChange: () => void;
  readonly #undo: UndoHistory<PageState, SavedPose>;
  #params: ParamValues = {};
  #support: Support = 'membrane';
  #start: Pose = [];
  #pose: Pose = [];
  #names: string[] = [];
  #chosen: number | undefined;
  #posed = false;
  #opensPosed = false;
  #film: Film | undefined;
  #frame = 0;
  /** Id of the last pose sent to the worker; ids count up. */
  #poseId = 0;

  /**
   * `onChange` is called whenever the settings in force may have changed, to display them and to update the page's
   * address.
   */
  constructor(client: SculptClient, ui: SculptParts, states: LabStates, history: History, onChange: () => void) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#history = history;
    this.#onChange = onChange;
    this.#undo = new UndoHistory<PageState, SavedPose>(
      client,
      () => ({ names: this.#names, posed: this.#posed, film: this.#film, mark: history.marker() }),
      (undoable, redoable) => ui.run.transport.showUndo(undoable, redoable),
    );
  }

  get params(): ParamValues {
    return this.#params;
  }

  get support(): Support {
    return this.#support;
  }

  /** The ellipsoids with which the model was built. */
  get start(): Pose {
    return this.#start;
  }

  get pose(): Pose {
    return this.#pose;
  }

  /** Whether the pose of the ellipsoids was set by hand, so that links must contain it. */
  get posed(): boolean {
    return this.#posed;
  }

  get film(): Film | undefined {
    return this.#film;
  }

  get frame(): number {
    return this.#frame;
  }

  get chosen(): number | undefined {
    return this.#chosen;
  }

  /** Returns number and name, for messages, of the ellipsoid with the given index. */
  nameOf(index: number): string {
    const name = this.#names[index];
    return name
      ? text('sculpt.ellipsoidNamed', { number: index + 1, name })
      : text('sculpt.ellipsoid', { number: index + 1 });
  }

  /** Takes over the settings of a newly opened scene, and clears the undo history. */
  adopt({ support, start, pose, names, posed, opensPosed, film, params }: Adopted): void {
    this.#undo.clear();
    this.#support = support;
    this.#start = start;
    this.#pose = pose;
    this.#names = named(names, pose.length);
    this.#posed = posed;
    this.#opensPosed = opensPosed;
    this.#film = film;
    this.#frame = 0;
    this.#chosen = undefined;
    this.#params = params;
    this.show();
  }

  /** Selects the ellipsoid with the given index, or none. */
  choose(index: number | undefined): void {
    const chosen = index !== undefined && index < this.#pose.length ? index : undefined;
    if (chosen !== this.#chosen)
      this.#ui.page.status.say(
        chosen === undefined ? text('sculpt.noneSelected') : text('sculpt.selected', { name: this.nameOf(chosen) }),
      );
    this.#chosen = chosen;
    this.#showPose();
  }

  /**
   * Saves the present state before a change, so that undo can restore it; `label` names the change. Changes with the
   * same `mergeKey`, unless empty, in short succession are undone as one. Returns a function that discards the saved
   * state, to call if the change fails.
   */
  checkpoint(label: string, mergeKey = ''): () => void {
    return this.#undo.checkpoint(label, mergeKey);
  }

  /**
   * Sends the worker a target pose for the ellipsoids, unless settings cannot be changed now. `dragging`: whether the
   * pose is part of a drag that continues; `names` are the ellipsoids' names if some were added or removed.
   */
  send(pose: Pose, dragging: boolean, names = this.#names): void {
    if (!this.#states.canChange) return;
    this.#ui.page.banner.hide();
    this.#pose = pose;
    this.#names = named(names, pose.length);
    this.#posed = true;
    this.#poseId += 1;
    this.#client.post({ kind: 'pose', pose, poseId: this.#poseId, dragging });
    this.#measureLatency(dragging);
    if (this.#chosen !== undefined && this.#chosen >= pose.length) this.#chosen = undefined;
    this.#showPose();
    if (!dragging) this.#onChange();
  }

  /**
   * Records the model's latency from the pose just sent; during a drag, also deforms the displayed surface at once, and
   * records the display latency.
   */
  #measureLatency(dragging: boolean): void {
    const { carrier, latency } = this.#ui;
    const at = performance.now();
    latency.poseSent(this.#poseId, at);
    // After the drawing, which has requested the same animation frame. A surface that holds itself follows otherwise.
    const isCarried = dragging && this.#support === 'membrane';
    if (isCarried && carrier.dragTo(this.#pose, this.#poseId))
      requestAnimationFrame(() => latency.carried(performance.now() - at));
  }

  get names(): string[] {
    return this.#names;
  }

  /** Sets the film and its present frame; the ellipsoids do not move. */
  async setFilm(film: Film | undefined, frame: number): Promise<void> {
    this.#film = film;
    this.#frame = frame;
    this.show();
    await this.#client.request('film', { film, frame });
  }

  /**
   * Takes over the film's present frame and the target pose of the ellipsoids from a frame computed by the model,
   * unless a newer pose has been sent to it.
   */
  follow({ poseId, frame, pose }: FrameEvent, playing: boolean): void {
    if (poseId < this.#poseId) return;
    if (playing && frame !== this.#frame) this.#posed = false;
    this.#frame = frame;
    if (!samePose(pose, this.#pose)) {
      this.#pose = pose;
      this.#names = named(this.#names, pose.length);
    }
    this.#showPose();
    this.#ui.film.show(this.#film, frame);
  }

  /**
   * Returns the page to `pose`, the previous target of the ellipsoids, after the worker has rejected a pose, and shows
   * why.
   */
  reject(pose: Pose, why: string): void {
    this.#pose = pose;
    this.#names = named(this.#names, pose.length);
    this.#showPose();
    this.#ui.ellipsoids.error.value = why;
  }

  /**
   * Sets parameters of the live model; a run continues, and a converged model is resumed. `what` names the change for
   * undo.
   */
  setParams(values: ParamValues, what: string): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return this.show();
      const forget = this.checkpoint(text('labs.changeOf', { name: what }), what);
      try {
        this.#params = await this.#client.request('setParams', values);
        if (this.#states.modelState === 'done') await this.#client.request('settle', undefined);
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail(text('labs.requestFailed'), error);
        this.show();
        this.#ui.page.refuseParam(Object.keys(values)[0] ?? '', message, this.#params);
        return;
      }
      this.show();
    });
  }

  /** Returns the present state and those to undo and redo, for a session; undefined if they cannot be saved. */
  moments(): Promise<SculptMoments | undefined> {
    return this.#undo.moments();
  }

  /** Continues a session, whose scene has been adopted; the model does not move. */
  async resume(moments: SculptMoments): Promise<void> {
    this.#undo.adopt(moments);
    await this.#restore(moments.now.saved, moments.now.page);
    // Sends the surface, its measures and the state.
    await this.#client.request('step', { count: 0 });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      try {
        const moment = await this.#undo.step(way);
        if (moment) await this.#goTo(moment.saved, moment.page);
      } catch (error) {
        this.#states.fail(way === 'undo' ? text('labs.undoFailed') : text('labs.redoFailed'), error);
      }
    });
  }

  /**
   * Has the worker build a new model of the same meshes with the parameters in force, which does not run yet; clears
   * the undo history. The ellipsoids are those of the previous model if that has the same `support`.
   */
  rebuild(support = this.#support): Promise<void> {
    return this.#states.enqueue(async () => {
      const setup = { start: undefined, params: this.#params, pose: undefined, support };
      const ready = await this.#client.request('rebuild', setup);
      this.#undo.clear();
      if (support !== this.#support) [this.#film, this.#chosen] = [undefined, undefined];
      [this.#support, this.#start] = [support, ready.start];
      this.#pose = ready.pose;
      this.#names = named(this.#names, ready.pose.length);
      this.#params = ready.params;
      this.#posed = this.#opensPosed;
      this.#frame = 0;
      await this.#client.request('film', { film: this.#film, frame: 0 });
      this.show();
    });
  }

  /** Shows the settings in force on the page: ellipsoids, film and parameters. */
  show(): void {
    this.#showPose();
    this.#ui.film.show(this.#film, this.#frame);
    this.#onChange();
  }

  async #goTo(saved: SavedPose, page: PageState): Promise<void> {
    await this.#restore(saved, page);
    await this.#client.request('settle', undefined);
  }

  async #restore(saved: SavedPose, page: PageState): Promise<void> {
    this.#names = page.names;
    this.#posed = page.posed;
    this.#film = page.film;
    this.#frame = saved.frame;
    this.#history.rewind(page.mark(saved.iteration));
    await this.#client.request('film', { film: page.film, frame: saved.frame });
    // The worker has restored this state already; the reply contains its settings.
    const ready = await this.#client.request('restore', saved);
    this.#params = ready.params;
    this.#pose = ready.pose;
    this.show();
  }

  #showPose(): void {
    this.#ui.view.showEllipsoids(this.#pose, this.#chosen);
    this.#ui.ellipsoids.show(this.#pose, this.#names, this.#chosen);
  }
}

/** Returns the names of `count` ellipsoids: `names`, cut off or filled up with empty ones. */
function named(names: string[], count: number): string[] {
  return Array.from({ length: count }, (_, k) => names[k] ?? '');
}
