import type { MeshFormat } from '../protocol';
import { text } from '../texts';
import { h } from './dom';

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

/** Buttons that save the current surface, one for each mesh file format. */
export class ExportButtons {
  readonly element: HTMLElement;
  readonly #buttons: HTMLButtonElement[];

  constructor(onExport: (format: MeshFormat, type: string) => void) {
    this.#buttons = FORMATS.map(({ format, help, type }) => {
      const attributes = {
        type: 'button',
        title: help,
        'aria-label': text('controls.saveAs', { format: help }),
        'data-export': format,
      };
      return h('button', { ...attributes, onclick: () => onExport(format, type) }, format.toUpperCase());
    });
    this.element = h('div', { class: 'buttons exports' }, ...this.#buttons);
  }

  set enabled(enabled: boolean) {
    for (const button of this.#buttons) button.disabled = !enabled;
  }
}
