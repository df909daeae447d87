/** Presets of the Reconstruct lab: the paper's figures, on points that are served with the page or computed in it. */
import type { CloudViewOptions } from '../view/reconstruction';
import { CLOUDS, type CloudExample } from './examples';
import type { ParamValues } from './protocol';

/** An expected count, or its least and largest value: how often a broken surface breaks depends on the last bit. */
export type Count = number | readonly [least: number, most: number];

/** Result of a run; tests compare the texts of a variant with it. */
export interface CloudOutcome {
  components: Count;
  genus: Count;
  /** Mean curvature over the vertices; tests allow a tenth. */
  meanCurvature?: number;
  /** Mean distance of the points from the surface; tests allow a tenth. */
  fitness?: number;
}

/** One picture of a figure: the preset's points with other settings. */
export interface CloudVariant {
  id: string;
  name: string;
  params: ParamValues;
  maxPoints?: number;
  came: string;
  outcome: CloudOutcome;
}

/** A figure of the paper, as an example of the Reconstruct lab. */
export interface CloudPreset extends CloudExample {
  saw: string;
  variants: [CloudVariant, ...CloudVariant[]];
  hint?: string;
  /** View options that differ from the defaults. */
  view?: Partial<CloudViewOptions>;
  /** Index of the photograph whose camera the view uses, from 0. */
  photo?: number;
}

const CARVED =
  'Cow carved out of 24 silhouettes in place of the toy dinosaur, whose points cannot be passed on. Spot by Keenan Crane, public domain.';
const STEREO = 'Cow as stereo sees it. Spot by Keenan Crane, public domain.';
/** Points on the voxel grid, of which a subsample is used, as in the paper. */
const CARVED_COW = {
  source: { file: 'spot/carved.ply' },
  photographs: 'spot',
  up: 'y',
  front: -1,
  maxPoints: 3000,
  color: 'own',
  credit: CARVED,
} as const;
const STEREO_COW = {
  source: { file: 'spot/stereo.ply' },
  photographs: 'spot',
  up: 'y',
  front: -1,
  keepComponents: 1,
  color: 'own',
  credit: STEREO,
} as const;

export const CLOUD_PRESETS: CloudPreset[] = [
  {
    id: 'figure-2',
    name: 'Figure 2: a corner, λ 0 to 2',
    source: { shape: 'cube corner' },
    up: 'z',
    front: -1,
    params: { kernel: 'thin-plate' },
    color: 'mean curvature',
    credit: 'Computed: 1,500 points on three sides of a cube, with noise towards the viewer.',
    saw: 'With λ = 0 the surface passes through all points and overshoots; the larger λ, the smoother it is, towards an amorphous bubble.',
    variants: [
      {
        id: '2b',
        name: 'λ = 0.001',
        params: {},
        came: 'Here λ = 0.001 gives one surface of genus 0 with a mean curvature of 3.6; behind the corner, where there are no points, it closes by itself.',
        outcome: { components: 1, genus: 0, meanCurvature: 3.59 },
      },
      {
        id: '2a',
        name: 'λ = 0',
        params: { lambdaSurface: 0 },
        came: 'Here λ = 0 tears the surface into several pieces with some 100 handles; the mean curvature is about 20.',
        outcome: { components: [3, 12], genus: [70, 140], meanCurvature: 19.6 },
      },
      {
        id: '2c',
        name: 'λ = 0.03',
        params: { lambdaSurface: 0.03 },
        came: 'Here λ = 0.03 gives a mean curvature of 2.1, and a thick bubble behind the corner.',
        outcome: { components: 1, genus: 0, meanCurvature: 2.09 },
      },
      {
        id: '2d',
        name: 'λ = 2',
        params: { lambdaSurface: 2 },
        came: 'Here λ = 2 gives a mean curvature of 1.9; the points now lie 0.015 off the surface in the mean, three times as far as with 0.03.',
        outcome: { components: 1, genus: 0, meanCurvature: 1.88, fitness: 0.0149 },
      },
    ],
    hint: 'Colours show where the surface is bent. The noise in the points is 0.01.',
  },
  {
    id: 'figure-3',
    name: 'Figure 3: kernels compared',
    ...CARVED_COW,
    params: {},
    saw: 'Thin-plate without λ bulges and breaks, with λ it is blobby and fuses limbs, Gaussian has holes in it; multi-order is detailed and smooth.',
    variants: [
      {
        id: '3e',
        name: 'e: multi-order',
        params: {},
        came: 'Here multi-order gives one component of genus 0, as it should be, with a mean curvature of 3.6.',
        outcome: { components: 1, genus: 0, meanCurvature: 3.61 },
      },
      {
        id: '3b',
        name: 'b: thin-plate, λ = 0',
        params: { kernel: 'thin-plate', lambdaSurface: 0 },
        came: 'Here thin-plate without λ breaks into some 50 pieces with some 100 handles; the mean curvature is about 15.',
        outcome: { components: [35, 70], genus: [75, 145], meanCurvature: 14.9 },
      },
      {
        id: '3c',
        name: 'c: thin-plate',
        params: { kernel: 'thin-plate' },
        came: 'Here thin-plate with λ = 0.001 still leaves a few pieces and a few handles, and 30 % less volume than multi-order.',
        outcome: { components: [2, 6], genus: [3, 9], meanCurvature: 3.87 },
      },
      {
        id: '3d',
        name: 'd: Gaussian',
        params: { kernel: 'gaussian' },
        came: 'Here Gaussian with σ = 0.07 leaves some 150 pieces with some 70 handles: no surface one could use.',
        outcome: { components: [110, 200], genus: [50, 95], meanCurvature: 25.3 },
      },
    ],
    hint: 'In each, 1,575 of the 6,930 points take part: the grid that they lie on lets no finer subsample below 3,000.',
  },
  {
    id: 'figure-4',
    name: 'Figure 4: kernels and their time',
    source: { shape: 'torus' },
    up: 'z',
    params: { delta: 10, tau: 0.01 },
    color: 'plain',
    credit: 'Computed: 3,000 points on a torus of volume 2.418, with noise.',
    saw: 'r³ grows without end, while the multi-order kernel falls towards 0; its solve took 1.5 minutes for 3,264 constraints, thin-plate 7.9, and the time grew nearly linearly.',
    variants: [
      {
        id: '4b',
        name: 'δ = 10, τ = 0.01',
        params: {},
        came: 'Here the kernel falls to half its height at 0.18, but its tail is long: 22 % are left at 0.5. The torus comes out with genus 1 and 2 % too little volume.',
        outcome: { components: 1, genus: 1, meanCurvature: 2.72 },
      },
      {
        id: '4c',
        name: 'δ = 10, τ = 0.025',
        params: { tau: 0.025 },
        came: 'Here a larger τ makes the tip of the kernel rounder, half its height at 0.22: the mean curvature of the torus falls from 2.7 to 2.1.',
        outcome: { components: 1, genus: 1, meanCurvature: 2.08 },
      },
      {
        id: '4b2',
        name: 'δ = 40, τ = 0.01',
        params: { delta: 40 },
        came: 'Here δ = 40 pulls the surface in between the points: the mean curvature rises to 4.4, and 17 % of the volume are lost.',
        outcome: { components: 1, genus: 1, meanCurvature: 4.42 },
      },
      {
        id: '4a',
        name: 'a: r³',
        params: { kernel: 'thin-plate' },
        came: 'Here thin-plate adds several handles to the one that is right, and keeps less than half of the volume.',
        outcome: { components: [1, 3], genus: [3, 12], meanCurvature: 1.82 },
      },
    ],
    hint: 'The curve is under Plots; picture d is made when you press Measure under “Time against number of constraints”.',
  },
  {
    id: 'figure-5',
    name: 'Figure 5: as smooth as a filter',
    ...CARVED_COW,
    params: { delta: 10, tau: 0.025 },
    saw: 'With δ = 10 and τ = 0.025 the surface looks like that of the voxels after a Gaussian filter, but does not shrink.',
    variants: [
      {
        id: '5b',
        name: 'b: τ = 0.025',
        params: {},
        came: 'Here the mean curvature is 3.5 and the volume 0.659 (the true cow has 0.718; the filter is not in this page).',
        outcome: { components: 1, genus: 0, meanCurvature: 3.54 },
      },
      {
        id: '5c',
        name: 'τ = 0.01',
        params: { tau: 0.01 },
        came: 'Here τ = 0.01 keeps more of the steps of the voxels, with a mean curvature of 3.9; the volume is 0.658.',
        outcome: { components: 1, genus: 0, meanCurvature: 3.88 },
      },
    ],
  },
  {
    id: 'figure-7',
    name: 'Figure 7: all points against a subset',
    ...CARVED_COW,
    maxPoints: 20_000,
    params: {},
    saw: '477 of 3,173 points fitted all of them nearly as well as all did: a total error of 0.009 against 0.008.',
    variants: [
      {
        id: '7l',
        name: 'all points',
        params: {},
        came: 'Here all 6,930 points lie 0.0053 off their surface in the mean.',
        outcome: { components: 1, genus: 0, fitness: 0.00533 },
      },
      {
        id: '7r',
        name: 'a subset',
        params: {},
        maxPoints: 1040,
        came: 'Here 812 of them give a surface from which all 6,930 lie 0.0072 off, a third more; the volume is the same within 0.1 %.',
        outcome: { components: 1, genus: 0, fitness: 0.00722 },
      },
    ],
  },
  {
    id: 'figure-8',
    name: 'Figure 8: uneven points with gaps',
    ...STEREO_COW,
    maxPoints: 2168,
    params: { delta: 10, tau: 0.01, lambdaSurface: 0.002 },
    view: { constraints: true },
    saw: '2,168 surface and 193 exterior constraints from three sides gave a rabbit that is closed and smooth at top and bottom, where points are rare.',
    variants: [
      {
        id: '8',
        name: '2,168 points',
        params: {},
        came: 'Here 2,119 surface and 225 exterior constraints with λ = 0.002 give one closed component of genus 0, 7 % smaller than the true cow, smooth below, where no camera saw it.',
        outcome: { components: 1, genus: 0, meanCurvature: 3.51, fitness: 0.0214 },
      },
      {
        id: '8l',
        name: 'λ = 0.001',
        params: { lambdaSurface: 0.001 },
        came: 'Here λ = 0.001, enough for the other figures, leaves a handle too many (genus 1), a thread in the nape from the back to the head; the cow is 6 % smaller than the true one.',
        outcome: { components: 1, genus: 1, meanCurvature: 4.23, fitness: 0.0208 },
      },
      {
        id: '8all',
        name: 'all points',
        params: { delta: 5, tau: 0.025, lambdaSurface: 0.001 },
        maxPoints: 20_000,
        came: 'Here all 8,056 points of the largest cluster, with the page’s own δ, τ and λ, give genus 0, too.',
        outcome: { components: 1, genus: 0 },
      },
    ],
    hint: 'Blue points lie on the surface, green ones outside; turn the view to look from below.',
  },
  {
    id: 'figure-9',
    name: 'Figure 9: beside the photograph',
    ...STEREO_COW,
    params: {},
    photo: 3,
    view: { points: false },
    saw: 'Two photographs of the toy dinosaur beside the coloured surface, rendered from the same camera.',
    variants: [
      {
        id: '9',
        name: 'Figure 9',
        params: {},
        came: 'Here outline and patches agree; the feet end 0.1 too high (the cow is 1.69 high), since stereo saw nothing from below.',
        outcome: { components: 1, genus: 0 },
      },
    ],
    hint: 'Choose other photographs in the row below the view. Dragging the view leaves the camera.',
  },
  {
    id: 'figure-10',
    name: 'Figure 10: carved out of silhouettes',
    ...CARVED_COW,
    params: { delta: 10, tau: 0.01 },
    saw: 'Dinosaur, broccoli and towers from space carving came out smooth and detailed from 2,000 to 3,000 points that lie 0.035 to 0.042 apart.',
    variants: [
      {
        id: '10',
        name: 'Figure 10',
        params: {},
        came: 'Here 1,575 points, 0.059 apart, and 169 outside give one component of genus 0; the steps of the voxels are gone.',
        outcome: { components: 1, genus: 0, meanCurvature: 3.88 },
      },
    ],
  },
];

/** Returns the example or preset with this id. */
export function cloudById(id: string): CloudExample | undefined {
  return [...CLOUDS, ...CLOUD_PRESETS].find((one) => one.id === id);
}

export function isCloudPreset(example: CloudExample | undefined): example is CloudPreset {
  return example !== undefined && 'variants' in example;
}

/**
 * Returns the variant of a figure whose settings are all in force, if there is one; unset parameters count as in
 * `defaults`.
 */
export function variantInForce(
  preset: CloudPreset,
  params: ParamValues,
  maxPoints: number | undefined,
  defaults: ParamValues,
): CloudVariant | undefined {
  return preset.variants.find(
    (one) =>
      (one.maxPoints ?? preset.maxPoints) === maxPoints &&
      Object.entries({ ...defaults, ...preset.params, ...one.params }).every(([name, value]) =>
        Object.is(params[name], value),
      ),
  );
}
