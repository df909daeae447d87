import { toFailure } from '../../engine/failure';
import type { LabStates } from '../../lab/states';
import { UndoStack } from '../../lab/undo';
import { text } from '../../texts';
import type { ReconstructClient } from './client';
import type { CloudChoice } from './panels/cloud-setup';
import type { ReconstructParts } from './parts';
import { applyClick, NO_EDITS, withoutRemoved } from './picking';
import type { Cloud, Edits, ParamValues, Setup } from './protocol';
import type { ReconstructResults } from './results';
import type { Hit } from './scene';

/** Limits of the undo history: number of states, and their total size in bytes. */
const UNDO_LIMITS = { entries: 60, bytes: 96e6 };
/** Milliseconds within which repeated changes of the same setting are undone as one, as when a slider is dragged. */
const TOGETHER = 1500;

/** Settings of the Reconstruct lab that undo restores. */
interface Settings {
  choice: CloudChoice;
  params: ParamValues;
  edits: Edits;
}

type Entries = UndoStack<Settings>['entries'];

/**
 * Manages the edits of the points and the settings of their model: changes them, sends them to the worker, and undoes
 * changes.
 */
export class ReconstructSettings {
  readonly #client: ReconstructClient;
  readonly #ui: ReconstructParts;
  readonly #states: LabStates;
  readonly #results: ReconstructResults;
  readonly #onParams: (params: ParamValues) => void;
  readonly #undo = new UndoStack<Settings>(UNDO_LIMITS);
  #lastChange = { mergeKey: '', at: 0 };
  #cloud: Cloud | undefined;
  #params: ParamValues = {};
  #edits: Edits = NO_EDITS;

  /** `onParams` is called whenever the parameters in force may have changed, to display them. */
  constructor(
    client: ReconstructClient,
    ui: ReconstructParts,
    states: LabStates,
    results: ReconstructResults,
    onParams: (params: ParamValues) => void,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#results = results;
    this.#onParams = onParams;
  }

  get params(): ParamValues {
    return this.#params;
  }

  get edits(): Edits {
    return this.#edits;
  }

  get choice(): CloudChoice {
    return this.#ui.setup.choice.peek();
  }

  /** Takes over newly opened points and the settings of their model, and clears the undo history. */
  adopt(cloud: Cloud, setup: Setup): void {
    this.#cloud = cloud;
    const removed = setup.edits.removed.filter((index) => index < cloud.points.length / 3);
    this.#edits = { ...setup.edits, removed };
    this.#undo.clear();
    this.#showUndo();
    this.#ui.setup.show(setup);
    this.#showEdits();
  }

  /** The settings to undo and to redo, for a session. */
  get entries(): Entries {
    return this.#undo.entries;
  }

  set entries(entries: Entries) {
    this.#undo.entries = entries;
    this.#showUndo();
  }

  /** Takes over and shows the parameters in force, as reported by the worker. */
  showParams(params: ParamValues): void {
    this.#params = params;
    this.#onParams(params);
  }

  /**
   * Changes settings and runs the model; the surface stays until the new one is complete. `label` names the change for
   * undo. If the settings are rejected, nothing changes.
   */
  change(changed: Partial<Settings>, label: string): Promise<void> {
    return this.#states.enqueue(() => this.#change(changed, label));
  }

  /** Sets a parameter of the live model; a run continues, and a finished one is resumed. */
  setParam(name: string, value: unknown): Promise<void> {
    return this.#states.enqueue(() => this.#setParam(name, value));
  }

  /** Edits the points by a click in the view with the selected tool. */
  pick(hit: Hit): Promise<void> {
    const tool = this.#ui.tools.tool.peek();
    const length = this.#ui.tools.distance * this.#ui.view.size;
    return this.#states.enqueue(async () => {
      if (!this.#cloud || !this.#states.canChange) return;
      const edits = applyClick(tool, hit, length, this.#edits, this.#cloud.points);
      if (edits) await this.#change({ edits }, text('reconstruct.editChange'));
      else if (tool === 'remove') this.#ui.page.status.say(text('reconstruct.noPointsNear'));
    });
  }

  takeBackEdits(): Promise<void> {
    return this.change({ edits: NO_EDITS }, text('reconstruct.discardChange'));
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.enqueue(() => this.#travel(way));
  }

  /** Has the worker build a new model with the same settings; the model does not run yet. */
  rebuild(): Promise<void> {
    return this.#states.enqueue(async () => this.showParams(await this.#handOver(this.#now)));
  }

  async #change(changed: Partial<Settings>, label: string): Promise<void> {
    if (!this.#states.canChange) return;
    const before = this.#now;
    if (await this.#apply({ ...before, ...changed })) this.#checkpoint(before, label);
  }

  async #setParam(name: string, value: unknown): Promise<void> {
    if (!this.#states.canChange) {
      this.#onParams(this.#params);
      return;
    }
    const before = this.#now;
    try {
      const params = await this.#client.request('setParams', { [name]: value });
      this.#checkpoint(before, text('labs.changeOf', { name }), name);
      this.showParams(params);
      if (this.#states.modelState === 'done') {
        this.#results.startOver();
        await this.#play().catch((error) => this.#states.fail(text('labs.requestFailed'), error));
      }
    } catch (error) {
      const { code, message } = toFailure(error);
      this.#ui.page.refuseParam(name, message, this.#params);
      if (code === 'internal') this.#states.fail(text('labs.requestFailed'), error);
    }
  }

  async #travel(way: 'undo' | 'redo'): Promise<void> {
    if (!this.#states.canChange) return;
    const state = this.#now;
    const back = this.#undo[way]({ bytes: sizeOf(state), state });
    this.#lastChange.mergeKey = '';
    this.#showUndo();
    if (back) await this.#apply(back);
  }

  #play(): Promise<undefined> {
    return this.#client.request('play', undefined);
  }

  get #now(): Settings {
    return { choice: this.choice, params: this.#params, edits: this.#edits };
  }

  async #apply(settings: Settings): Promise<boolean> {
    const { choice, edits } = settings;
    this.#ui.page.banner.hide();
    try {
      const params = await this.#handOver(settings);
      this.#edits = edits;
      this.#ui.setup.show(choice);
      this.#showEdits();
      this.#results.startOver();
      this.showParams(params);
      await this.#play();
      return true;
    } catch (error) {
      this.#ui.setup.show(this.choice);
      this.#states.fail(text('labs.settingsRejected'), error);
      return false;
    }
  }

  /**
   * Sends settings to the worker; returns the parameters in force. If only the points changed by hand differ, the live
   * model takes them and updates its solution; else a new model is built.
   */
  async #handOver({ choice, params, edits }: Settings): Promise<ParamValues> {
    const before = this.#now;
    const samePoints = edits === before.edits;
    if (!samePoints && isSame(choice, before.choice) && isSame(params, before.params)) {
      await this.#client.request('setEdits', edits);
      return params;
    }
    const ready = await this.#client.request('rebuild', { ...choice, params, edits });
    return ready.params;
  }

  #checkpoint(state: Settings, label: string, mergeKey = ''): void {
    const now = performance.now();
    const isOne = mergeKey !== '' && mergeKey === this.#lastChange.mergeKey && now - this.#lastChange.at < TOGETHER;
    this.#lastChange = { mergeKey, at: now };
    if (!isOne) this.#undo.push({ label, bytes: sizeOf(state), state });
    this.#showUndo();
  }

  #showUndo(): void {
    this.#ui.run.transport.showUndo(this.#undo.undoable, this.#undo.redoable);
  }

  #showEdits(): void {
    this.#ui.tools.edits.value = this.#edits;
    if (!this.#cloud) return;
    const { points, colors } = this.#cloud;
    const { added, removed, outside } = this.#edits;
    this.#ui.view.showPoints(withoutRemoved(points, removed), colors && withoutRemoved(colors, removed));
    this.#ui.view.showByHand(added, outside);
  }
}

function isSame(a: object, b: object): boolean {
  const [one, other] = [Object.entries(a), new Map<string, unknown>(Object.entries(b))];
  return (
    one.length === other.size && one.every(([name, value]) => other.has(name) && Object.is(other.get(name), value))
  );
}

function sizeOf({ edits: { added, removed, outside } }: Settings): number {
  return 100 + 8 * (3 * added.length + removed.length + 3 * outside.length);
}
