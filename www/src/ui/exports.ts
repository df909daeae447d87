import type { MeshFormat } from '../protocol';
import { h } from './dom';

const FORMATS: { format: MeshFormat; help: string; type: string }[] = [
  {
    format: 'ply',
    help: 'PLY: points and triangles, for MeshLab, CloudCompare and most research software',
    type: 'application/octet-stream',
  },
  { format: 'stl', help: 'STL: triangles only, for 3D printing', type: 'model/stl' },
  { format: 'glb', help: 'GLB: for web viewers, Blender and game engines', type: 'model/gltf-binary' },
  { format: 'obj', help: 'OBJ: text, for nearly everything', type: 'model/obj' },
  { format: 'vtp', help: 'VTP: for ParaView and vtk.js', type: 'application/xml' },
  { format: 'mz3', help: 'MZ3: for Surfice and NiiVue', type: 'application/octet-stream' },
];

/** Buttons that save the current surface in each file format. */
export class ExportButtons {
  readonly element: HTMLElement;
  readonly #buttons: HTMLButtonElement[];

  constructor(onExport: (format: MeshFormat, type: string) => void) {
    this.#buttons = FORMATS.map(({ format, help, type }) => {
      const attributes = { type: 'button', title: help, 'aria-label': `Save as ${help}`, 'data-export': format };
      return h('button', { ...attributes, onclick: () => onExport(format, type) }, format.toUpperCase());
    });
    this.element = h('div', { class: 'buttons exports' }, ...this.#buttons);
  }

  set enabled(enabled: boolean) {
    for (const button of this.#buttons) button.disabled = !enabled;
  }
}
