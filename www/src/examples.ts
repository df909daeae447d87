import type { ParamValues } from './protocol';
import type { Shape } from './shapes';

/** A volume that comes with the page, the settings that suit it, and whom to thank. */
export interface Example {
  id: string;
  name: string;
  /** A file beside the page, or a shape to compute. */
  source: { file: string } | { shape: Shape };
  levels: number;
  params: ParamValues & { iso: number };
  credit: string;
}

const HEAD_CREDIT =
  'Head CT: Visible Human Project, U.S. National Library of Medicine, public domain; volume from ipyvolume (MIT).';

/** The first is shown when the page opens. */
export const EXAMPLES: Example[] = [
  {
    id: 'visible-human-head',
    name: 'Head, CT: bone',
    source: { file: 'visible-human-head.nii.gz' },
    levels: 3,
    params: { iso: 95, isoForce: -1, rigidity: 0.4 },
    credit: HEAD_CREDIT,
  },
  {
    id: 'linked-rings',
    name: 'Two linked rings',
    source: { shape: 'linked rings' },
    levels: 1,
    params: { iso: 127.5, isoForce: -1, rigidity: 0.1, stiffness: 0.1 },
    credit: 'Computed. One surface goes in; two come out, each with one hole: χ = 0.',
  },
  {
    id: 'sponge',
    name: 'Menger sponge',
    source: { shape: 'sponge' },
    levels: 3,
    params: { iso: 102, isoForce: -1, rigidity: 0.05, stiffness: 0.001 },
    credit: 'Computed. A cube pierced on two scales has 81 tunnels: one component, χ = −160.',
  },
];

/** Where a file that comes with the page lies. */
export function exampleUrl(file: string): string {
  return new URL(`data/${file}`, document.baseURI).href;
}
