// The custom element: takes attributes, and shows a surface and figures about it.
import { invalid } from '../check.js';
import type { MeshSnapshot } from '../mesh.js';
import type { StepReport } from '../stepper.js';
import type { Warning } from '../warning.js';
import { mergedWarnings } from '../warnings.js';
import init, { type Stepper, type Vec3 } from '../worker.js';
import { fetched, json, MODELS, type ModelWithView, parseStart } from './models.js';
import { STYLE } from './style.js';
import { View } from './view.js';

/** The method that a `<vesicle-lab>` runs. */
export type LabMethod = keyof typeof MODELS;

/** State of a `<vesicle-lab>`, also in its attribute `data-state`. */
export type LabState = 'loading' | 'running' | 'paused' | 'done' | 'error';

/** Approximate duration of the method's steps between two renderings, milliseconds. */
const SLICE_MS = 60;
/** Largest number of steps of the method between two renderings. */
const MAX_STEPS = 256;

const ATTRIBUTES = ['src', 'method', 'start', 'levels', 'params', 'cavity', 'ellipsoids'];

/**
 * The element `<vesicle-lab>`: loads `src`, runs a method on it, and shows the surface while it evolves.
 *
 * Attributes: `src`, the file; `method`, `deformable` (a volume, the default), `implicit` (points), `tracking` (a
 * volume with frames) or `multires` (a mesh, with `ellipsoids` as JSON for a membrane over them); `params` of the method as
 * JSON; `levels` of the pyramid and `start`, `contour` (the default) or `enclosing`, of the deformable model; `cavity`, `open`
 * (the default) or `closed`, of the tracker; `paused`, not to start
 * automatically. Changing an attribute other than `paused` restarts the method. Events: `vesicle-step` after one step
 * or a few, with a `StepReport` as `detail`, `vesicle-done`, `vesicle-error` with the error, `vesicle-warnings` when there
 * are others than before, with all {@link Warning}s. The parts `view`, `controls`, `status` and `warnings`, a list that is
 * hidden while it is empty, can be styled.
 */
export class VesicleLab extends HTMLElement {
  static readonly observedAttributes = ATTRIBUTES;
  readonly #parts = new Parts(this.attachShadow({ mode: 'open' }), {
    play: () => void (this.state === 'running' ? this.pause() : this.play()),
    step: () => void this.step(),
    reset: () => void this.reset(),
  });
  #view: View | undefined;
  #model: Stepper | undefined;
  /** Warnings of the data. */
  #known: readonly Warning[] = [];
  #warnings: readonly Warning[] = [];
  /** Number of resets so far, by which results of an earlier one are recognised and discarded. */
  #opening = 0;
  #viewDirection: Vec3 = [0, -1, 0];
  #fitted = false;

  /** Current state of the element, also in its attribute `data-state`. */
  get state(): LabState {
    return (this.dataset.state ?? 'loading') as LabState;
  }

  /** The model in its worker, as in `vesicle/worker`; undefined before it is created. */
  get model(): Stepper | undefined {
    return this.#model;
  }

  /** Warnings about data and result so far; empty if there are none. */
  get warnings(): readonly Warning[] {
    return this.#warnings;
  }

  connectedCallback(): void {
    this.#view ??= this.#parts.makeView();
    void this.reset();
  }

  disconnectedCallback(): void {
    this.#close();
    this.#view?.dispose();
    this.#view = undefined;
    this.#parts.newCanvas();
  }

  attributeChangedCallback(): void {
    if (this.isConnected && this.#view !== undefined) void this.reset();
  }

  /**
   * Loads the file `src` again and restarts the method with the current attributes; it then runs unless `paused` is
   * set.
   */
  async reset(): Promise<void> {
    this.#close();
    const opening = ++this.#opening;
    this.#setState('loading', 'Loading.');
    try {
      const { model, from } = await this.#make();
      const known = (await model.mesh.warnings) as Warning[];
      if (opening !== this.#opening) return void model.free();
      [this.#model, this.#viewDirection, this.#fitted] = [model, from, false];
      this.#view?.begin();
      this.#known = known;
      this.#warn([]);
      await this.#show();
      this.#setState('paused', 'Ready.');
      if (!this.hasAttribute('paused')) await this.play();
    } catch (error) {
      if (opening === this.#opening) this.#fail(error);
    }
  }

  async #make(): Promise<ModelWithView> {
    const method = (this.getAttribute('method') ?? 'deformable') as LabMethod;
    const make = MODELS[method];
    if (!Object.hasOwn(MODELS, method))
      throw invalid('method', `must be one of ${Object.keys(MODELS).join(', ')}, got '${method}'`);
    const src = this.getAttribute('src');
    if (!src) throw invalid('src', 'must be the address of a file');
    const settings = {
      start: parseStart(this.getAttribute('start')),
      levels: Number(this.getAttribute('levels') ?? 0),
      cavity: this.getAttribute('cavity') ?? 'open',
      params: json<Record<string, unknown>>('params', this.getAttribute('params'), {}),
      ellipsoids: json('ellipsoids', this.getAttribute('ellipsoids'), []),
    };
    const [bytes] = await Promise.all([fetched(new URL(src, document.baseURI).href), init()]);
    return make({ ...settings, bytes });
  }

  /** Runs the method to its end, or until {@link VesicleLab.pause}; resolves then. */
  async play(): Promise<void> {
    const model = this.#model;
    if (!model || this.state === 'running' || this.state === 'done') return;
    this.#setState('running', 'Running.');
    try {
      // Each slice is awaited, so that however fast the steps, the page does not fall behind.
      for (let steps = 1; this.#runs(model); ) {
        const began = performance.now();
        await this.#runSteps(model, steps);
        const took = performance.now() - began;
        steps = took < SLICE_MS / 2 ? Math.min(2 * steps, MAX_STEPS) : took > SLICE_MS ? Math.ceil(steps / 2) : steps;
      }
    } catch (error) {
      if (model === this.#model) this.#fail(error);
    }
  }

  #runs(model: Stepper): boolean {
    return this.state === 'running' && model === this.#model;
  }

  /** Pauses the run after the steps in progress. */
  pause(): void {
    if (this.state === 'running') this.#setState('paused', 'Paused.');
  }

  /** Pauses and runs one step of the method; does nothing if the method is done. */
  async step(): Promise<void> {
    const model = this.#model;
    if (!model || this.state === 'done') return;
    this.pause();
    try {
      await this.#runSteps(model, 1);
    } catch (error) {
      if (model === this.#model) this.#fail(error);
    }
  }

  /** Runs `steps` steps of the method, dispatches the element's events, and shows the surface. */
  async #runSteps(model: Stepper, steps: number): Promise<void> {
    const report = await model.step(steps);
    if (model !== this.#model) return;
    this.#parts.figures(report);
    this.#warn(report.warnings);
    this.dispatchEvent(new CustomEvent('vesicle-step', { detail: report }));
    if (report.done) this.#finish(report);
    await this.#show();
  }

  #finish({ vertices, components }: StepReport): void {
    const parts = components === 1 ? 'one component' : `${components} components`;
    this.#setState('done', `Done: ${vertices.toLocaleString('en')} vertices in ${parts}.`);
    this.dispatchEvent(new CustomEvent('vesicle-done'));
  }

  /** Shows the warnings of the data and of a report, and dispatches an event if they are others than before. */
  #warn(found: readonly Warning[]): void {
    const warnings = mergedWarnings(this.#known, found);
    if (JSON.stringify(warnings) === JSON.stringify(this.#warnings)) return;
    this.#warnings = warnings;
    this.#parts.warn(warnings);
    this.dispatchEvent(new CustomEvent('vesicle-warnings', { detail: warnings }));
  }

  async #show(): Promise<void> {
    const model = this.#model;
    const surface = (await model?.mesh.snapshot()) as MeshSnapshot | undefined;
    if (model !== this.#model || !surface?.triangles) return;
    this.#view?.show(surface);
    // The final surface may be much smaller than the initial one.
    if (!this.#fitted || this.state === 'done') this.#view?.frame(this.#viewDirection);
    this.#fitted = true;
  }

  #fail(error: unknown): void {
    this.#setState('error', error instanceof Error ? error.message : String(error));
    this.dispatchEvent(new CustomEvent('vesicle-error', { detail: error }));
  }

  #setState(state: LabState, words: string): void {
    this.dataset.state = state;
    this.#parts.show(state, words);
  }

  #close(): void {
    this.#model?.free();
    this.#model = undefined;
  }
}

/** The elements in the shadow root of a `<vesicle-lab>`: canvas, buttons and status line. */
class Parts {
  #canvas = canvas();
  readonly #play = document.createElement('button');
  readonly #step = document.createElement('button');
  readonly #status = document.createElement('output');
  readonly #figures = document.createElement('span');
  readonly #warnings = document.createElement('ul');

  constructor(root: ShadowRoot, acts: { play: () => void; step: () => void; reset: () => void }) {
    const style = new CSSStyleSheet();
    style.replaceSync(STYLE);
    root.adoptedStyleSheets = [style];
    const reset = document.createElement('button');
    for (const [button, word, act] of [
      [this.#play, 'Play', acts.play],
      [this.#step, 'Step', acts.step],
      [reset, 'Reset', acts.reset],
    ] as const) {
      button.type = 'button';
      button.textContent = word;
      button.addEventListener('click', act);
    }
    const controls = document.createElement('div');
    controls.setAttribute('part', 'controls');
    controls.setAttribute('role', 'group');
    controls.setAttribute('aria-label', 'Run');
    this.#status.setAttribute('part', 'status');
    this.#status.setAttribute('aria-live', 'polite');
    this.#figures.className = 'figures';
    controls.append(this.#play, this.#step, reset, this.#status, this.#figures);
    this.#warnings.setAttribute('part', 'warnings');
    this.#warnings.setAttribute('aria-label', 'Warnings');
    this.#warnings.setAttribute('aria-live', 'polite');
    this.#warnings.hidden = true;
    root.append(this.#canvas, this.#warnings, controls);
  }

  /** Creates the 3D view of the surface; without WebGL, shows a message instead and returns undefined. */
  makeView(): View | undefined {
    try {
      return new View(this.#canvas);
    } catch {
      const words = document.createElement('p');
      words.textContent = 'WebGL is not available; only figures are shown.';
      this.#canvas.replaceWith(words);
      return undefined;
    }
  }

  /**
   * Replaces the canvas, so that an element that is inserted again can create a new WebGL context: a canvas has only
   * one.
   */
  newCanvas(): void {
    const fresh = canvas();
    this.#canvas.replaceWith(fresh);
    this.#canvas = fresh;
  }

  show(state: LabState, words: string): void {
    this.#play.textContent = state === 'running' ? 'Pause' : 'Play';
    this.#play.disabled = state !== 'running' && state !== 'paused';
    this.#step.disabled = this.#play.disabled;
    this.#status.textContent = words;
    this.#status.className = state;
  }

  /** Shows a list of warnings; those that stay are not announced again. */
  warn(warnings: readonly Warning[]): void {
    const known = new Map(Array.from(this.#warnings.children, (item) => [item.textContent, item]));
    const items = warnings.map((warning) => {
      const words = `⚠ ${placed(warning)}${warning.text}`;
      const item = known.get(words) ?? document.createElement('li');
      item.textContent = words;
      return item;
    });
    this.#warnings.hidden = items.length === 0;
    for (const item of known.values()) if (!items.includes(item)) item.remove();
    for (const [at, item] of items.entries())
      if (this.#warnings.children[at] !== item) this.#warnings.insertBefore(item, this.#warnings.children[at] ?? null);
  }

  figures({ iteration, vertices, phase }: StepReport): void {
    this.#figures.textContent = `Step ${iteration}, ${phase}: ${vertices.toLocaleString('en')} vertices`;
  }
}

/** Returns the place of a warning in words, if it has one. */
function placed({ where }: Warning): string {
  if (!where) return '';
  if ('frame' in where) return `Frame ${where.frame + 1}: `;
  return 'label' in where ? `Label ${where.label}: ` : `At ${where.point.join(', ')}: `;
}

function canvas(): HTMLCanvasElement {
  const made = document.createElement('canvas');
  made.tabIndex = 0;
  made.setAttribute('part', 'view');
  made.setAttribute('role', 'img');
  made.setAttribute('aria-label', 'The surface. Arrow keys rotate it, plus and minus zoom.');
  return made;
}
