import { h } from '../../../kit/dom';
import { Field, labelFor } from '../../../kit/field';
import { plural, text } from '../../../texts';
import { type Film, lastFrame } from '../film';

/** Default number of frames from one keyframe of a film to the next. */
export const FRAMES_BETWEEN = 24;
/** Largest number of frames from one keyframe of a film to the next. */
const MOST_BETWEEN = 600;

export interface FilmEvents {
  /** Called to add the current pose of the ellipsoids as a keyframe. */
  onAddKey: () => void;
  /** Called to remove the keyframe with this index, from 0. */
  onRemoveKey: (index: number) => void;
  onBetween: (frames: number) => void;
  onLoop: (loop: boolean) => void;
  /** Called to go to a frame of the film without playing it. */
  onSeek: (frame: number) => void;
  onRecord: () => void;
  onCancelRecord: () => void;
}

/** Controls of the Sculpt lab's film: keyframes, position, playback options and recording. */
export class FilmControls {
  readonly element: HTMLElement;
  readonly #events: FilmEvents;
  readonly #keys = h('div', { class: 'buttons chips', role: 'group', 'aria-label': text('sculptPanels.keyframes') });
  readonly #status = h('p', { class: 'help', role: 'status' });
  readonly #between = new Field(
    h('input', { type: 'number', min: 1, max: MOST_BETWEEN, step: 1, value: FRAMES_BETWEEN, required: true }),
    { label: text('sculptPanels.framesBetween'), row: 'row' },
  );
  readonly #loop = h('input', { type: 'checkbox', 'data-film': 'loop' });
  readonly #seek = h('input', { type: 'range', min: 0, max: 1, value: 0, step: 1 });
  readonly #at = h('output', { 'aria-live': 'off' });
  readonly #record: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #progress = h('progress', {
    max: 1,
    value: 0,
    hidden: true,
    'aria-label': text('sculptPanels.recordingProgress'),
  });
  readonly #remove: HTMLButtonElement;
  #film: Film | undefined;
  #frame = 0;

  constructor(events: FilmEvents) {
    this.#events = events;
    this.#between.control.addEventListener('change', () => this.#setBetween());
    this.#loop.addEventListener('change', () => events.onLoop(this.#loop.checked));
    this.#seek.addEventListener('input', () => events.onSeek(this.#seek.valueAsNumber));
    this.#remove = filmButton('remove', text('sculptPanels.removeKeyframe'), () => this.#removeKey());
    this.#record = filmButton('record', text('sculptPanels.recordGlb'), events.onRecord);
    this.#cancel = filmButton('cancel', text('controls.cancel'), events.onCancelRecord);
    this.#cancel.hidden = true;
    this.element = h(
      'div',
      { class: 'film' },
      h('p', { class: 'help' }, text('sculptPanels.filmHelp')),
      this.#keys,
      h(
        'div',
        { class: 'buttons' },
        filmButton('add', text('sculptPanels.addKeyframe'), events.onAddKey),
        this.#remove,
      ),
      h('div', { class: 'row' }, labelFor(this.#seek, text('controls.frame')), this.#at),
      this.#seek,
      this.#between.element,
      h('label', { class: 'check' }, this.#loop, text('sculptPanels.filmLoop')),
      h('div', { class: 'buttons' }, this.#record, this.#cancel),
      this.#progress,
      this.#status,
    );
    this.show(undefined, 0);
  }

  get between(): number {
    const { control } = this.#between;
    return control.checkValidity() ? control.valueAsNumber : FRAMES_BETWEEN;
  }

  show(film: Film | undefined, frame: number): void {
    this.#film = film;
    this.#frame = frame;
    const last = film ? Math.max(1, lastFrame(film)) : 1;
    this.#seek.max = String(last);
    this.#seek.valueAsNumber = frame;
    this.#seek.disabled = !film || lastFrame(film) < 1;
    this.#record.disabled = this.#seek.disabled;
    this.#at.value = film ? text('controls.frameOf', { frame, last }) : '–';
    this.#loop.checked = film?.loop ?? false;
    this.#loop.disabled = !film;
    this.#between.control.disabled = film !== undefined && 'motion' in film;
    if (film && 'keys' in film) this.#between.control.valueAsNumber = film.between;
    this.#between.showError(undefined);
    this.#showKeys(film);
  }

  /** Shows the progress of a recording of the film, 0 to 1; undefined if none is in progress. */
  showRecording(part: number | undefined): void {
    const recording = part !== undefined;
    this.#progress.hidden = !recording;
    this.#progress.value = part ?? 0;
    if (this.#cancel.hidden === recording) {
      this.#cancel.hidden = !recording;
      this.#record.hidden = recording;
    }
  }

  #showKeys(film: Film | undefined): void {
    const keys = film && 'keys' in film ? film.keys.length : 0;
    while (this.#keys.children.length > keys) this.#keys.lastElementChild?.remove();
    while (this.#keys.children.length < keys) this.#keys.append(this.#keyButton(this.#keys.children.length));
    for (const [index, button] of [...this.#keys.children].entries())
      button.setAttribute('aria-pressed', String(index === this.#present));
    this.#remove.disabled = this.#present === undefined;
    this.#status.textContent =
      film && 'motion' in film
        ? text('sculptPanels.motionComputed')
        : keys === 0
          ? text('sculptPanels.noKeyframes')
          : plural('sculptPanels.keyframeCount', keys);
  }

  /** Index of the keyframe at the current frame; undefined between keyframes, or if the film has none. */
  get #present(): number | undefined {
    const film = this.#film;
    if (!film || !('keys' in film) || this.#frame % film.between !== 0) return undefined;
    return (this.#frame / film.between) % film.keys.length;
  }

  #keyButton(index: number): HTMLButtonElement {
    const go = () => {
      if (this.#film && 'keys' in this.#film) this.#events.onSeek(index * this.#film.between);
    };
    const label = text('sculptPanels.keyframeName', { number: index + 1 });
    return h(
      'button',
      { type: 'button', 'aria-label': label, title: label, 'data-key': index + 1, onclick: go },
      `${index + 1}`,
    );
  }

  #removeKey(): void {
    if (this.#present !== undefined) this.#events.onRemoveKey(this.#present);
  }

  #setBetween(): void {
    const { control } = this.#between;
    const valid = control.checkValidity();
    this.#between.showError(valid ? undefined : text('sculptPanels.framesBetweenError', { most: MOST_BETWEEN }));
    if (valid) this.#events.onBetween(control.valueAsNumber);
    else control.valueAsNumber = this.#film && 'keys' in this.#film ? this.#film.between : FRAMES_BETWEEN;
  }
}

function filmButton(name: string, text: string, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', 'data-film': name, onclick }, text);
}
