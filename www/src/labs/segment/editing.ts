import { signal } from '@preact/signals';
import type { LabelArray } from '../../engine/labels';
import { freeValue, type KnownLabel, type Label, newLabel, rangeOf } from '../../engine/labels';
import type { Undoable } from '../../kit/ui/parts';
import { UndoStack } from '../../lab/undo';
import type { Axis } from '../../scene/anatomy';
import type { Grip } from '../../scene/panel';
import { text } from '../../texts';
import { flood, floodBox, sweep } from './brush';
import type { SegmentClient } from './client';
import { LabelMap, type Patch } from './label-map';
import type { LabelsShown } from './panels/labels';
import type { OpenedLabels, Region, StepUpdate, Vec3, VolumeView } from './protocol';
import { grown, union } from './region';
import { type ToolSettings, usesRange } from './tools';

/** Limits of the undo history: number of strokes, and their total size in bytes. */
const LIMITS = { entries: 200, bytes: 256e6 };
/** Bytes of a patch for each of its voxels, besides the label. */
const INDEX_BYTES = 4;

/** State that undo restores: voxels, the list of labels, and which of them the tools paint. */
interface Moment {
  patch: Patch | undefined;
  labels: readonly Label[];
  active: number;
}

/** The list of labels, which of them the tools paint, and those that are hidden. */
export interface LabelList {
  labels: readonly Label[];
  active: number;
  hidden: readonly number[];
}

/** Interface to the lab, as editing needs it. */
export interface EditedLab {
  /** Called when voxels have changed, before the surfaces follow. */
  onVoxels: () => void;
  /** Called with surfaces that have followed a change; after a large one they are not `smooth` at first. */
  onUpdate: (update: StepUpdate, smooth: boolean) => void;
  /** Called when the worker begins to follow changes. */
  onBusy: () => void;
  /** Called when the surfaces follow no further, after {@link SegmentEditing.stop}. */
  onStopped: () => void;
  /** Called when a fill has reached no voxel, with the reason. */
  onNothing: (reason: string) => void;
  onError: (title: string, error: unknown) => void;
}

/**
 * Edits the label map of the Segment lab: strokes of the tools, the list of labels, and undo. Voxels change here at
 * once; the worker is sent what has changed whenever it is idle, so that the surfaces follow as fast as it can.
 */
export class SegmentEditing {
  readonly #client: SegmentClient;
  readonly #lab: EditedLab;
  readonly #undo = new UndoStack<Moment>(LIMITS);
  #map: LabelMap | undefined;
  #spacing: Vec3 = [1, 1, 1];
  /** The list of labels. Undo does not affect which are hidden. */
  readonly list = signal<LabelsShown>({ labels: [], active: 1, hidden: new Set() });
  /** The names of the changes that undo and redo would affect. */
  readonly undo = signal<Undoable>({});
  /** Box of the voxels that the worker does not know yet. */
  #unsent: Region | undefined;
  /** Whether the worker has yet to smooth surfaces. */
  #isRough = false;
  #isFollowing = false;
  /** Whether surfaces are to remain unchanged until the next change. */
  #isStopped = false;
  /** Settles when the worker has followed the changes so far. */
  #followed: Promise<void> = Promise.resolve();
  /** Number of the label map at the worker; replies about a previous one are discarded. */
  #id = 0;
  #mask: Uint8Array | undefined;
  /** Fills that have yet to be made, as it is not known yet which voxels are in their range of intensities. */
  #pendingFills: (() => void)[] = [];

  constructor(client: SegmentClient, lab: EditedLab) {
    this.#client = client;
    this.#lab = lab;
  }

  get labels(): readonly Label[] {
    return this.list.peek().labels;
  }

  get active(): number {
    return this.list.peek().active;
  }

  get hidden(): ReadonlySet<number> {
    return this.list.peek().hidden;
  }

  #relist(changed: Partial<LabelsShown>): void {
    this.list.value = { ...this.list.peek(), ...changed };
  }

  get voxels(): LabelArray | undefined {
    return this.#map?.voxels;
  }

  /** Not 0 for the voxels in the range of intensities, as far as they are known; fills that wait for it are then made. */
  get mask(): Uint8Array | undefined {
    return this.#mask;
  }

  set mask(mask: Uint8Array | undefined) {
    const fills = this.#pendingFills;
    this.#mask = mask;
    this.#pendingFills = [];
    if (mask) for (const fill of fills) fill();
  }

  /** Settles when the worker has followed the changes so far. */
  get followed(): Promise<void> {
    return this.#followed;
  }

  /** Whether the worker has yet to follow changes. */
  get isBusy(): boolean {
    return (this.#isRough && !this.#isStopped) || this.#unsent !== undefined;
  }

  /** Has the surfaces remain unchanged until the next change, once the worker has answered. */
  stop(): void {
    this.#isStopped = true;
  }

  /**
   * Takes over a newly opened label map, and clears the undo history. `names` are those of an example's labels, from the
   * value 1 on; without any label there is one to begin with.
   */
  adopt(grid: Pick<VolumeView, 'dims' | 'spacing'>, opened: OpenedLabels, names: string[]): void {
    this.#start(grid, opened);
    const present = opened.surfaces.map(({ value }) => value);
    const [low, high] = rangeOf(opened.voxels);
    const described = [...names.map((name, i): KnownLabel => ({ value: i + 1, name })), ...opened.known];
    const known = new Map(described.map((label) => [label.value, label]));
    const possible = [...known.keys()].filter((value) => value !== 0 && value >= low && value <= high);
    const values = [...new Set([...present, ...possible])].sort((a, b) => a - b);
    const labels = (values.length > 0 ? values : [1]).map((value) => newLabel(value, known.get(value)));
    this.list.value = { labels, active: labels[0]?.value ?? 1, hidden: new Set() };
  }

  /** Takes over the label map of a session, with its list of labels, and clears the undo history. */
  resume(
    grid: Pick<VolumeView, 'dims' | 'spacing'>,
    opened: OpenedLabels,
    { labels, active, hidden }: LabelList,
  ): void {
    this.#start(grid, opened);
    this.list.value = { labels, active, hidden: new Set(hidden) };
  }

  /** Takes over the label map opened again after a failure of the engine; the list of labels stays. */
  readopt(grid: Pick<VolumeView, 'dims' | 'spacing'>, opened: OpenedLabels): void {
    this.#start(grid, opened);
    // Shown with the voxels of the other map.
    this.#relist({});
  }

  #start({ dims, spacing }: Pick<VolumeView, 'dims' | 'spacing'>, { map, voxels }: OpenedLabels): void {
    this.#id = map;
    this.#map = new LabelMap(dims, voxels);
    this.#spacing = spacing;
    this.#unsent = undefined;
    this.#isFollowing = false;
    this.mask = undefined;
    this.#undo.clear();
    this.#notify();
  }

  /** Begins a stroke at a position in voxels, in a slice across `axis`; undefined if the tool makes none. */
  press(at: Vec3, axis: Axis, settings: ToolSettings): Grip | undefined {
    if (!this.#map || settings.tool === 'navigate') return undefined;
    // Nobody wants to paint what cannot be seen.
    if (settings.tool !== 'eraser' && this.hidden.has(this.active)) this.setVisible(this.active, true);
    if (settings.tool === 'fill') {
      this.#fill(at, axis, settings);
      return { move: () => undefined, drop: () => undefined };
    }
    let last = at;
    this.#paint(at, at, axis, settings);
    return {
      move: (next) => {
        this.#paint(last, next, axis, settings);
        last = next;
      },
      drop: () => this.#endStroke(strokeName(settings.tool)),
    };
  }

  /** Applies the tool at a voxel, as a press there that is released at once. */
  apply(at: Vec3, axis: Axis, settings: ToolSettings): void {
    this.press(at, axis, settings)?.drop();
  }

  /** Chooses the label to paint with, if there is such a one. */
  setActive(value: number): void {
    if (!this.labels.some((label) => label.value === value)) return;
    this.#relist({ active: value });
  }

  setVisible(value: number, visible: boolean): void {
    const hidden = new Set(this.hidden);
    if (visible) hidden.delete(value);
    else hidden.add(value);
    this.#relist({ hidden });
  }

  rename(value: number, name: string): void {
    this.#relabel(text('segment.renaming'), (label) => (label.value === value ? { ...label, name } : label));
  }

  recolor(value: number, color: string): void {
    this.#relabel(text('segment.recoloring'), (label) => (label.value === value ? { ...label, color } : label));
  }

  /** Adds a label without voxels, which the tools paint from now on; returns false if the file's type has no room. */
  add(): boolean {
    if (!this.#map) return false;
    const label = newLabel(freeValue(this.labels));
    if (label.value > rangeOf(this.#map.voxels)[1]) return false;
    this.#push(text('segment.adding'), undefined);
    const labels = [...this.labels, label].sort((a, b) => a.value - b.value);
    this.#relist({ labels, active: label.value });
    return true;
  }

  /** Removes a label, and its voxels from the map. */
  remove(value: number): void {
    const map = this.#map;
    if (!map) return;
    for (let index = map.voxels.indexOf(value); index >= 0; index = map.voxels.indexOf(value, index + 1))
      map.set(index, 0);
    const patch = map.end();
    this.#push(text('segment.removing'), patch);
    const rest = this.labels.filter((label) => label.value !== value);
    const labels = rest.length > 0 ? rest : [newLabel(1)];
    const hidden = new Set([...this.hidden].filter((one) => one !== value));
    const isThere = rest.some((label) => label.value === this.active);
    this.list.value = { labels, hidden, active: isThere ? this.active : (labels[0]?.value ?? 1) };
    if (patch) this.#changed(map.boxOf(patch));
  }

  /** Undoes or redoes a stroke, or a change of the list of labels. */
  travel(direction: 'undo' | 'redo'): void {
    const moment = direction === 'undo' ? this.#undo.past : this.#undo.future;
    // Not in the middle of a stroke, which would then end on other labels.
    if (!this.#map || !moment || this.#map.isChanging) return;
    const now: Moment = { patch: moment.patch, labels: this.labels, active: this.active };
    const box = moment.patch && this.#map.exchange(moment.patch);
    this.#undo[direction]({ bytes: sizeOf(moment.patch), state: now });
    this.#notify();
    this.#relist({ labels: moment.labels, active: moment.active });
    if (box) this.#changed(box);
  }

  #paint(from: Vec3, to: Vec3, axis: Axis, { tool, radius, shape, protect }: ToolSettings): void {
    const map = this.#map;
    if (!map) return;
    const value = tool === 'eraser' ? 0 : this.active;
    const only = protect ? (tool === 'eraser' ? this.active : 0) : undefined;
    const mask = tool === 'threshold' ? this.mask : undefined;
    // Until the worker has said which voxels are in the range, none is.
    if (tool === 'threshold' && !mask) return;
    let changed = false;
    const brush = { radius, axis: shape === 'disc' ? axis : undefined };
    const box = sweep({ dims: map.dims, spacing: this.#spacing }, brush, from, to, (index) => {
      if (mask && !mask[index]) return;
      if (only !== undefined && map.voxels[index] !== only) return;
      changed = map.set(index, value) || changed;
    });
    if (box && changed) this.#changed(box);
  }

  /** Fills a region around a position in voxels, when it is known which voxels are in the range of intensities. */
  #fill(at: Vec3, axis: Axis, settings: ToolSettings): void {
    const map = this.#map;
    const mask = usesRange(settings) ? this.#mask : undefined;
    if (!map) return;
    if (usesRange(settings) && !mask) {
      this.#pendingFills.push(() => this.#fill(at, axis, settings));
      return;
    }
    const seed = at.map((x, one) => Math.min((map.dims[one] ?? 1) - 1, Math.max(0, Math.round(x)))) as Vec3;
    if (settings.protect && map.at(seed) !== 0) {
      this.#lab.onNothing(text('segment.fillKept'));
      return;
    }
    const visit = (index: number) => map.set(index, this.active);
    const reachable = grown({ min: seed, dims: [1, 1, 1] }, settings.reach, map.dims);
    const box =
      settings.extent === 'slice'
        ? flood(map.voxels, map, axis, seed, visit)
        : floodBox(map.voxels, map, { box: reachable, ...(mask && { mask }) }, seed, visit);
    if (box) this.#changed(box);
    else this.#lab.onNothing(text('segment.nothingFilled'));
    this.#endStroke(text('segment.fillStroke'));
  }

  #endStroke(name: string): void {
    const patch = this.#map?.end();
    if (patch) this.#push(name, patch);
  }

  #relabel(what: string, change: (label: Label) => Label): void {
    this.#push(what, undefined);
    this.#relist({ labels: this.labels.map(change) });
  }

  #push(label: string, patch: Patch | undefined): void {
    const state: Moment = { patch, labels: this.labels, active: this.active };
    this.#undo.push({ label, bytes: sizeOf(patch), state });
    this.#notify();
  }

  #notify(): void {
    this.undo.value = { undoable: this.#undo.undoable, redoable: this.#undo.redoable };
  }

  #changed(box: Region | undefined): void {
    if (!box) return;
    this.#unsent = union(this.#unsent, box);
    this.#lab.onVoxels();
    this.follow();
  }

  /** Has the worker adopt what has changed, and smooth the surfaces. */
  follow(): void {
    this.#isRough = true;
    this.#isStopped = false;
    if (this.#isFollowing) return;
    this.#isFollowing = true;
    this.#lab.onBusy();
    const id = this.#id;
    this.#followed = this.#followChanges(id).catch((error) => {
      if (id !== this.#id) return;
      this.#isFollowing = false;
      this.#isRough = false;
      this.#lab.onError(text('segment.editFailed'), error);
    });
  }

  /**
   * Sends the worker what has changed, as often as it is ready for more, and has it smooth the surfaces step by step, so
   * that the next change never waits for long.
   */
  async #followChanges(map: number): Promise<void> {
    while (this.#map && this.isBusy) {
      const box = this.#unsent;
      this.#unsent = undefined;
      const update = box
        ? await this.#client.request('edit', { map, block: this.#map.block(box) })
        : await this.#client.request('step', { map });
      if (map !== this.#id) return;
      this.#isRough = !update.done || this.#unsent !== undefined;
      this.#lab.onUpdate(update, !this.#isRough);
    }
    this.#isFollowing = false;
    if (this.#isStopped) this.#lab.onStopped();
  }
}

function sizeOf(patch: Patch | undefined): number {
  return patch ? patch.indices.length * (INDEX_BYTES + patch.values.BYTES_PER_ELEMENT) : 0;
}

function strokeName(tool: ToolSettings['tool']): string {
  if (tool === 'eraser') return text('segment.eraserStroke');
  return tool === 'threshold' ? text('segment.thresholdStroke') : text('segment.brushStroke');
}
