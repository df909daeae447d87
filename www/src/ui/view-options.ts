import { h, uniqueId } from './dom';

/** Where the slices stand in the 3D view: on the walls behind the surface, where they lie, or nowhere. */
export type SlicePlacement = 'walls' | 'in place' | 'hidden';

export interface ViewOptions {
  surface: boolean;
  edges: boolean;
  byComponent: boolean;
  slices: SlicePlacement;
}

const SWITCHES = [
  { name: 'surface', label: 'Surface' },
  { name: 'edges', label: 'Wireframe' },
  { name: 'byComponent', label: 'By component' },
] as const;
const PLACEMENTS: { value: SlicePlacement; label: string }[] = [
  { value: 'walls', label: 'on the walls' },
  { value: 'in place', label: 'in place' },
  { value: 'hidden', label: 'hidden' },
];

/** What the 3D view shows. */
export function viewOptions(initial: ViewOptions, onChange: (options: ViewOptions) => void): HTMLElement {
  const value = { ...initial };
  const change = (changed: Partial<ViewOptions>) => onChange({ ...Object.assign(value, changed) });
  const switches = SWITCHES.map(({ name, label }) => {
    const box = h('input', { type: 'checkbox', checked: value[name], 'data-view': name });
    box.addEventListener('change', () => change({ [name]: box.checked }));
    return h('label', {}, box, label);
  });
  const select = placementSelect(value.slices, (slices) => change({ slices }));
  return h('div', { class: 'view-options', role: 'group', 'aria-label': 'What the view shows' }, ...switches, select);
}

function placementSelect(initial: SlicePlacement, onChange: (placement: SlicePlacement) => void): HTMLElement {
  const id = uniqueId('slices');
  const options = PLACEMENTS.map(({ value, label }) => h('option', { value, selected: value === initial }, label));
  const select = h('select', { id, 'data-view': 'slices' }, ...options);
  select.addEventListener('change', () => onChange(select.value as SlicePlacement));
  return h('span', { class: 'placement' }, h('label', { for: id }, 'Slices'), select);
}
