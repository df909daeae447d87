import { context2d, h, token } from '../kit/dom';
import { type Choice, Field, labelFor, selectFrom } from '../kit/field';
import type { LabState } from '../kit/state';
import { TaskControls } from '../kit/task';
import { text } from '../texts';
import { SLICE_NAMES } from './anatomy';
import { FilmRecorder, filmType, MOST_FILM } from './film-recorder';
import type { Legend } from './legend';
import type { SlicePanel } from './panel';
import { ON_BLACK, pageInks, paintScaleBar } from './scale-bar';
import type { Viewport } from './viewport';

type Size = readonly [number, number];

const SLICES = Object.entries(SLICE_NAMES).map(([value, label]) => ({ value, label }));
type Film = 'turn' | 'run' | 'open';
const FILMS: Choice<Film>[] = [
  { value: 'turn', label: text('pictures.turn') },
  { value: 'run', label: text('pictures.run') },
  { value: 'open', label: text('pictures.open') },
];
const DEFAULT_SIZE: Size = [1920, 1080];
const [LEAST, MOST_SLICE] = [16, 8192];
/** Shorter side of a picture in CSS pixels, as far as the size of texts and lines is concerned. */
const NOMINAL_SIDE = 480;
const MOST_SECONDS = 120;

/** The views of a lab, for pictures and films. */
export interface PictureSubject {
  viewport: Viewport;
  legend?: Legend;
  /** Panels of the slices at present. */
  panels?: () => readonly SlicePanel[];
}

export interface PictureEvents {
  /** Returns the unit of length of the data; empty if unknown. */
  unit: () => string;
  save: (extension: string, bytes: Uint8Array, type: string, suffix: string) => void;
  /** Called to start or continue the run, of which a film is recorded; undefined if there are no runs. */
  onRun: (() => void) | undefined;
}

/** Panel that saves the 3D view or a slice as a picture, and the 3D view as a film. */
export class PicturePanel {
  readonly element: HTMLElement;
  readonly #subject: PictureSubject;
  readonly #events: PictureEvents;
  readonly #content: HTMLSelectElement;
  readonly #width = lengthField('width', text('pictures.width'), DEFAULT_SIZE[0]);
  readonly #height = lengthField('height', text('pictures.height'), DEFAULT_SIZE[1]);
  readonly #scaleBar = checkbox('scale-bar', true);
  readonly #legend = checkbox('legend', true);
  readonly #transparent = checkbox('transparent', false);
  readonly #message = h('p', { class: 'field-error', role: 'alert' });
  readonly #film: HTMLSelectElement;
  readonly #seconds = new Field(
    h('input', { type: 'number', min: 1, max: MOST_SECONDS, step: 'any', value: 8, required: true }),
    { label: text('pictures.seconds'), unit: 's', help: text('pictures.secondsHelp'), row: 'row' },
  );
  readonly #save: HTMLButtonElement;
  readonly #finish: HTMLButtonElement;
  readonly #task: TaskControls;
  /** Ends the film that is being recorded; `isKept`: whether it is saved. */
  #end: (isKept: boolean) => void = () => undefined;
  #state: LabState = 'loading';

  constructor(subject: PictureSubject, events: PictureEvents) {
    this.#subject = subject;
    this.#events = events;
    const films = FILMS.filter(({ value }) => value !== 'run' || events.onRun);
    this.#film = selectFrom(films, { 'data-picture': 'film' });
    const view = { value: 'view', label: text('pictures.view') };
    this.#content = selectFrom(subject.panels ? [view, ...SLICES] : [view], { 'data-picture': 'content' });
    const button = (name: string, onclick: () => void, label: string) =>
      h('button', { type: 'button', 'data-picture': name, onclick }, label);
    this.#save = button('save', () => void this.#savePicture(), text('pictures.save'));
    this.#finish = button('finish', () => this.#end(true), text('pictures.finish'));
    this.#task = new TaskControls({
      name: 'picture',
      start: text('pictures.record'),
      progress: text('pictures.progress'),
      onStart: () => void this.#record().catch((error) => this.#fail(error)),
      onCancel: () => this.#end(false),
      during: [this.#finish],
    });
    this.#film.addEventListener('change', () => this.#showKind());
    this.element = h(
      'details',
      { class: 'picture-panel' },
      h('summary', {}, text('pictures.title')),
      row(text('pictures.content'), this.#content),
      this.#width.element,
      this.#height.element,
      h('label', { class: 'check' }, this.#scaleBar, text('pictures.scaleBar')),
      h('p', { class: 'help' }, text('pictures.scaleBarHelp')),
      ...(subject.legend ? [h('label', { class: 'check' }, this.#legend, text('pictures.legend'))] : []),
      h('label', { class: 'check' }, this.#transparent, text('pictures.transparent')),
      this.#save,
      this.#message,
      row(text('pictures.film'), this.#film),
      this.#seconds.element,
      h('p', { class: 'help' }, text('pictures.filmHelp')),
      ...this.#task.elements,
    );
    this.#showKind();
  }

  /** Ends the film of a run when the run ends. */
  showState(state: LabState): void {
    if (this.#state === 'running' && state !== 'running' && this.#film.value === 'run') this.#end(true);
    this.#state = state;
  }

  /** Ends a recording without saving it. */
  dispose(): void {
    this.#end(false);
  }

  /** Whether controls are disabled that would disturb a recording. */
  set #blocked(isBlocked: boolean) {
    this.#save.disabled = isBlocked;
    this.#film.disabled = isBlocked;
  }

  #showKind(): void {
    this.#seconds.element.hidden = this.#film.value !== 'turn';
  }

  /** Returns the chosen size in pixels; shows a message and returns undefined if it is not from 16 to `most`. */
  #sizeUpTo(most: number): Size | undefined {
    if (most === 0) this.#message.textContent = text('view.noWebGl');
    const fields = [this.#width, this.#height];
    for (const field of fields) {
      field.control.max = String(most || MOST_FILM);
      field.showError(field.control.checkValidity() ? undefined : text('pictures.sizeError', { least: LEAST, most }));
    }
    const [width = 0, height = 0] = fields.map(({ control }) => control.valueAsNumber);
    return most > 0 && fields.every(({ control }) => control.checkValidity()) ? [width, height] : undefined;
  }

  async #savePicture(): Promise<void> {
    const content = this.#content.value;
    const panel = this.#subject.panels?.().find(({ orientation }) => orientation.name === content);
    this.#message.textContent = content === 'view' || panel ? '' : text('pictures.noSlice');
    const size = this.#sizeUpTo(panel ? MOST_SLICE : this.#subject.viewport.largest);
    if (!size || this.#message.textContent) return;
    const canvas = canvasOf(size);
    const isDrawn = panel ? this.#paintSlice(canvas, panel) : this.#renderAt(size, () => this.#paintView(canvas));
    if (!panel) this.#release();
    const blob = isDrawn && (await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve)));
    if (!blob) return this.#reject(size);
    const suffix = panel ? `-${content.toLowerCase()}` : '';
    this.#events.save('png', new Uint8Array(await blob.arrayBuffer()), 'image/png', suffix);
  }

  #reject([width, height]: Size): void {
    this.#message.textContent = text('pictures.tooLarge', { width, height });
  }

  /** Renders the 3D view at a size in pixels until {@link #release}; returns false if the memory does not suffice. */
  #renderAt(size: Size, onDrawn: () => void): boolean {
    this.#subject.viewport.onDrawn = onDrawn;
    return this.#subject.viewport.fixSize(size);
  }

  #release(): void {
    this.#subject.viewport.onDrawn = () => undefined;
    this.#subject.viewport.fixSize(undefined);
  }

  #paintSlice(canvas: HTMLCanvasElement, panel: SlicePanel): boolean {
    const background = this.#transparent.checked ? undefined : ON_BLACK.contour;
    return this.#paint(canvas, background, (context, size) => panel.paint(context, ...size), ON_BLACK);
  }

  /** Copies the rendering that the 3D view's canvas holds at present into a picture, or a frame of a film. */
  #paintView(canvas: HTMLCanvasElement, isTransparent = this.#transparent.checked): boolean {
    const { viewport, legend } = this.#subject;
    return this.#paint(
      canvas,
      isTransparent ? undefined : viewBackground(canvas),
      (context, [width, height], scale) => {
        context.drawImage(viewport.canvas, 0, 0, width, height);
        if (this.#legend.checked) legend?.paint(context, width, pageInks());
        return 1 / (viewport.unitsPerPixel * scale);
      },
    );
  }

  /**
   * Draws a picture with its background and scale bar. `draw` draws the content, in CSS pixels of which each is `scale`
   * pixels of the picture, and returns the length of a unit of the data in them.
   */
  #paint(
    canvas: HTMLCanvasElement,
    background: string | CanvasGradient | undefined,
    draw: (context: CanvasRenderingContext2D, size: Size, scale: number) => number,
    inks = pageInks(),
  ): boolean {
    const context = canvas.getContext('2d');
    if (!context) return false;
    context.reset();
    context.fillStyle = background ?? 'transparent';
    context.fillRect(0, 0, canvas.width, canvas.height);
    const scale = Math.min(canvas.width, canvas.height) / NOMINAL_SIDE;
    const size: Size = [canvas.width / scale, canvas.height / scale];
    context.scale(scale, scale);
    context.font = '13px system-ui, sans-serif';
    const perUnit = draw(context, size, scale);
    if (this.#scaleBar.checked) paintScaleBar(context, size, perUnit, this.#events.unit(), inks);
    return true;
  }

  async #record(): Promise<void> {
    const type = filmType();
    this.#message.textContent = '';
    const size = this.#sizeUpTo(Math.min(this.#subject.viewport.largest, MOST_FILM));
    const film = this.#film.value as Film;
    const isTimed = film !== 'turn' || this.#seconds.control.checkValidity();
    this.#seconds.showError(isTimed ? undefined : text('pictures.secondsError', { most: MOST_SECONDS }));
    if (!type) return this.#task.end(text('pictures.noWebm'));
    if (film === 'run' && !['running', 'paused'].includes(this.#state)) return this.#task.end(text('pictures.noRun'));
    if (!size || !isTimed) return;
    const canvas = canvasOf(size);
    const recorder = new FilmRecorder(canvas, type);
    this.#task.begin(text('pictures.recording'));
    this.#finish.hidden = film === 'turn';
    this.#blocked = true;
    const isDrawn = this.#renderAt(size, () => {
      this.#paintView(canvas, false);
      recorder.addFrame();
    });
    const isKept = isDrawn && (await this.#recordUntilEnd(film));
    this.#release();
    const bytes = isKept ? await recorder.finish() : await recorder.cancel();
    this.#blocked = false;
    this.#task.end(
      bytes?.length === 0 ? text('pictures.noFrames') : isDrawn && !bytes ? text('controls.cancelled') : '',
    );
    if (bytes?.length) this.#events.save('webm', bytes, 'video/webm', '');
    else if (!isDrawn) this.#reject(size);
  }

  /** Ends a recording that this browser has refused. */
  #fail(error: unknown): void {
    this.#release();
    this.#blocked = false;
    this.#task.end(error instanceof Error ? error.message : String(error));
  }

  /** Waits until the turn or the run has ended, or the user has ended the film; returns whether it is kept. */
  async #recordUntilEnd(film: Film): Promise<boolean> {
    const ended = new Promise<boolean>((resolve) => {
      this.#end = resolve;
    });
    const stop = film === 'turn' ? this.#turn(1000 * this.#seconds.control.valueAsNumber) : undefined;
    if (film === 'run' && this.#state === 'paused') this.#events.onRun?.();
    const isKept = await ended;
    this.#end = () => undefined;
    stop?.();
    return isKept;
  }

  /** Turns the view once in the given time, then ends the recording; the function returned stops, and turns it back. */
  #turn(milliseconds: number): () => void {
    const { viewport } = this.#subject;
    const begun = performance.now();
    let [part, pending] = [0, 0];
    const turnTo = (next: number) => {
      viewport.turn(2 * Math.PI * (next - part));
      part = next;
    };
    const advance = (now: number) => {
      if (part === 1) return this.#end(true);
      turnTo(Math.min(1, Math.max(0, now - begun) / milliseconds));
      this.#task.showProgress(part);
      pending = requestAnimationFrame(advance);
    };
    pending = requestAnimationFrame(advance);
    return () => {
      cancelAnimationFrame(pending);
      turnTo(0);
    };
  }
}

function lengthField(name: string, label: string, value: number): Field {
  const input = h('input', { type: 'number', min: LEAST, step: 1, value, required: true, 'data-picture': name });
  return new Field(input, { label, unit: 'px', row: 'row' });
}

function checkbox(name: string, checked: boolean): HTMLInputElement {
  return h('input', { type: 'checkbox', checked, 'data-picture': name });
}

function row(label: string, control: HTMLElement): HTMLElement {
  return h('div', { class: 'row' }, labelFor(control, label), control);
}

function canvasOf([width, height]: Size): HTMLCanvasElement {
  return h('canvas', { width, height });
}

/** Returns the background of the 3D view on the page, for a picture. */
function viewBackground({ width, height }: HTMLCanvasElement): CanvasGradient | undefined {
  const [x, y] = [0.5 * width, 0.42 * height];
  const gradient = context2d(h('canvas'))?.createRadialGradient(x, y, 0, x, y, Math.hypot(x, height - y));
  gradient?.addColorStop(0, token('--view-near'));
  gradient?.addColorStop(1, token('--view-far'));
  return gradient;
}
