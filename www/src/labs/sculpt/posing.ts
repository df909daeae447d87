import { shortenedPoint } from '../../engine/placing';
import { place } from '../../kit/format';
import { text } from '../../texts';
import { moved, scaled, turned } from './ellipsoids';
import type { HandleMode } from './handles';
import type { SculptParts } from './parts';
import type { ControlEllipsoid, Pose, Vec3 } from './protocol';
import type { SculptSettings } from './settings';

/** Displacement of an ellipsoid by one key press, as a fraction of the diagonal of the scene's bounding box. */
const MOVE_STEP = 0.02;
/** Rotation of an ellipsoid by one key press, radians. */
const ROTATION_STEP = 0.1;
/** Factor by which one key press scales an ellipsoid. */
const SCALE_STEP = 1.06;
/** Share of a key press's effect on an ellipsoid that remains while Shift is held. */
const FINE_FACTOR = 0.2;

/** Radius of a new ellipsoid, as a fraction of the diagonal of the scene's bounding box. */
const NEW_RADIUS = 0.12;

/** Milliseconds after the last key press until the change of an ellipsoid by keys counts as ended. */
const IDLE_MS = 350;

const MODE_KEYS: Record<string, HandleMode> = { m: 'move', t: 'turn', e: 'size' };
const DONE: Record<HandleMode, string> = {
  move: text('sculpt.moved'),
  turn: text('sculpt.rotated'),
  size: text('sculpt.scaled'),
};

/** Keys, in the catalogue of texts, of the messages that tell what handles and arrow keys do in each mode. */
const MODE_TEXTS = { move: 'sculpt.handlesMove', turn: 'sculpt.handlesRotate', size: 'sculpt.handlesScale' } as const;

/** Selects ellipsoids and moves, rotates and scales them, by handles, keys and numbers. */
export class Posing {
  readonly #ui: SculptParts;
  readonly #settings: SculptSettings;
  #mode: HandleMode = 'move';
  /** Called before each change of a pose. */
  readonly #onChange: () => void;
  /** Id of the timer that ends a series of key presses. */
  #resting = 0;

  constructor(ui: SculptParts, settings: SculptSettings, onChange: () => void) {
    this.#ui = ui;
    this.#onChange = onChange;
    this.#settings = settings;
    ui.view.onPick = (index) => settings.choose(index);
    ui.view.handles.onDragStart = () => this.#checkpoint(DONE[this.#mode], false);
    ui.view.handles.onDrag = (ellipsoid, dragging) => this.#drag(ellipsoid, dragging);
    ui.view.takesKey = (event, directions) => this.#key(event, directions);
  }

  set mode(mode: HandleMode) {
    this.#mode = mode;
    this.#ui.ellipsoids.mode.value = mode;
    this.#ui.view.mode = mode;
    this.#ui.page.status.say(text(MODE_TEXTS[mode]));
  }

  /** Replaces the selected ellipsoid by one entered as numbers; `what` names the change. */
  change(ellipsoid: ControlEllipsoid, what: string): void {
    this.#checkpoint(what, true);
    this.#send(ellipsoid, false);
    this.#announce(what);
  }

  /**
   * Adds an ellipsoid beside the selected one, or else in the middle of the scene; in the model it grows from nothing.
   */
  add(): void {
    const { pose, chosen, names } = this.#settings;
    const size = NEW_RADIUS * this.#ui.view.size;
    const near = chosen === undefined ? undefined : pose[chosen];
    const center: Vec3 = near ? moved(near, [size, size, 0]).center : this.#ui.view.middle;
    const [x, y, z]: [Vec3, Vec3, Vec3] = [
      [size, 0, 0],
      [0, size, 0],
      [0, 0, size],
    ];
    this.#onChange();
    this.#settings.checkpoint(text('sculpt.newEllipsoidChange'));
    this.#settings.send([...pose, { center, axes: [x, y, z] }], false, [...names, '']);
    this.#settings.choose(pose.length);
  }

  /** Removes the selected ellipsoid, unless it is the only one; in the model it shrinks until it vanishes. */
  remove(): void {
    const { pose, chosen, names } = this.#settings;
    if (chosen === undefined || pose.length < 2) return;
    const name = this.#settings.nameOf(chosen);
    const others = <T>(list: T[]) => list.filter((_, index) => index !== chosen);
    this.#onChange();
    this.#settings.checkpoint(text('sculpt.removedEllipsoidChange'));
    this.#settings.send(others(pose), false, others(names));
    this.#settings.choose(undefined);
    this.#ui.page.status.say(text('sculpt.ellipsoidRemoved', { name }));
    this.#ui.ellipsoids.focus();
  }

  /** Stops the timer of a series of key presses when the lab is closed, so that no pose is sent any more. */
  close(): void {
    clearTimeout(this.#resting);
  }

  #drag(ellipsoid: ControlEllipsoid, dragging: boolean): void {
    this.#send(ellipsoid, dragging);
    if (!dragging) this.#announce(DONE[this.#mode]);
  }

  #send(ellipsoid: ControlEllipsoid, dragging: boolean): void {
    const { pose, chosen } = this.#settings;
    const next: Pose = pose.map((one, index) => (index === chosen ? ellipsoid : one));
    this.#settings.send(next, dragging);
  }

  #checkpoint(what: string, merge: boolean): void {
    const { chosen } = this.#settings;
    if (chosen === undefined) return;
    this.#onChange();
    const label = text('sculpt.ellipsoidChange', { name: this.#settings.nameOf(chosen), what });
    this.#settings.checkpoint(label, merge ? label : '');
  }

  /**
   * Describes the new position of the selected ellipsoid in the status line, once a change has ended; `what` names the
   * change.
   */
  #announce(what: string): void {
    const { pose, chosen } = this.#settings;
    const ellipsoid = chosen === undefined ? undefined : pose[chosen];
    if (chosen === undefined || !ellipsoid) return;
    const { size } = this.#ui.view;
    const centre = place(shortenedPoint(ellipsoid.center, 3, size), size);
    this.#ui.page.status.say(text('sculpt.ellipsoidMoved', { name: this.#settings.nameOf(chosen), what, centre }));
  }

  /**
   * Handles a key in the 3D view: selects an ellipsoid, chooses what handles and arrow keys do, or changes the selected
   * ellipsoid. `directions` are the view's axes: to the right, upwards and towards the viewer. Returns whether the key
   * did one of these.
   */
  #key({ key, shiftKey }: KeyboardEvent, directions: Vec3[]): boolean {
    const mode = MODE_KEYS[key];
    const number = /^[1-9]$/.test(key) ? Number(key) : 0;
    const { pose, chosen } = this.#settings;
    if (number > 0 && number <= pose.length) this.#settings.choose(number - 1);
    else if (mode) this.mode = mode;
    else if (chosen === undefined) return false;
    else if (key === 'Escape') this.#settings.choose(undefined);
    else if (key === 'Delete') this.remove();
    else return this.#nudge(key, shiftKey ? FINE_FACTOR : 1, directions);
    return true;
  }

  /**
   * Ends a series of key presses: sends the pose once more, as final, so that the model's preview ends, and announces
   * it.
   */
  #rest(): void {
    this.#settings.send(this.#settings.pose, false);
    this.#announce(DONE[this.#mode]);
  }

  #nudge(key: string, much: number, [right, up, near]: Vec3[]): boolean {
    const step = STEPS[key];
    const { pose, chosen } = this.#settings;
    const ellipsoid = chosen === undefined ? undefined : pose[chosen];
    if (!step || !ellipsoid || !right || !up || !near) return false;
    const axis = [right, up, near][step.axis] ?? right;
    const change = {
      move: () => moved(ellipsoid, scaledBy(axis, step.sign * much * MOVE_STEP * this.#ui.view.size)),
      turn: () =>
        turned(ellipsoid, [up, right, near][step.axis] ?? up, ROTATION_STEP * much * TURN_SIGNS[step.axis] * step.sign),
      size: () => sized(ellipsoid, step, much),
    };
    this.#checkpoint(DONE[this.#mode], true);
    this.#send(change[this.#mode](), true);
    clearTimeout(this.#resting);
    this.#resting = window.setTimeout(() => this.#rest(), IDLE_MS);
    return true;
  }
}

interface Step {
  /** Axis of the view to which an arrow or page key belongs: 0 to the right, 1 upwards, 2 towards the viewer. */
  axis: 0 | 1 | 2;
  sign: 1 | -1;
}

const STEPS: Record<string, Step> = {
  ArrowRight: { axis: 0, sign: 1 },
  ArrowLeft: { axis: 0, sign: -1 },
  ArrowUp: { axis: 1, sign: 1 },
  ArrowDown: { axis: 1, sign: -1 },
  PageUp: { axis: 2, sign: 1 },
  PageDown: { axis: 2, sign: -1 },
};

/**
 * Signs of the rotations by the keys for the three axes of the view (to the right, upwards, towards the viewer): the
 * front of the ellipsoid turns in the direction of the arrow.
 */
const TURN_SIGNS = [1, -1, 1] as const;

/**
 * Returns an ellipsoid scaled by a key: by up and down along all its axes, by left and right along the first, by the
 * page keys along the third. `much` is the strength, 1 for a full step.
 */
function sized(ellipsoid: ControlEllipsoid, { axis, sign }: Step, much: number): ControlEllipsoid {
  const factor = SCALE_STEP ** (sign * much);
  const factors: Vec3 = axis === 1 ? [factor, factor, factor] : [axis === 0 ? factor : 1, 1, axis === 2 ? factor : 1];
  return scaled(ellipsoid, factors);
}

function scaledBy(vector: Vec3, factor: number): Vec3 {
  return vector.map((x) => x * factor) as Vec3;
}
