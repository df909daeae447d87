/** Presets of the Extract lab: the paper's figures, on volumes that are served with the page or computed in it. */
import { EXAMPLES, type Example } from './examples';
import type { ParamValues } from './protocol';

/** Result of a converged run; tests compare the texts of a variant with it. */
export interface Outcome {
  iterations: number;
  vertices: number;
  components: number;
  genus: number;
}

/** One picture of a figure: the preset's volume with other parameters. */
export interface Variant {
  id: string;
  /** Label of its button. */
  name: string;
  params: ParamValues;
  /** Result in this app, as a sentence. */
  came: string;
  outcome: Outcome;
}

/** A figure of the paper, as an example of the Extract lab. */
export interface Preset extends Example {
  start: { kind: 'enclosing' } | { kind: 'bubbles'; bubbles: number } | { kind: 'isosurface' };
  /** Result reported in the paper, as a sentence. */
  saw: string;
  /** The pictures of the figure; the preset opens with the first. */
  variants: [Variant, ...Variant[]];
  /**
   * Whether choosing another variant restarts the model; by default the present surface continues with the new
   * parameters.
   */
  startsOver?: boolean;
  /** Advice on what else to look at, such as a panel of the page. */
  hint?: string;
  /** Whether the figure includes the comparison of a direct with a coarse-to-fine run; opens that panel. */
  compares?: boolean;
}

const ENCLOSING = { kind: 'enclosing' } as const;
const COMPUTED = 'Computed in the page: the image of the paper cannot be passed on.';
const CONTOUR = { kind: 'contour' } as const;
/** Parameters of the method as published: one sampling distance everywhere, and Euler steps. */
export const PAPER = { adaptivity: 0, integrator: 'euler' } as const;
/** Base parameters of the presets: the iso force alone, so that each preset lists every other force that acts. */
const BARE = { ...PAPER, isoForce: -1, gradientNormal: 0, gradientTangent: 0, rigidity: 0, stiffness: 0 };
/**
 * Base parameters without the iso force, for presets that use the gradient force, towards maxima of intensity. It is
 * per voxel here, so that 1 does what 0.1 does in the paper.
 */
const RIDGE = { ...BARE, isoForce: 0 };

export const PRESETS: Preset[] = [
  {
    id: 'figure-7',
    name: 'Figure 7: a chain, from outside',
    source: { shape: 'chain' },
    unit: '',
    start: ENCLOSING,
    levels: 0,
    // Makes the gap between the rings four δ wide.
    edge: 3.15,
    params: { ...BARE, iso: 127.5, rigidity: 0.1, stiffness: 0.1 },
    credit: 'Computed: a potential that falls with the distance from two linked circles.',
    saw: 'One surface around two linked rings came to lie precisely on them in 90 iterations, and had become two tori on the way.',
    variants: [
      {
        id: '7',
        name: 'Figure 7',
        params: {},
        came: 'Here it takes 73 iterations: two components, each of genus 1.',
        outcome: { iterations: 73, vertices: 464, components: 2, genus: 2 },
      },
    ],
  },
  {
    id: 'figure-8',
    name: 'Figure 8: the same chain, from 1331 bubbles',
    source: { shape: 'chain' },
    unit: '',
    start: { kind: 'bubbles', bubbles: 11 },
    levels: 0,
    edge: 1.65,
    params: { ...BARE, iso: 127.5 },
    credit: 'Computed: a potential that falls with the distance from two linked circles.',
    saw: 'With 11 × 11 × 11 small bubbles to start from and no internal force the same two rings were found, by iteration 160.',
    variants: [
      {
        id: '8',
        name: 'Figure 8',
        params: {},
        came: 'Here 37 iterations do: bubbles in the dark vanish, those in the rings meet and join to two components of genus 1.',
        outcome: { iterations: 37, vertices: 2596, components: 2, genus: 2 },
      },
    ],
  },
  {
    id: 'figure-14',
    name: 'Figure 14: a fractal cube, coarse to fine',
    source: { shape: 'deep sponge' },
    unit: '',
    start: ENCLOSING,
    levels: 3,
    params: { ...BARE, iso: 102, rigidity: 0.05, stiffness: 0.001 },
    credit: 'Computed: the Menger sponge of depth 3 on 81³ voxels.',
    saw: 'The model found the denser parts of a Sierpinski cube first and opened ever finer tunnels from level to level.',
    variants: [
      {
        id: '14',
        name: 'Figure 14',
        params: {},
        came: 'Here too: levels 2 and 1 open about eighty tunnels, level 0 all 1409 (χ = −2816, the exact number), after 236 iterations in all.',
        outcome: { iterations: 236, vertices: 66966, components: 1, genus: 1409 },
      },
    ],
  },
  {
    id: 'figure-15-16',
    name: 'Figures 15 and 16, table 1: direct against coarse to fine',
    source: { shape: 'head phantom' },
    unit: '',
    start: ENCLOSING,
    levels: 3,
    params: { ...BARE, iso: 130, rigidity: 0.4 },
    credit: `${COMPUTED} A skull with six openings in soft tissue, with noise.`,
    saw: 'On the CT of a head both ways led to one component of the same genus, areas within 1 % and volumes within 0.3 %, coarse to fine nearly three times faster (table 1: 112 against 41 minutes).',
    variants: [
      {
        id: '16',
        name: 'Figure 16',
        params: {},
        came: 'Here both end with one component of genus 5, area and volume within 0.3 %, coarse to fine nearly twice as fast: a direct run lets rest what is at rest, too.',
        outcome: { iterations: 202, vertices: 15870, components: 1, genus: 5 },
      },
    ],
    compares: true,
    hint: 'The table appears under “Direct against coarse to fine” when you press Compare there.',
  },
  {
    id: 'figure-20',
    name: 'Figure 20, table 2: vessels of the brain',
    source: { shape: 'vessel tree' },
    unit: '',
    start: ENCLOSING,
    levels: 3,
    params: { ...BARE, iso: 12.75, rigidity: 0.07 },
    credit: `${COMPUTED} A tree of vessels and three loose pieces, with noise.`,
    saw: 'Thin vessels blur away on coarse levels; the model still followed the connected ones on fine levels, kept one component, lost the small separate ones, and enclosed 3.7 % less than directly.',
    variants: [
      {
        id: '20',
        name: 'Figure 20',
        params: {},
        came: 'Here the tree comes out in one component, and the three loose pieces are lost that a direct run finds (4 components, 2.0 % more volume).',
        outcome: { iterations: 240, vertices: 7883, components: 1, genus: 1 },
      },
    ],
    compares: true,
    hint: 'The table appears under “Direct against coarse to fine” when you press Compare there.',
  },
  {
    id: 'figure-21',
    name: 'Figure 21: skull, skin and hull of one head',
    source: { shape: 'head phantom' },
    unit: '',
    start: ENCLOSING,
    levels: 2,
    params: { ...BARE, iso: 130, rigidity: 0.2 },
    credit: `${COMPUTED} A skull with six openings in soft tissue, with noise.`,
    saw: 'From one start the iso force found skull or skin, as πI said, and the gradient force a hull that lies in the bone and closes its gaps.',
    variants: [
      {
        id: '21c',
        name: 'c: skull',
        params: {},
        came: 'Here πI = 130 of 255 gives the skull with its six openings (genus 5).',
        outcome: { iterations: 169, vertices: 16267, components: 1, genus: 5 },
      },
      {
        id: '21d',
        name: 'd: skin',
        params: { iso: 38 },
        came: 'Here πI = 38 of 255 gives the skin (genus 0).',
        outcome: { iterations: 93, vertices: 15666, components: 1, genus: 0 },
      },
      {
        id: '21e',
        name: 'e: hull',
        params: { ...RIDGE, gradientNormal: 1, gradientTangent: 0.5, rigidity: 0.4, stiffness: 0.1 },
        came: 'Here the gradient force closes all six openings (genus 0); a little stiffness brings the surface in through air where there is no gradient.',
        outcome: { iterations: 345, vertices: 8828, components: 1, genus: 0 },
      },
    ],
    startsOver: true,
  },
  {
    id: 'figure-22',
    name: 'Figure 22: a nucleus with marked boundary',
    source: { shape: 'marked nucleus' },
    unit: '',
    start: ENCLOSING,
    levels: 1,
    params: { ...RIDGE, iso: 120, gradientNormal: 1, stiffness: 0.2, rigidity: 1.5, integrator: 'runge-kutta' },
    credit: `${COMPUTED} Three lobes of which only the boundary is bright, with noise.`,
    saw: 'A bubble around the image was drawn in by a slight elastic force and came to rest on the marked boundary, which no iso-surface could give (1 component, 2 holes).',
    variants: [
      {
        id: '22',
        name: 'Figure 22',
        params: {},
        came: 'Here it comes to rest on the boundary of the three lobes, a single surface in the middle of the bright layer; this nucleus has no hole (genus 0).',
        outcome: { iterations: 245, vertices: 3149, components: 1, genus: 0 },
      },
    ],
  },
  {
    id: 'figure-23',
    name: 'Figure 23: after marching cubes',
    source: { file: 'visible-human-head.nii.gz' },
    unit: 'mm',
    start: { kind: 'isosurface' },
    levels: 0,
    params: { ...BARE, iso: 95, rigidity: 0.3 },
    credit:
      'Head CT: Visible Human Project, U.S. National Library of Medicine, public domain; volume from ipyvolume (MIT).',
    saw: 'An iso-surface of 354 components and 958 holes was left with 45 components and 181 holes after some iterations with rigidity: the smoothing is physical, not geometrical.',
    variants: [
      {
        id: '23',
        name: 'Figure 23',
        params: {},
        came: 'Here marching cubes give 372 components of genus 383 together; 5 components and genus 46 are left after 139 iterations, and 34,000 of 114,000 vertices.',
        outcome: { iterations: 139, vertices: 33987, components: 5, genus: 46 },
      },
    ],
  },
  {
    id: 'figure-24',
    name: 'Figure 24: one cell at three iso values',
    source: { shape: 'cell' },
    unit: '',
    start: ENCLOSING,
    levels: 1,
    params: { ...BARE, iso: 76.5, rigidity: 0.2 },
    credit: `${COMPUTED} A cell that is brighter towards its middle, with granules and noise.`,
    saw: 'The surface of a lymphocyte was followed as πI rose from 0.3 over 0.45 to 0.75 of the range.',
    variants: [
      {
        id: '24b',
        name: 'b: 0.3',
        params: {},
        came: 'Here 0.3 of the range gives one surface around 61,300 voxels.',
        outcome: { iterations: 86, vertices: 5182, components: 1, genus: 0 },
      },
      {
        id: '24c',
        name: 'c: 0.45',
        params: { iso: 114.75 },
        came: 'Here 0.45 of the range gives one surface around 41,000 voxels.',
        outcome: { iterations: 100, vertices: 3802, components: 1, genus: 0 },
      },
      {
        id: '24d',
        name: 'd: 0.75',
        params: { iso: 191.25 },
        came: 'Here 0.75 of the range leaves three granules of 3,400 voxels together; back at 0.3 they grow and join to the one surface again.',
        outcome: { iterations: 141, vertices: 1038, components: 3, genus: 0 },
      },
    ],
  },
];

/** Returns the example or preset with this id. */
export function exampleById(id: string): Example | undefined {
  return [...EXAMPLES, ...PRESETS].find((one) => one.id === id);
}

export function isPreset(example: Example | undefined): example is Preset {
  return example !== undefined && 'variants' in example;
}

/** Returns the variant of a figure whose parameters are all in force, if there is one. */
export function variantOf(preset: Preset, params: ParamValues): Variant | undefined {
  return preset.variants.find((one) =>
    Object.entries({ ...preset.params, ...one.params }).every(([name, value]) => Object.is(params[name], value)),
  );
}

/** Returns the suitable start shape: a preset's own, else the contour, for other examples and for files. */
export function startOf(example: Example | undefined): Preset['start'] | typeof CONTOUR {
  return isPreset(example) ? example.start : CONTOUR;
}
