// The element: attributes in, a surface and what can be said of it out.
import { invalid } from '../check.js';
import type { MeshArrays } from '../mesh.js';
import type { StepReport } from '../stepper.js';
import init, { type Stepper, type Vec3 } from '../worker.js';
import { fetched, json, type Made, MODELS, startNamed } from './making.js';
import { STYLE } from './style.js';
import { View } from './view.js';

/** The method that a lab runs. */
export type LabMethod = keyof typeof MODELS;

/** What a lab is doing; its attribute `data-state` says so, too. */
export type LabState = 'loading' | 'running' | 'paused' | 'done' | 'error';

/** Milliseconds of steps between two pictures, about, and the most steps. */
const SLICE = 60;
const MOST_STEPS = 256;

const ATTRIBUTES = ['src', 'method', 'start', 'levels', 'params', 'ellipsoids'];

/**
 * `<vesicle-lab>`: loads `src`, runs a method on it, and shows the surface while it grows.
 *
 * Attributes: `src`, the file; `method`, `deformable` (a volume, the default), `implicit` (points), `tracking` (a volume
 * with frames) or `multires` (a mesh, with `ellipsoids` as JSON); `params` of the method as JSON; `levels` of the pyramid
 * and `start`, `contour` (the default) or `enclosing`, of the deformable model;
 * `paused`, not to begin by itself. A change of one of them, but `paused`, begins anew. Events: `vesicle-step` after one
 * step or a few, with a `StepReport` as `detail`, `vesicle-done`, `vesicle-error` with the error. The parts `view`, `controls` and `status` can be
 * styled.
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
  /** Counts openings: what an earlier one brings comes too late. */
  #opening = 0;
  #from: Vec3 = [0, -1, 0];
  #framed = false;

  /** What it is doing. */
  get state(): LabState {
    return (this.dataset.state ?? 'loading') as LabState;
  }

  /** The model, off the main thread, as `vesicle/worker` has it; undefined before it is made. */
  get model(): Stepper | undefined {
    return this.#model;
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

  /** Back to the start, with what the attributes say now. */
  async reset(): Promise<void> {
    this.#close();
    const opening = ++this.#opening;
    this.#is('loading', 'Loading.');
    try {
      const { model, from } = await this.#make();
      if (opening !== this.#opening) return void model.free();
      [this.#model, this.#from, this.#framed] = [model, from, false];
      this.#view?.begin();
      await this.#show();
      this.#is('paused', 'Ready.');
      if (!this.hasAttribute('paused')) await this.play();
    } catch (error) {
      if (opening === this.#opening) this.#fail(error);
    }
  }

  async #make(): Promise<Made> {
    const method = (this.getAttribute('method') ?? 'deformable') as LabMethod;
    const make = MODELS[method];
    if (!Object.hasOwn(MODELS, method))
      throw invalid('method', `'${method}'; there are ${Object.keys(MODELS).join(', ')}`);
    const src = this.getAttribute('src');
    if (!src) throw invalid('src', 'the address of a file is needed');
    const told = {
      start: startNamed(this.getAttribute('start')),
      levels: Number(this.getAttribute('levels') ?? 0),
      params: json<Record<string, unknown>>('params', this.getAttribute('params'), {}),
      ellipsoids: json('ellipsoids', this.getAttribute('ellipsoids'), []),
    };
    const [bytes] = await Promise.all([fetched(new URL(src, document.baseURI).href), init()]);
    return make({ ...told, bytes });
  }

  /** Runs to the end, or until {@link VesicleLab.pause}. */
  async play(): Promise<void> {
    const model = this.#model;
    if (!model || this.state === 'running' || this.state === 'done') return;
    this.#is('running', 'Running.');
    try {
      // Slices that are answered one by one: however fast the steps, the page is never behind.
      for (let steps = 1; this.#runs(model); ) {
        const began = performance.now();
        await this.#go(model, steps);
        const took = performance.now() - began;
        steps = took < SLICE / 2 ? Math.min(2 * steps, MOST_STEPS) : took > SLICE ? Math.ceil(steps / 2) : steps;
      }
    } catch (error) {
      if (model === this.#model) this.#fail(error);
    }
  }

  #runs(model: Stepper): boolean {
    return this.state === 'running' && model === this.#model;
  }

  /** Stops after the steps it is at. */
  pause(): void {
    if (this.state === 'running') this.#is('paused', 'Paused.');
  }

  /** One step of the method. */
  async step(): Promise<void> {
    const model = this.#model;
    if (!model || this.state === 'done') return;
    this.pause();
    try {
      await this.#go(model, 1);
    } catch (error) {
      if (model === this.#model) this.#fail(error);
    }
  }

  /** So many steps, and what came of them on the screen. */
  async #go(model: Stepper, steps: number): Promise<void> {
    const report = await model.step(steps);
    if (model !== this.#model) return;
    this.#parts.figures(report);
    this.dispatchEvent(new CustomEvent('vesicle-step', { detail: report }));
    if (report.done) this.#ended(report);
    await this.#show();
  }

  #ended({ vertices, components }: StepReport): void {
    const parts = components === 1 ? 'one component' : `${components} components`;
    this.#is('done', `Done: ${vertices.toLocaleString('en')} vertices in ${parts}.`);
    this.dispatchEvent(new CustomEvent('vesicle-done'));
  }

  async #show(): Promise<void> {
    const model = this.#model;
    const arrays = (await model?.mesh.arrays()) as MeshArrays | undefined;
    if (model !== this.#model || !arrays?.indices.length) return;
    this.#view?.show(arrays);
    // What it came to may be much smaller than what it began with.
    if (!this.#framed || this.state === 'done') this.#view?.frame(this.#from);
    this.#framed = true;
  }

  #fail(error: unknown): void {
    this.#is('error', error instanceof Error ? error.message : String(error));
    this.dispatchEvent(new CustomEvent('vesicle-error', { detail: error }));
  }

  #is(state: LabState, words: string): void {
    this.dataset.state = state;
    this.#parts.show(state, words);
  }

  #close(): void {
    this.#model?.free();
    this.#model = undefined;
  }
}

/** What stands in the shadow of the element. */
class Parts {
  #canvas = canvas();
  readonly #play = document.createElement('button');
  readonly #step = document.createElement('button');
  readonly #status = document.createElement('output');
  readonly #figures = document.createElement('span');

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
    root.append(this.#canvas, controls);
  }

  /** The view; where there is no WebGL, words in its place. */
  makeView(): View | undefined {
    try {
      return new View(this.#canvas);
    } catch {
      const words = document.createElement('p');
      words.textContent = 'This browser gives no WebGL: there are numbers, but no picture.';
      this.#canvas.replaceWith(words);
      return undefined;
    }
  }

  /** A canvas that had a context keeps it; an element that comes back gets a new one. */
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

  figures({ iteration, vertices, phase }: StepReport): void {
    this.#figures.textContent = `Step ${iteration}, ${phase}: ${vertices.toLocaleString('en')} vertices`;
  }
}

function canvas(): HTMLCanvasElement {
  const made = document.createElement('canvas');
  made.tabIndex = 0;
  made.setAttribute('part', 'view');
  made.setAttribute('role', 'img');
  made.setAttribute('aria-label', 'The surface. Arrow keys turn it, plus and minus zoom.');
  return made;
}
