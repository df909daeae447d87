import type { LevelView } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { levelSymbol } from '../../../kit/format';
import { text } from '../../../texts';

const VOLUME = text('extractPanels.levelVolume');

/**
 * Panel with the levels of the image pyramid as thumbnails of the current slice; the level that the model is fitted to
 * is marked.
 */
export class PyramidPanel {
  readonly #list = h('div', { class: 'pyramid', role: 'group', 'aria-label': text('extractPanels.pyramidLevels') });
  readonly #follow = h('input', { type: 'checkbox', 'data-pyramid': 'follow' });
  readonly element = h(
    'div',
    {},
    this.#list,
    h('label', { class: 'check' }, this.#follow, text('extractPanels.slicesFollow')),
    h('p', { class: 'help' }, text('extractPanels.pyramidHelp')),
  );
  readonly #onShow: (level: LevelView | undefined) => void;
  readonly #picture: (level: LevelView | undefined) => HTMLCanvasElement | undefined;
  #buttons: HTMLButtonElement[] = [];
  #dims: string[] = [];
  /** Levels of the pyramid without the volume itself, finest first. */
  #levels: LevelView[] = [];
  #inUse: number | undefined;
  #shown = 0;
  #pending = 0;

  /**
   * `picture` renders the current slice of a level for its thumbnail, `onShow` shows a level in the slices; both are
   * called with undefined for the volume itself.
   */
  constructor(
    picture: (level: LevelView | undefined) => HTMLCanvasElement | undefined,
    onShow: (level: LevelView | undefined) => void,
  ) {
    this.#picture = picture;
    this.#onShow = onShow;
    this.#follow.addEventListener('change', () => this.#choose(this.#follow.checked ? (this.#inUse ?? 0) : 0));
  }

  /**
   * Shows the pyramid of a volume: `volume` are the dimensions of the volume itself, `levels` its coarser levels,
   * finest first, and `inUse` is the number of the level that the model is fitted to.
   */
  setLevels(volume: readonly number[], levels: LevelView[], inUse: number): void {
    this.#levels = levels;
    const dims = [volume, ...levels.map((level) => level.dims)].map((sizes) => sizes.join(' × '));
    // On the same volume the selection stays if that level still exists.
    const shown = dims[0] === this.#dims[0] ? this.#shown : 0;
    this.#dims = dims;
    this.#buttons = this.#dims.map((_, level) => this.#button(level));
    // Coarse to fine, in the order of the model.
    this.#list.replaceChildren(...[...this.#buttons].reverse());
    this.#inUse = inUse;
    this.#choose(this.#follow.checked ? inUse : shown);
    this.redraw();
  }

  /** Shows no levels, and the volume itself in the slices. */
  clear(): void {
    this.#levels = [];
    this.#dims = [];
    this.#buttons = [];
    this.#list.replaceChildren();
    this.#choose(0);
  }

  /** Marks the level that the model is fitted to; shows it in the slices if the user wants them to follow the model. */
  setInUse(level: number): void {
    if (level === this.#inUse) return;
    this.#inUse = level;
    this.#mark();
    if (this.#follow.checked) this.#choose(level);
  }

  /** Redraws the thumbnails of all levels at the next animation frame, after the current slice has changed. */
  redraw(): void {
    this.#pending ||= requestAnimationFrame(() => {
      this.#pending = 0;
      for (const [level, button] of this.#buttons.entries()) {
        const picture = this.#picture(this.#levels[level - 1]);
        if (picture) button.querySelector('canvas')?.replaceWith(decorative(picture));
      }
    });
  }

  #button(level: number): HTMLButtonElement {
    const onclick = () => {
      this.#follow.checked = false;
      this.#choose(level);
    };
    const caption = h('span', { class: 'caption' }, levelSymbol(level));
    return h('button', { type: 'button', 'data-level': level, onclick }, decorative(h('canvas')), caption);
  }

  #choose(level: number): void {
    this.#shown = this.#buttons[level] ? level : 0;
    this.#mark();
    this.#onShow(this.#levels[this.#shown - 1]);
  }

  #mark(): void {
    for (const [level, button] of this.#buttons.entries()) {
      const inUse = level === this.#inUse;
      button.setAttribute('aria-pressed', String(level === this.#shown));
      button.classList.toggle('in-use', inUse);
      const name = level === 0 ? VOLUME : text('extractPanels.levelName', { level });
      // Includes the visible symbol, which users of voice control say.
      const label = text('extractPanels.levelLabel', {
        symbol: levelSymbol(level),
        name,
        dims: this.#dims[level] ?? '',
        present: inUse ? text('extractPanels.levelPresent') : '',
      });
      button.setAttribute('aria-label', label);
      button.title = level === 0 ? label : text('extractPanels.levelTitle', { label });
    }
  }
}

function decorative(canvas: HTMLCanvasElement): HTMLCanvasElement {
  canvas.setAttribute('aria-hidden', 'true');
  return canvas;
}
