import { h, uniqueId } from '../kit/dom';
import { count, text } from '../texts';
import type { Candidate, Listing, ProgressEvent } from './protocol';

/** Milliseconds of work after which its progress is shown. */
const PATIENCE_MS = 400;

/** Volumes that the user chose, by their indices in the list, and whether uneven slices are to be resampled. */
export interface Chosen {
  ids: number[];
  resample: boolean;
}

/**
 * A dialog that asks which of several volumes to open, and what to do with uneven slices; before and after that, it shows
 * the progress of reading.
 */
export class VolumeChoice {
  readonly #dialog: HTMLDialogElement;
  readonly #titleText: string;
  readonly #body = h('div', { class: 'choice' });
  readonly #bar = h('progress', { max: 1, value: 0, 'aria-label': text('importing.progress') });
  readonly #says = h('p', { role: 'status' });
  #onCancel: () => void = () => {};
  /** The dialog that is open; another one takes its place. */
  static #shown: VolumeChoice | undefined;

  constructor(title: string) {
    this.#titleText = title;
    const id = uniqueId('choice');
    this.#dialog = h('dialog', { class: 'volume-choice', 'aria-labelledby': id }, h('h2', { id }), this.#body);
    this.#dialog.addEventListener('cancel', (event) => {
      event.preventDefault();
      this.#onCancel();
    });
  }

  /** Returns what work returns, and shows its progress if it takes long; undefined if the user cancels it. */
  async during<T>(work: Promise<T>): Promise<T | undefined> {
    const cancelled = new Promise<undefined>((resolve) => {
      this.#onCancel = () => resolve(undefined);
    });
    this.#bar.removeAttribute('value');
    this.#says.textContent = text('importing.reading');
    const shown = setTimeout(() => this.#showWaiting(), PATIENCE_MS);
    try {
      return await Promise.race([work, cancelled]);
    } finally {
      clearTimeout(shown);
      this.close();
    }
  }

  progress({ stage, done, total }: ProgressEvent): void {
    this.#bar.value = total > 0 ? done / total : 0;
    const key = stage === 'headers' ? 'importing.headers' : 'importing.images';
    this.#says.textContent = text(key, { done: count(done), total: count(total) });
  }

  /** Returns what the user chooses of a list, `withLabels` a volume and a segmentation of it; undefined to cancel. */
  choose({ candidates, skipped }: Listing, withLabels = false): Promise<Chosen | undefined> {
    const images = candidates.filter(({ kind }) => kind === 'image' || !withLabels);
    const labels = withLabels ? candidates.filter(({ kind }) => kind === 'segmentation') : [];
    // Segmentations alone are volumes, too.
    const [main, other] = images.length > 0 ? [images, labels] : [labels, []];
    const lists = [this.#list(main, 'volume'), ...(other.length > 0 ? [this.#list(other, 'labels')] : [])];
    const rest = skipped.length === 0 ? [] : [skippedFiles(skipped)];
    const resample = this.#unevenness();
    return new Promise((resolve) => {
      const end = (chosen: Chosen | undefined) => {
        this.close();
        resolve(chosen);
      };
      this.#onCancel = () => end(undefined);
      const open = h('button', { type: 'submit', class: 'primary' }, text('importing.open'));
      const form = h(
        'form',
        { class: 'choice-form' },
        ...lists,
        resample.element,
        ...rest,
        buttons(open, () => end(undefined)),
      );
      const update = () => {
        const uneven = candidates.find(({ id }) => chosenIn(form).includes(id) && candidates[id]?.uneven !== undefined);
        resample.show(uneven?.uneven);
        open.disabled = uneven !== undefined && !resample.isAccepted();
      };
      form.addEventListener('change', update);
      form.addEventListener('submit', (event) => {
        event.preventDefault();
        end({ ids: chosenIn(form), resample: resample.isAccepted() });
      });
      this.#show(candidates.length > 1 ? this.#titleText : text('importing.unevenTitle'), form);
      update();
    });
  }

  close(): void {
    if (VolumeChoice.#shown === this) VolumeChoice.#shown = undefined;
    this.#dialog.close();
    this.#dialog.remove();
  }

  #showWaiting(): void {
    this.#show(
      text('importing.title'),
      this.#says,
      this.#bar,
      buttons(undefined, () => this.#onCancel()),
    );
  }

  #show(title: string, ...content: HTMLElement[]): void {
    const [heading] = this.#dialog.children;
    if (heading) heading.textContent = title;
    this.#body.replaceChildren(...content);
    document.body.append(this.#dialog);
    const before = VolumeChoice.#shown;
    if (before && before !== this) before.#onCancel();
    VolumeChoice.#shown = this;
    if (!this.#dialog.open) this.#dialog.showModal();
  }

  /** Returns the list of volumes, of which the first is chosen. */
  #list(candidates: Candidate[], name: string): HTMLElement {
    // Of a single volume, the question says what is uneven.
    const rows = candidates.map((candidate, k) => rowOf(candidate, name, k === 0, candidates.length > 1));
    const none = name === 'labels' ? [noLabels(name)] : [];
    return h(
      'fieldset',
      {},
      h('legend', {}, text(name === 'labels' ? 'importing.labels' : 'importing.volumes')),
      ...rows,
      ...none,
    );
  }

  #unevenness() {
    const id = uniqueId('resample');
    const box = h('input', { type: 'checkbox', id, name: 'resample' });
    const reason = h('p', { class: 'uneven-reason' });
    const element = h(
      'div',
      { class: 'uneven-slices', hidden: true },
      reason,
      h('label', { for: id }, box, ' ', text('importing.resample')),
    );
    return {
      element,
      isAccepted: () => box.checked,
      show: (uneven: string | undefined) => {
        element.hidden = uneven === undefined;
        reason.textContent = uneven === undefined ? '' : text('importing.uneven', { reason: uneven });
      },
    };
  }
}

/** Returns the indices of the volumes that are chosen in a form. */
function chosenIn(form: HTMLFormElement): number[] {
  const data = new FormData(form);
  return ['volume', 'labels'].flatMap((name) => {
    const value = data.get(name);
    return value === null || value === '' ? [] : [Number(value)];
  });
}

function buttons(open: HTMLElement | undefined, onCancel: () => void): HTMLElement {
  const cancel = h('button', { type: 'button', onclick: onCancel }, text('labs.cancel'));
  return h('div', { class: 'buttons' }, ...(open ? [open] : []), cancel);
}

function rowOf(candidate: Candidate, name: string, checked: boolean, saysUneven: boolean): HTMLElement {
  const { id, warnings, remarks, uneven } = candidate;
  const input = h('input', { type: 'radio', name, value: id, checked });
  const notes = [
    ...(uneven === undefined || !saysUneven ? [] : [note(uneven, 'candidate-warning')]),
    ...warnings.map((text) => note(text, 'candidate-warning')),
    ...remarks.map((text) => note(text, 'candidate-note')),
  ];
  const facts = factsOf(candidate).filter(Boolean).join(' · ');
  return h(
    'label',
    { class: 'candidate' },
    input,
    h(
      'span',
      { class: 'candidate-text' },
      h('strong', {}, candidate.name),
      h('span', { class: 'candidate-note' }, facts),
      ...notes,
    ),
  );
}

const note = (text: string, kind: string) => h('span', { class: kind }, text);

function factsOf({ patient, modality, date, dims, spacing, unit, frames, images, kind }: Candidate): string[] {
  const size = (values: readonly number[]) => values.map((value) => Number(value.toPrecision(4))).join(' × ');
  if (images === 0) return [];
  return [
    ...[patient, modality, date, kind === 'segmentation' ? text('importing.segmentation') : ''],
    text('importing.voxels', { dims: size(dims) }),
    `${size(spacing)} ${unit}`,
    frames > 1 ? text('importing.frames', { frames: count(frames) }) : '',
    text('importing.imageCount', { images: count(images) }),
  ];
}

function noLabels(name: string): HTMLElement {
  return h(
    'label',
    { class: 'candidate' },
    h('input', { type: 'radio', name, value: '' }),
    h('span', {}, text('importing.noLabels')),
  );
}

/** Returns the files that are part of no volume, with the reasons. */
function skippedFiles(skipped: Listing['skipped']): HTMLElement {
  const reasons = new Map<string, string[]>();
  for (const { name, reason } of skipped) reasons.set(reason, [...(reasons.get(reason) ?? []), name]);
  const items = Array.from(reasons, ([reason, names]) => {
    const shown = names.slice(0, 3).join(', ') + (names.length > 3 ? ' …' : '');
    return h('li', {}, text('importing.skippedOf', { files: count(names.length), reason, names: shown }));
  });
  return h(
    'details',
    {},
    h('summary', {}, text('importing.skipped', { files: count(skipped.length) })),
    h('ul', {}, ...items),
  );
}
