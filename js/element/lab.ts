// The element: attributes in, a surface and what can be said of it out.
import { invalid } from '../check.js';
import type { MeshArrays } from '../mesh.js';
import type { StepReport } from '../stepper.js';
import init, { type Stepper, type Vec3 } from '../worker.js';
import { fetched, json, type Made, MODELS } from './making.js';
import { STYLE } from './style.js';
import { View } from './view.js';

/** The method that a lab runs. */
export type LabMethod = keyof typeof MODELS;

/** What a lab is doing; its attribute `data-state` says so, too. */
export type LabState = 'loading' | 'running' | 'paused' | 'done' | 'error';

const ATTRIBUTES = ['src', 'method', 'levels', 'params', 'ellipsoids'];

/**
 * `<vesicle-lab>`: loads `src`, runs a method on it, and shows the surface while it grows.
 *
 * Attributes: `src`, the file; `method`, `deformable` (a volume, the default), `implicit` (points), `tracking` (a volume
 * with frames) or `multires` (a mesh, with `ellipsoids` as JSON); `params` of the method as JSON; `levels` of the pyramid;
 * `paused`, not to begin by itself. A change of one of them, but `paused`, begins anew. Events: `vesicle-step` with a
 * `StepReport` as `detail`, `vesicle-done`, `vesicle-error` with the error. The parts `view`, `controls` and `status` can be
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
  #stop: AbortController | undefined;
  /** Counts openings: what an earlier one brings comes too late. */
  #opening = 0;
  #drawing = false;
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
    const stop = new AbortController();
    this.#stop = stop;
    this.#is('running', 'Running.');
    try {
      this.#ended(await model.run({ signal: stop.signal, onStep: (report) => this.#stepped(report) }));
      await this.#show();
    } catch (error) {
      if (!stop.signal.aborted) this.#fail(error);
    }
  }

  /** Stops after the step it is at. */
  pause(): void {
    if (this.state !== 'running') return;
    this.#stop?.abort();
    this.#is('paused', 'Paused.');
  }

  /** One step of the method. */
  async step(): Promise<void> {
    const model = this.#model;
    if (!model || this.state === 'done') return;
    this.pause();
    try {
      const report = await model.step();
      this.#stepped(report);
      if (report.done) this.#ended(report);
      await this.#show();
    } catch (error) {
      this.#fail(error);
    }
  }

  #stepped(report: StepReport): void {
    this.#parts.figures(report);
    this.dispatchEvent(new CustomEvent('vesicle-step', { detail: report }));
    // One surface on its way at a time: the worker makes no more than are drawn.
    if (!this.#drawing) void this.#show().catch(() => undefined);
  }

  #ended({ vertices, components, done }: StepReport): void {
    if (!done) return;
    const parts = components === 1 ? 'one component' : `${components} components`;
    this.#is('done', `Done: ${vertices.toLocaleString('en')} vertices in ${parts}.`);
    this.dispatchEvent(new CustomEvent('vesicle-done'));
  }

  async #show(): Promise<void> {
    const model = this.#model;
    if (!model) return;
    this.#drawing = true;
    try {
      const arrays = (await model.mesh.arrays()) as MeshArrays;
      if (model !== this.#model || arrays.indices.length === 0) return;
      this.#view?.show(arrays);
      // What it came to may be much smaller than what it began with.
      if (!this.#framed || this.state === 'done') this.#view?.frame(this.#from);
      this.#framed = true;
    } finally {
      this.#drawing = false;
    }
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
    this.#stop?.abort();
    this.#stop = undefined;
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
