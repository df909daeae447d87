import { signal } from '@preact/signals';
import { context2d, token } from '../kit/dom';
import type { LabState } from '../kit/state';
import { Check, Field, NumberInput } from '../kit/ui/field';
import { useId } from '../kit/ui/id';
import { Button, Help, Refusal, Select } from '../kit/ui/parts';
import { begun, ended, IDLE, Task } from '../kit/ui/task';
import { text } from '../texts';
import { SLICE_NAMES } from './anatomy';
import { FilmRecorder, filmType, MOST_FILM } from './film-recorder';
import type { Legend } from './legend';
import type { SlicePanel } from './panel';
import { ON_BLACK, pageInks, paintScaleBar } from './scale-bar';
import type { Viewport } from './viewport';

type Size = readonly [number, number];

const FILMS = { turn: text('pictures.turn'), run: text('pictures.run'), open: text('pictures.open') };
type Film = keyof typeof FILMS;
const VIEW = { view: text('pictures.view') };
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

/** The settings of pictures and films. */
interface Settings {
  /** The 3D view, or a slice. */
  content: string;
  width: number;
  height: number;
  scaleBar: boolean;
  legend: boolean;
  transparent: boolean;
  film: Film;
  /** Duration of a turn. */
  seconds: number;
}

/** Saves the 3D view or a slice as a picture, and the 3D view as a film. */
export class Pictures {
  readonly subject: PictureSubject;
  readonly settings = signal<Settings>({
    ...{ content: 'view', width: 1920, height: 1080, scaleBar: true, legend: true, transparent: false },
    ...{ film: 'turn', seconds: 8 },
  });
  /** Why nothing is saved. */
  readonly message = signal('');
  /** Why settings are refused. */
  readonly refused = signal<Partial<Record<'width' | 'height' | 'seconds', string>>>({});
  readonly task = signal(IDLE);
  readonly #events: PictureEvents;
  /** Ends the film that is being recorded; `isKept`: whether it is saved. */
  #end: (isKept: boolean) => void = () => undefined;
  #state: LabState = 'loading';

  constructor(subject: PictureSubject, events: PictureEvents) {
    this.subject = subject;
    this.#events = events;
  }

  get films(): Partial<Record<Film, string>> {
    const { run, ...others } = FILMS;
    return this.#events.onRun ? FILMS : others;
  }

  set(changed: Partial<Settings>): void {
    this.settings.value = { ...this.settings.peek(), ...changed };
  }

  /** Ends the film that is being recorded. */
  end(isKept: boolean): void {
    this.#end(isKept);
  }

  /** Ends the film of a run when the run ends. */
  showState(state: LabState): void {
    if (this.#state === 'running' && state !== 'running' && this.settings.peek().film === 'run') this.#end(true);
    this.#state = state;
  }

  /** Ends a recording without saving it. */
  dispose(): void {
    this.#end(false);
  }

  /** Returns the chosen size in pixels; says why and returns undefined if it is not from 16 to `most`. */
  #sizeUpTo(most: number): Size | undefined {
    const { width, height } = this.settings.peek();
    if (most === 0) this.message.value = text('view.noWebGl');
    const fits = (length: number) => Number.isInteger(length) && length >= LEAST && length <= (most || MOST_FILM);
    const why = (length: number) => (fits(length) ? '' : text('pictures.sizeError', { least: LEAST, most }));
    this.refused.value = { width: why(width), height: why(height) };
    return most > 0 && fits(width) && fits(height) ? [width, height] : undefined;
  }

  async savePicture(): Promise<void> {
    const { content } = this.settings.peek();
    const panel = this.subject.panels?.().find(({ orientation }) => orientation.name === content);
    this.message.value = content === 'view' || panel ? '' : text('pictures.noSlice');
    const size = this.#sizeUpTo(panel ? MOST_SLICE : this.subject.viewport.largest);
    if (!size || this.message.peek()) return;
    const canvas = canvasOf(size);
    const isDrawn = panel ? this.#paintSlice(canvas, panel) : this.#renderAt(size, () => this.#paintView(canvas));
    if (!panel) this.#release();
    const blob = isDrawn && (await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve)));
    if (!blob) return this.#reject(size);
    const suffix = panel ? `-${content.toLowerCase()}` : '';
    this.#events.save('png', new Uint8Array(await blob.arrayBuffer()), 'image/png', suffix);
  }

  #reject([width, height]: Size): void {
    this.message.value = text('pictures.tooLarge', { width, height });
  }

  /** Renders the 3D view at a size in pixels until {@link #release}; returns false if the memory does not suffice. */
  #renderAt(size: Size, onDrawn: () => void): boolean {
    this.subject.viewport.onDrawn = onDrawn;
    return this.subject.viewport.fixSize(size);
  }

  #release(): void {
    this.subject.viewport.onDrawn = () => undefined;
    this.subject.viewport.fixSize(undefined);
  }

  #paintSlice(canvas: HTMLCanvasElement, panel: SlicePanel): boolean {
    const background = this.settings.peek().transparent ? undefined : ON_BLACK.contour;
    return this.#paint(canvas, background, (context, size) => panel.paint(context, ...size), ON_BLACK);
  }

  /** Copies the rendering that the 3D view's canvas holds at present into a picture, or a frame of a film. */
  #paintView(canvas: HTMLCanvasElement, isTransparent = this.settings.peek().transparent): boolean {
    const { viewport, legend } = this.subject;
    return this.#paint(
      canvas,
      isTransparent ? undefined : viewBackground(canvas),
      (context, [width, height], scale) => {
        context.drawImage(viewport.canvas, 0, 0, width, height);
        if (this.settings.peek().legend) legend?.paint(context, width, pageInks());
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
    if (this.settings.peek().scaleBar) paintScaleBar(context, size, perUnit, this.#events.unit(), inks);
    return true;
  }

  /** Records a film, until it ends or is ended. */
  async record(): Promise<void> {
    try {
      await this.#record();
    } catch (error) {
      // This browser has refused it.
      this.#release();
      this.task.value = ended(error instanceof Error ? error.message : String(error));
    }
  }

  async #record(): Promise<void> {
    const type = filmType();
    const { film, seconds } = this.settings.peek();
    this.message.value = '';
    const size = this.#sizeUpTo(Math.min(this.subject.viewport.largest, MOST_FILM));
    const isTimed = film !== 'turn' || (seconds >= 1 && seconds <= MOST_SECONDS);
    if (!isTimed)
      this.refused.value = { ...this.refused.peek(), seconds: text('pictures.secondsError', { most: MOST_SECONDS }) };
    if (!type) return this.#stop(text('pictures.noWebm'));
    if (film === 'run' && !['running', 'paused'].includes(this.#state)) return this.#stop(text('pictures.noRun'));
    if (!size || !isTimed) return;
    const canvas = canvasOf(size);
    const recorder = new FilmRecorder(canvas, type);
    this.task.value = begun(text('pictures.recording'));
    const isDrawn = this.#renderAt(size, () => {
      this.#paintView(canvas, false);
      recorder.addFrame();
    });
    const isKept = isDrawn && (await this.#recordUntilEnd(film));
    this.#release();
    const bytes = isKept ? await recorder.finish() : await recorder.cancel();
    const isLost = isDrawn && !bytes;
    this.#stop(bytes?.length === 0 ? text('pictures.noFrames') : isLost ? text('controls.cancelled') : '');
    if (bytes?.length) this.#events.save('webm', bytes, 'video/webm', '');
    else if (!isDrawn) this.#reject(size);
  }

  #stop(message: string): void {
    this.task.value = ended(message);
  }

  /** Waits until the turn or the run has ended, or the user has ended the film; returns whether it is kept. */
  async #recordUntilEnd(film: Film): Promise<boolean> {
    const ended = new Promise<boolean>((resolve) => {
      this.#end = resolve;
    });
    const stop = film === 'turn' ? this.#turn(1000 * this.settings.peek().seconds) : undefined;
    if (film === 'run' && this.#state === 'paused') this.#events.onRun?.();
    const isKept = await ended;
    this.#end = () => undefined;
    stop?.();
    return isKept;
  }

  /** Turns the view once in the given time, then ends the recording; the function returned stops, and turns it back. */
  #turn(milliseconds: number): () => void {
    const { viewport } = this.subject;
    const begun = performance.now();
    let [part, pending] = [0, 0];
    const turnTo = (next: number) => {
      viewport.turn(2 * Math.PI * (next - part));
      part = next;
    };
    const advance = (now: number) => {
      if (part === 1) return this.#end(true);
      turnTo(Math.min(1, Math.max(0, now - begun) / milliseconds));
      this.task.value = { ...this.task.peek(), progress: part };
      pending = requestAnimationFrame(advance);
    };
    pending = requestAnimationFrame(advance);
    return () => {
      cancelAnimationFrame(pending);
      turnTo(0);
    };
  }
}

/** Controls of pictures and films. */
export function PicturePanel({ pictures }: { pictures: Pictures }) {
  const { subject, message, films } = pictures;
  const { content, scaleBar, legend, transparent } = pictures.settings.value;
  const { film, seconds } = pictures.settings.value;
  const refused = pictures.refused.value;
  const isRecording = pictures.task.value.isRunning;
  const contents: Record<string, string> = subject.panels ? { ...VIEW, ...SLICE_NAMES } : VIEW;
  return (
    <details class="picture-panel">
      <summary>{text('pictures.title')}</summary>
      <Choice
        {...{ name: 'content', label: text('pictures.content'), choices: contents, value: content }}
        onChoose={(chosen) => pictures.set({ content: chosen })}
      />
      <Length pictures={pictures} name="width" label={text('pictures.width')} />
      <Length pictures={pictures} name="height" label={text('pictures.height')} />
      <Check
        {...{ 'data-picture': 'scale-bar', label: text('pictures.scaleBar'), on: scaleBar }}
        set={(on) => pictures.set({ scaleBar: on })}
      />
      <Help>{text('pictures.scaleBarHelp')}</Help>
      {subject.legend && (
        <Check
          {...{ 'data-picture': 'legend', label: text('pictures.legend'), on: legend }}
          set={(on) => pictures.set({ legend: on })}
        />
      )}
      <Check
        {...{ 'data-picture': 'transparent', label: text('pictures.transparent'), on: transparent }}
        set={(on) => pictures.set({ transparent: on })}
      />
      <Button data-picture="save" disabled={isRecording} onClick={() => void pictures.savePicture()}>
        {text('pictures.save')}
      </Button>
      <Refusal>{message}</Refusal>
      <Choice
        {...{ name: 'film', label: text('pictures.film'), choices: films, value: film, disabled: isRecording }}
        onChoose={(chosen) => pictures.set({ film: chosen })}
      />
      <Field
        {...{ isRow: true, label: text('pictures.seconds'), unit: 's', help: text('pictures.secondsHelp') }}
        error={refused.seconds}
        hidden={film !== 'turn'}
      >
        {(tied) => (
          <NumberInput
            {...{ ...tied, min: 1, max: MOST_SECONDS, shown: shownAs(seconds) }}
            onEnter={(value) => pictures.set({ seconds: value })}
          />
        )}
      </Field>
      <Help>{text('pictures.filmHelp')}</Help>
      <Task
        {...{ task: pictures.task.value, name: 'picture', start: text('pictures.record') }}
        progress={text('pictures.progress')}
        isEnabled
        onStart={() => void pictures.record()}
        onCancel={() => pictures.end(false)}
        during={
          <Button data-picture="finish" hidden={film === 'turn'} onClick={() => pictures.end(true)}>
            {text('pictures.finish')}
          </Button>
        }
      />
    </details>
  );
}

interface ChoiceProps<Value extends string> {
  name: string;
  label: string;
  choices: Partial<Record<Value, string>>;
  value: Value;
  disabled?: boolean;
  onChoose: (value: Value) => void;
}

function Choice<Value extends string>({ name, label, choices, ...props }: ChoiceProps<Value>) {
  const id = useId();
  return (
    <div class="row">
      <label for={id}>{label}</label>
      <Select {...{ id, 'data-picture': name, choices: choices as Record<Value, string>, ...props }} />
    </div>
  );
}

/** A side of pictures, in pixels. */
function Length({ pictures, name, label }: { pictures: Pictures; name: 'width' | 'height'; label: string }) {
  return (
    <Field isRow label={label} unit="px" error={pictures.refused.value[name]}>
      {(tied) => (
        <NumberInput
          {...{ ...tied, min: LEAST, step: 1, shown: shownAs(pictures.settings.value[name]), 'data-picture': name }}
          onEnter={(value) => pictures.set({ [name]: value })}
        />
      )}
    </Field>
  );
}

/** Shows a number that was entered; nothing if it was none. */
const shownAs = (value: number) => (Number.isNaN(value) ? '' : String(value));

function canvasOf([width, height]: Size): HTMLCanvasElement {
  return Object.assign(document.createElement('canvas'), { width, height });
}

/** Returns the background of the 3D view on the page, for a picture. */
function viewBackground({ width, height }: HTMLCanvasElement): CanvasGradient | undefined {
  const [x, y] = [0.5 * width, 0.42 * height];
  const gradient = context2d(document.createElement('canvas'))?.createRadialGradient(
    x,
    y,
    0,
    x,
    y,
    Math.hypot(x, height - y),
  );
  gradient?.addColorStop(0, token('--view-near'));
  gradient?.addColorStop(1, token('--view-far'));
  return gradient;
}
