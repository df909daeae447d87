import { h } from './dom';

export interface ViewOptions {
  edges: boolean;
  byComponent: boolean;
  slices: boolean;
  surface: boolean;
}

const OPTIONS: { name: keyof ViewOptions; label: string }[] = [
  { name: 'surface', label: 'Surface' },
  { name: 'edges', label: 'Wireframe' },
  { name: 'byComponent', label: 'Colour by component' },
  { name: 'slices', label: 'Slices' },
];

/** What the 3D view shows. */
export function viewOptions(initial: ViewOptions, onChange: (options: ViewOptions) => void): HTMLElement {
  const value = { ...initial };
  const boxes = OPTIONS.map(({ name, label }) => {
    const box = h('input', { type: 'checkbox', checked: value[name], 'data-view': name });
    box.addEventListener('change', () => {
      value[name] = box.checked;
      onChange({ ...value });
    });
    return h('label', {}, box, label);
  });
  return h('div', { class: 'view-options', role: 'group', 'aria-label': 'What the view shows' }, ...boxes);
}
