import { toFailure } from '../channel';
import type { SculptClient } from '../sculpt/client';
import { samePose } from '../sculpt/ellipsoids';
import type { Film } from '../sculpt/film';
import type { FrameEvent, ParamValues, Pose, SavedPose } from '../sculpt/protocol';
import type { History, HistoryMark } from '../ui/history';
import type { LabStates } from './lab-states';
import { Rewinder } from './rewinder';
import type { SculptParts } from './sculpt-parts';

/** What the page holds beside the model, and undo brings back. */
interface PageState {
  names: string[];
  posed: boolean;
  film: Film | undefined;
  mark: (iteration: number) => HistoryMark;
}

/** What a scene opens with. */
export interface Adopted {
  pose: Pose;
  names: string[];
  /** The pose is not the example's own. */
  posed: boolean;
  film: Film | undefined;
  params: ParamValues;
}

/** The ellipsoids, the film and the parameters: changed here, handed to the worker, undone. */
export class ModelSettings {
  readonly #client: SculptClient;
  readonly #ui: SculptParts;
  readonly #states: LabStates;
  readonly #history: History;
  readonly #onChange: () => void;
  readonly #rewinder: Rewinder<PageState, SavedPose>;
  #params: ParamValues = {};
  #pose: Pose = [];
  #names: string[] = [];
  #chosen: number | undefined;
  #posed = false;
  #film: Film | undefined;
  #frame = 0;
  /** The last pose that was sent. */
  #turn = 0;

  /** `onChange` hears whenever something else may be in force. */
  constructor(client: SculptClient, ui: SculptParts, states: LabStates, history: History, onChange: () => void) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#history = history;
    this.#onChange = onChange;
    this.#rewinder = new Rewinder<PageState, SavedPose>(
      client,
      () => ({ names: this.#names, posed: this.#posed, film: this.#film, mark: history.marker() }),
      (undoable, redoable) => ui.transport.showUndo(undoable, redoable),
    );
  }

  get params(): ParamValues {
    return this.#params;
  }

  get pose(): Pose {
    return this.#pose;
  }

  /** Whether the pose is one made by hand. */
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

  /** Of an ellipsoid, in words. */
  nameOf(index: number): string {
    const name = this.#names[index];
    return name ? `Ellipsoid ${index + 1}, ${name}` : `Ellipsoid ${index + 1}`;
  }

  /** Another scene: what was done to the former cannot be undone. */
  adopt({ pose, names, posed, film, params }: Adopted): void {
    this.#rewinder.clear();
    this.#pose = pose;
    this.#names = named(names, pose.length);
    this.#posed = posed;
    this.#film = film;
    this.#frame = 0;
    this.#chosen = undefined;
    this.#params = params;
    this.show();
  }

  choose(index: number | undefined): void {
    const chosen = index !== undefined && index < this.#pose.length ? index : undefined;
    if (chosen !== this.#chosen)
      this.#ui.status.say(chosen === undefined ? 'No ellipsoid is chosen.' : `${this.nameOf(chosen)} is chosen.`);
    this.#chosen = chosen;
    this.#showPose();
  }

  /** Keeps what is, before it is changed. Changes with the same `together` soon after each other are one. */
  remember(label: string, together = ''): () => void {
    return this.#rewinder.remember(label, together);
  }

  /** Sends the ellipsoids on their way. `names` where there are others than before. */
  send(pose: Pose, dragging: boolean, names = this.#names): void {
    if (!this.#states.canChange) return;
    this.#ui.banner.hide();
    this.#pose = pose;
    this.#names = named(names, pose.length);
    this.#posed = true;
    this.#turn = this.#client.pose(pose, dragging);
    this.#answer(dragging);
    if (this.#chosen !== undefined && this.#chosen >= pose.length) this.#chosen = undefined;
    this.#showPose();
    if (!dragging) this.#onChange();
  }

  /** Under a hand the surface on the screen goes along at once; the model follows. */
  #answer(dragging: boolean): void {
    const { ahead, answer } = this.#ui;
    const at = performance.now();
    answer.sent(this.#turn, at);
    // After the drawing, which asked for the same animation frame before.
    if (dragging && ahead.follow(this.#pose, this.#turn))
      requestAnimationFrame(() => answer.along(performance.now() - at));
  }

  get names(): string[] {
    return this.#names;
  }

  /** The film, and where it is; the ellipsoids stay. */
  async setFilm(film: Film | undefined, frame: number): Promise<void> {
    this.#film = film;
    this.#frame = frame;
    this.show();
    await this.#client.request('film', { film, frame });
  }

  /** What a frame tells of the film and of where the ellipsoids go; not while a hand is ahead of it. */
  follow({ turn, frame, pose }: FrameEvent, playing: boolean): void {
    if (turn < this.#turn) return;
    if (playing && frame !== this.#frame) this.#posed = false;
    this.#frame = frame;
    if (!samePose(pose, this.#pose)) {
      this.#pose = pose;
      this.#names = named(this.#names, pose.length);
    }
    this.#showPose();
    this.#ui.film.show(this.#film, frame);
  }

  /** A pose that was refused: back to where the worker says they go. */
  refuse(pose: Pose, why: string): void {
    this.#pose = pose;
    this.#names = named(this.#names, pose.length);
    this.#showPose();
    this.#ui.ellipsoids.complain(why);
  }

  /** Live: the run goes on, or is taken up again, with the new value. */
  setParams(values: ParamValues, what: string): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return this.show();
      const forget = this.remember(`change of ${what}`, what);
      try {
        this.#params = await this.#client.request('setParams', values);
        if (this.#states.beneath === 'done') await this.#client.request('settle', undefined);
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail('That did not work.', error);
        this.show();
        this.#ui.refuseParam(Object.keys(values)[0] ?? '', message, this.#params);
        return;
      }
      this.show();
    });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      try {
        const moment = await this.#rewinder.travel(way);
        if (moment) await this.#goTo(moment.saved, moment.page);
      } catch (error) {
        this.#states.fail(way === 'undo' ? 'That could not be undone.' : 'That could not be done again.', error);
      }
    });
  }

  /** A new model of the same meshes, before its first step, with the parameters in force. */
  rebuild(start: Pose | undefined): Promise<void> {
    return this.#states.inTurn(async () => {
      const ready = await this.#client.request('rebuild', { start, params: this.#params, pose: undefined });
      this.#rewinder.clear();
      this.#pose = ready.pose;
      this.#names = named(this.#names, ready.pose.length);
      this.#params = ready.params;
      this.#posed = false;
      this.#frame = 0;
      await this.#client.request('film', { film: this.#film, frame: 0 });
      this.show();
    });
  }

  /** Everything that is in force, on the page. */
  show(): void {
    this.#showPose();
    this.#ui.film.show(this.#film, this.#frame);
    this.#onChange();
  }

  async #goTo(saved: SavedPose, page: PageState): Promise<void> {
    this.#names = page.names;
    this.#posed = page.posed;
    this.#film = page.film;
    this.#frame = saved.frame;
    this.#history.rewind(page.mark(saved.iteration));
    await this.#client.request('film', { film: page.film, frame: saved.frame });
    // The worker went back to the state already; this tells what was in it.
    const ready = await this.#client.request('restore', saved);
    this.#params = ready.params;
    this.#pose = ready.pose;
    this.show();
    await this.#client.request('settle', undefined);
  }

  #showPose(): void {
    this.#ui.view.showEllipsoids(this.#pose, this.#chosen);
    this.#ui.ellipsoids.show(this.#pose, this.#names, this.#chosen);
  }
}

/** As many names as ellipsoids. */
function named(names: string[], count: number): string[] {
  return Array.from({ length: count }, (_, k) => names[k] ?? '');
}
