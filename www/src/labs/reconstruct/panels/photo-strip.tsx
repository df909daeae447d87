import { signal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { context2d } from '../../../kit/dom';
import { kept } from '../../../kit/ui/mount';
import { Button, Help } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import type { Photograph } from '../photographs';

const THUMBNAIL = 72;

/** The photographs of open points, of which one can be selected. */
export class Photographs {
  readonly all = signal<readonly Photograph[]>([]);
  /** Index of the selected photograph, from 0. */
  readonly chosen = signal<number | undefined>(undefined);
  /** Index of the thumbnail that is the only tab stop. */
  readonly stop = signal(0);
  readonly #onChoose: (index: number | undefined) => void;

  constructor(onChoose: (index: number | undefined) => void) {
    this.#onChoose = onChoose;
  }

  show(photographs: readonly Photograph[]): void {
    this.choose(undefined);
    for (const { picture } of this.all.peek())
      if (!photographs.some((one) => one.picture === picture)) picture?.close();
    this.all.value = photographs;
    this.stop.value = 0;
  }

  /**
   * Selects the photograph with the index `index`, from 0, which is then shown beside the 3D view; none if undefined.
   */
  choose(index: number | undefined): void {
    const isChanged = index !== this.chosen.peek();
    const chosen = index !== undefined && this.all.peek()[index] ? index : undefined;
    this.chosen.value = chosen;
    if (chosen !== undefined) this.stop.value = chosen;
    if (isChanged) this.#onChoose(chosen);
  }
}

/** The photographs as thumbnails to choose from. */
export function PhotoStrip({ of }: { of: Photographs }) {
  const all = of.all.value;
  const chosen = of.chosen.value;
  return (
    <div class="photos" hidden={all.every(({ picture }) => !picture)}>
      <Help>{text('pointPanels.photographsHelp')}</Help>
      <div class="strip" role="toolbar" aria-label={text('pointPanels.photographs')} onKeyDown={goAlong}>
        {all.map(({ name, picture }, index) => (
          <Button
            key={index}
            {...{ title: name, 'aria-label': text('pointPanels.photographCamera', { number: index + 1 }) }}
            {...{ 'data-photo': index, 'aria-pressed': index === chosen, tabIndex: index === of.stop.value ? 0 : -1 }}
            onFocus={() => {
              of.stop.value = index;
            }}
            onClick={() => of.choose(index === chosen ? undefined : index)}
          >
            <Picture of={picture} width={THUMBNAIL} />
            <span>{index + 1}</span>
          </Button>
        ))}
      </div>
    </div>
  );
}

/** The selected photograph, large, beside the view from the same camera. */
export function LargePhotograph({ of }: { of: Photographs }) {
  const index = of.chosen.value ?? 0;
  const count = of.all.value.length;
  const { picture, name } = (of.chosen.value !== undefined && of.all.value[index]) || { picture: undefined, name: '' };
  const number = index + 1;
  return (
    <figure class="photograph" hidden={!picture}>
      <Picture of={picture} width={picture?.width ?? 0} label={text('pointPanels.photographNamed', { number, name })} />
      <div>
        <figcaption>{text('pointPanels.photographCaption', { number, count })}</figcaption>
        <Button class="quiet" onClick={() => of.choose(undefined)}>
          {text('pointPanels.closePhotograph')}
        </Button>
      </div>
    </figure>
  );
}

/** Moves the focus along the strip. */
function goAlong(event: KeyboardEvent & { currentTarget: HTMLElement }): void {
  const buttons = [...event.currentTarget.querySelectorAll('button')];
  const last = buttons.length - 1;
  const at = buttons.indexOf(event.target as HTMLButtonElement);
  const to = { ArrowRight: Math.min(at + 1, last), ArrowLeft: Math.max(at - 1, 0), Home: 0, End: last }[event.key];
  if (to === undefined) return;
  event.preventDefault();
  buttons[to]?.focus();
}

interface PictureProps {
  of: ImageBitmap | undefined;
  /** Width in pixels. */
  width: number;
  /** Description for screen readers, which do not see a picture without one. */
  label?: string;
}

const Picture = kept(({ of: picture, width, label }: PictureProps) => {
  const canvas = useRef<HTMLCanvasElement>(null);
  useLayoutEffect(() => {
    if (canvas.current && picture) draw(canvas.current, picture, width);
  }, [picture, width]);
  const naming = label === undefined ? { 'aria-hidden': true } : { role: 'img' as const, 'aria-label': label };
  return <canvas ref={canvas} {...naming} />;
});

function draw(canvas: HTMLCanvasElement, picture: ImageBitmap, width: number): void {
  canvas.width = width;
  canvas.height = Math.round((width * picture.height) / picture.width);
  context2d(canvas)?.drawImage(picture, 0, 0, canvas.width, canvas.height);
}
