/** The paper's figures, on points that come with the page or are computed in it. */
import type { CloudViewOptions } from '../view/reconstruction';
import { CLOUDS, type CloudExample } from './examples';
import type { ParamValues } from './protocol';

/** What came of a run, for the tests to hold the words against. */
export interface CloudOutcome {
  components: number;
  genus: number;
  /** Mean curvature over the vertices; in tests within a tenth. */
  meanCurvature?: number;
  /** Mean distance of the points; in tests within a tenth. */
  fitness?: number;
}

/** One of several pictures of a figure. */
export interface CloudVariant {
  id: string;
  name: string;
  params: ParamValues;
  maxPoints?: number;
  came: string;
  outcome: CloudOutcome;
}

export interface CloudPreset extends CloudExample {
  saw: string;
  variants: [CloudVariant, ...CloudVariant[]];
  hint?: string;
  /** What the view shows beside the usual. */
  view?: Partial<CloudViewOptions>;
  /** The photograph that the view looks through, from 0. */
  photo?: number;
}

export const CLOUD_PRESETS: CloudPreset[] = [];

export function cloudById(id: string): CloudExample | undefined {
  return [...CLOUDS, ...CLOUD_PRESETS].find((one) => one.id === id);
}

export function isCloudPreset(example: CloudExample | undefined): example is CloudPreset {
  return example !== undefined && 'variants' in example;
}

/** The picture of a figure whose settings are in force, if any is. */
export function variantInForce(
  preset: CloudPreset,
  params: ParamValues,
  maxPoints: number | undefined,
): CloudVariant | undefined {
  return preset.variants.find(
    (one) =>
      (one.maxPoints ?? preset.maxPoints) === maxPoints &&
      Object.entries({ ...preset.params, ...one.params }).every(([name, value]) => Object.is(params[name], value)),
  );
}
