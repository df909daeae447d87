import { h, icon } from '../../../kit/dom';
import { labelFor } from '../../../kit/field';
import { count } from '../../../kit/format';
import { text } from '../../../texts';

const PLAY = 'M7 4.5v15l12-7.5z';
const PAUSE = 'M6 5h4.5v14H6zM13.5 5H18v14h-4.5z';
const BACK = 'M6 5h2.5v14H6zM18 5v14l-9-7z';
const ON = 'M6 5v14l9-7zM16 5h2.5v14H16z';
/** Milliseconds for which a frame is shown during playback: slower than a heartbeat, so that the eye can follow. */
const FRAME_MS = 110;

/** Controls of the Track lab to step through the frames of the image, or play those that have a surface in a loop. */
export class FrameBar {
  readonly element: HTMLElement;
  readonly #onFrame: (frame: number) => void;
  readonly #play: HTMLButtonElement;
  readonly #icon = h('span', { class: 'icon-holder' });
  readonly #text = h('span');
  readonly #buttons: HTMLButtonElement[];
  readonly #slider: HTMLInputElement;
  /**
   * Shows the number of the current frame; not announced by screen readers, because the slider announces its value
   * already.
   */
  readonly #at = h('output', { 'aria-live': 'off', 'data-frames': '' });
  #frame = 0;
  #count = 1;
  #done = 0;
  #pending = 0;
  #since = 0;

  /** `onFrame` is called with the frame to show, when the user or playback selects another one. */
  constructor(onFrame: (frame: number) => void) {
    this.#onFrame = onFrame;
    this.#slider = h('input', { type: 'range', min: 0, max: 1, step: 1, value: 0 });
    this.#slider.addEventListener('input', () => this.#byHand(this.#slider.valueAsNumber));
    this.#play = h(
      'button',
      { type: 'button', 'data-frame': 'beat', onclick: () => this.toggle() },
      this.#icon,
      this.#text,
    );
    const previous = labelled('previous', BACK, text('trackPanels.previousFrame'), () => this.go(-1));
    const next = labelled('next', ON, text('trackPanels.nextFrame'), () => this.go(1));
    this.#buttons = [previous, next];
    this.element = h(
      'div',
      { class: 'frames', role: 'group', 'aria-label': text('trackPanels.frames') },
      h('div', { class: 'buttons' }, previous, this.#play, next),
      labelFor(this.#slider, text('controls.frame')),
      this.#slider,
      this.#at,
    );
    this.show(0, 1, 0);
  }

  get frame(): number {
    return this.#frame;
  }

  get playing(): boolean {
    return this.#pending !== 0;
  }

  /**
   * Shows the current `frame`, an index from 0, of `frames`; the first `done` frames have a surface and can be played.
   */
  show(frame: number, frames: number, done: number): void {
    this.#frame = Math.min(frame, frames - 1);
    this.#count = frames;
    this.#done = done;
    if (done < 2) this.stop();
    this.#slider.max = String(Math.max(1, frames - 1));
    this.#slider.valueAsNumber = this.#frame;
    this.#slider.disabled = frames < 2;
    this.#slider.setAttribute('aria-valuetext', text('trackPanels.frameOfSpoken', { frame: this.#frame + 1, frames }));
    this.#at.value = text('controls.frameOf', { frame: count(this.#frame + 1), last: count(frames) });
    this.#play.disabled = done < 2;
    for (const button of this.#buttons) button.disabled = frames < 2;
    this.#label();
  }

  /** Stops playback and moves by `by` frames, cyclically through all frames. */
  go(by: number): void {
    this.#byHand((this.#frame + by + this.#count) % this.#count);
  }

  toggle(): void {
    if (this.playing) this.stop();
    else this.start();
  }

  start(): void {
    if (this.#done < 2 || this.playing) return;
    this.#since = performance.now();
    this.#pending = requestAnimationFrame((now) => this.#turn(now));
    this.#label();
  }

  stop(): void {
    cancelAnimationFrame(this.#pending);
    this.#pending = 0;
    this.#label();
  }

  #turn(now: number): void {
    this.#pending = requestAnimationFrame((next) => this.#turn(next));
    if (now - this.#since < FRAME_MS) return;
    this.#since = now;
    this.#onFrame((this.#frame + 1) % Math.max(1, this.#done));
  }

  #byHand(frame: number): void {
    this.stop();
    this.#onFrame(frame);
  }

  #label(): void {
    this.#icon.replaceChildren(icon(this.playing ? PAUSE : PLAY));
    this.#text.textContent = this.playing ? text('trackPanels.stopLoop') : text('trackPanels.loop');
    const title = this.playing ? text('trackPanels.stopLoopLabel') : text('trackPanels.loopLabel');
    this.#play.title = title;
    this.#play.setAttribute('aria-label', title);
  }
}

function labelled(name: string, path: string, text: string, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', 'data-frame': name, 'aria-label': text, title: text, onclick }, icon(path));
}
