import { signal } from '@preact/signals';
import type { LevelView } from '../../../engine/protocol';
import { levelSymbol } from '../../../kit/format';
import { Check } from '../../../kit/ui/field';
import { Made } from '../../../kit/ui/mount';
import { Button, Help } from '../../../kit/ui/parts';
import { text } from '../../../texts';

const VOLUME = text('extractPanels.levelVolume');

type Picture = HTMLCanvasElement | undefined;

/** The image pyramid, of which one level is shown in the slices. */
export class Pyramid {
  /** Sizes of the levels, from the volume itself, level 0; empty if no levels are shown. */
  readonly dims = signal<readonly string[]>([]);
  /** Number of the level that the model is fitted to. */
  readonly inUse = signal<number | undefined>(undefined);
  /** Number of the level that the slices show. */
  readonly shown = signal(0);
  /** Whether the slices follow the model. */
  readonly follows = signal(false);
  /** Thumbnails of the levels. */
  readonly pictures = signal<readonly Picture[]>([]);
  readonly #picture: (level: LevelView | undefined) => Picture;
  readonly #onShow: (level: LevelView | undefined) => void;
  /** Levels of the pyramid without the volume itself, finest first. */
  #levels: LevelView[] = [];
  #pending = 0;

  /**
   * `picture` renders the current slice of a level for its thumbnail, `onShow` shows a level in the slices; both are
   * called with undefined for the volume itself.
   */
  constructor(picture: (level: LevelView | undefined) => Picture, onShow: (level: LevelView | undefined) => void) {
    this.#picture = picture;
    this.#onShow = onShow;
  }

  /**
   * Shows the pyramid of a volume: `volume` are the dimensions of the volume itself, `levels` its coarser levels,
   * finest first, and `inUse` is the number of the level that the model is fitted to.
   */
  setLevels(volume: readonly number[], levels: LevelView[], inUse: number): void {
    this.#levels = levels;
    const dims = [volume, ...levels.map((level) => level.dims)].map((sizes) => sizes.join(' × '));
    // On the same volume the selection stays if that level still exists.
    const shown = dims[0] === this.dims.peek()[0] ? this.shown.peek() : 0;
    this.dims.value = dims;
    this.inUse.value = inUse;
    this.#show(this.follows.peek() ? inUse : shown);
    this.redraw();
  }

  /** Shows no levels, and the volume itself in the slices. */
  clear(): void {
    this.#levels = [];
    this.dims.value = [];
    this.#show(0);
  }

  /** Marks the level that the model is fitted to; shows it in the slices if the user wants them to follow the model. */
  setInUse(level: number): void {
    if (level === this.inUse.peek()) return;
    this.inUse.value = level;
    if (this.follows.peek()) this.#show(level);
  }

  /** Shows a level that the user has chosen: the slices no longer follow the model. */
  choose(level: number): void {
    this.follows.value = false;
    this.#show(level);
  }

  follow(follows: boolean): void {
    this.follows.value = follows;
    this.#show(follows ? (this.inUse.peek() ?? 0) : 0);
  }

  /** Redraws the thumbnails of all levels at the next animation frame, after the current slice has changed. */
  redraw(): void {
    this.#pending ||= requestAnimationFrame(() => {
      this.#pending = 0;
      this.pictures.value = this.dims.peek().map((_, level) => decorative(this.#picture(this.#levels[level - 1])));
    });
  }

  #show(level: number): void {
    const shown = level < this.dims.peek().length ? level : 0;
    this.shown.value = shown;
    this.#onShow(this.#levels[shown - 1]);
  }
}

/**
 * Panel with the levels of the image pyramid as thumbnails of the current slice; the level that the model is fitted to
 * is marked.
 */
export function PyramidPanel({ pyramid }: { pyramid: Pyramid }) {
  return (
    <div>
      <fieldset class="pyramid" aria-label={text('extractPanels.pyramidLevels')}>
        {pyramid.dims.value.map((_, level) => <LevelButton key={level} {...{ pyramid, level }} />).reverse()}
      </fieldset>
      <Check
        {...{ label: text('extractPanels.slicesFollow'), 'data-pyramid': 'follow' }}
        {...{ on: pyramid.follows.value, set: (on) => pyramid.follow(on) }}
      />
      <Help>{text('extractPanels.pyramidHelp')}</Help>
    </div>
  );
}

function LevelButton({ pyramid, level }: { pyramid: Pyramid; level: number }) {
  const isInUse = level === pyramid.inUse.value;
  const picture = pyramid.pictures.value[level];
  // Includes the visible symbol, which users of voice control say.
  const label = text('extractPanels.levelLabel', {
    symbol: levelSymbol(level),
    name: level === 0 ? VOLUME : text('extractPanels.levelName', { level }),
    dims: pyramid.dims.value[level] ?? '',
    present: isInUse ? text('extractPanels.levelPresent') : '',
  });
  return (
    <Button
      {...{ 'data-level': level, 'aria-pressed': level === pyramid.shown.value, class: isInUse ? 'in-use' : '' }}
      {...{ 'aria-label': label, title: level === 0 ? label : text('extractPanels.levelTitle', { label }) }}
      onClick={() => pyramid.choose(level)}
    >
      {picture && <Made of={picture} />}
      <span class="caption">{levelSymbol(level)}</span>
    </Button>
  );
}

function decorative(canvas: Picture): Picture {
  canvas?.setAttribute('aria-hidden', 'true');
  return canvas;
}
