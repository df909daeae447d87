import type { ExportRequest, Space, Vec3 } from '../engine/protocol';
import { text } from '../texts';
import { h, uniqueId } from './dom';

type MeshFormat = ExportRequest['format'];

const FORMATS: { format: MeshFormat; help: string; type: string }[] = [
  {
    format: 'ply',
    help: text('controls.exportPly'),
    type: 'application/octet-stream',
  },
  { format: 'stl', help: text('controls.exportStl'), type: 'model/stl' },
  { format: 'glb', help: text('controls.exportGlb'), type: 'model/gltf-binary' },
  { format: 'obj', help: text('controls.exportObj'), type: 'model/obj' },
  { format: 'vtp', help: text('controls.exportVtp'), type: 'application/xml' },
  { format: 'mz3', help: text('controls.exportMz3'), type: 'application/octet-stream' },
];

/** Message that a format is too coarse for the surface where it is, with a button that saves it moved to the origin. */
export class RecentreOffer {
  readonly element: HTMLElement;
  readonly #message = h('p', { class: 'help' });
  readonly #save = h('button', { type: 'button', 'data-action': 'recentre' });

  constructor() {
    this.element = h('div', { role: 'status', hidden: true }, this.#message, this.#save);
  }

  /** Shows the message; `save` saves the surface with positions relative to `origin`. */
  show(format: string, origin: Vec3, save: () => void): void {
    const name = format.toUpperCase();
    this.#message.textContent = text('controls.tooFar', { format: name, origin: origin.join(', ') });
    this.#save.textContent = text('controls.saveRecentred', { format: name });
    this.#save.onclick = save;
    this.element.hidden = false;
  }

  hide(): void {
    this.element.hidden = true;
  }
}

/** Added to the names of files whose surface is moved to the origin. */
export const RECENTRED = '-recentred';

/** Buttons that save the current surface, one for each mesh file format. */
export class ExportButtons {
  readonly element: HTMLElement;
  readonly #buttons: HTMLButtonElement[];
  readonly #offer = new RecentreOffer();
  readonly #axes = h('select', { 'data-export-axes': true });
  readonly #axesRow: HTMLElement;
  readonly #onExport: (request: ExportRequest, type: string) => void;

  /** `onExport` is called again for a surface that is to be moved to the origin, after an {@link offer}. */
  constructor(onExport: (request: ExportRequest, type: string) => void) {
    this.#onExport = onExport;
    this.#buttons = FORMATS.map(({ format, help, type }) => {
      const attributes = {
        type: 'button',
        title: help,
        'aria-label': text('controls.saveAs', { format: help }),
        'data-export': format,
      };
      const onclick = () => {
        this.#offer.hide();
        onExport({ format, ...this.#as }, type);
      };
      return h('button', { ...attributes, onclick }, format.toUpperCase());
    });
    this.#axes.id = uniqueId('axes');
    this.#axesRow = h(
      'div',
      { class: 'row', hidden: true, title: text('controls.axesHelp') },
      h('label', { for: this.#axes.id }, text('controls.axes')),
      this.#axes,
    );
    const buttons = h('div', { class: 'buttons exports' }, ...this.#buttons);
    this.element = h('div', {}, buttons, this.#axesRow, this.#offer.element);
  }

  /** Offers to save the surface relative to `origin`, since the format is too coarse for it where it is. */
  offer(format: MeshFormat, type: string, origin: Vec3): void {
    this.#offer.show(format, origin, () => {
      this.#offer.hide();
      this.#onExport({ format, recentre: true, ...this.#as }, type);
    });
  }

  /** Directions of the axes of the surface, if these are known: the file may have others. */
  set space(space: Space | undefined) {
    this.#axesRow.hidden = space === undefined;
    const spaces: Space[] = space === 'LPS' ? ['LPS', 'RAS'] : ['RAS', 'LPS'];
    const label = (one: Space) => (one === space ? text('controls.axesOfData', { space: one }) : one);
    this.#axes.replaceChildren(...spaces.map((one) => h('option', { value: one }, label(one))));
  }

  get #as(): Pick<ExportRequest, 'as'> {
    return this.#axesRow.hidden ? {} : { as: this.#axes.value as Space };
  }

  set enabled(enabled: boolean) {
    if (!enabled) this.#offer.hide();
    for (const button of this.#buttons) button.disabled = !enabled;
  }
}
