/** Answers to the lessons' questions as they follow from what the labs show, and figures of runs that texts state. */

/** A measure as the lab shows it, rounded, by its name. */
export type Shown = (measure: string) => number;
/** Returns the measures as they were shown when a step was ticked, by the id of the step. */
export type ShownIn = (step: string) => Shown;

export interface Reference {
  /** The answer to the step's question, as it follows from what is shown. */
  answer?: (shown: ShownIn) => number;
  /** Decimals to which the question asks to round. */
  decimals?: number;
  /** Figures of the run that the texts of the step state, in words and digits of English. */
  stated?: (shown: ShownIn) => string[];
}

const grouped = (value: number) => value.toLocaleString('en');
const handles = (components: number, chi: number) => components - chi / 2;

/** Returns the volume that springs take, over the area. */
const depth = (shown: ShownIn) => (shown('free')('volume') - shown('membrane')('volume')) / shown('membrane')('area');
const stroke = (shown: ShownIn) => shown('truth')('largest') - shown('truth')('smallest');

/** By lesson and step. */
export const REFERENCES: Record<string, Record<string, Reference>> = {
  topology: {
    cell: {
      answer: (shown) => 1.5 * shown('cell')('triangles'),
      stated: (shown) => [grouped(1.5 * shown('cell')('triangles')), grouped(shown('cell')('triangles'))],
    },
    parts: { answer: (shown) => (5 * shown('parts')('chi')) / shown('parts')('components') },
    rings: { answer: (shown) => handles(shown('rings')('components'), shown('rings')('chi')) },
    // Of the three joins and the cut of the question.
    changes: { answer: () => 2 - 3 * 2 + 2 },
    sponge: { answer: (shown) => handles(1, shown('sponge')('chi')) },
  },
  'coarse-to-fine': {
    pyramid: {
      answer: (shown) => 100 * (shown('pyramid')('volume') / shown('direct')('volume') - 1),
      decimals: 2,
      stated: (shown) => ['pyramid', 'direct'].map((step) => grouped(shown(step)('volume'))),
    },
    levels: { answer: () => Math.sqrt(3) ** 3, decimals: 1 },
  },
  forces: {
    free: { answer: () => 0 },
    // Six edges of length 1, of which each ends 1 / 2R below the tangent plane.
    spring: { answer: () => (0.1 * 6 * 1) / (2 * 10), decimals: 2 },
    membrane: {
      answer: depth,
      decimals: 3,
      stated: (shown) => [
        grouped(shown('free')('volume')),
        grouped(shown('free')('area')),
        `${shown('free')('volume') - shown('membrane')('volume')} /`,
        depth(shown).toFixed(3),
      ],
    },
    ratio: { stated: (shown) => ['membrane', 'ratio'].map((step) => `the same, ${shown(step)('iteration')}.`) },
  },
  regularisation: {
    balanced: {
      answer: (shown) => (100 * shown('balanced')('fitMean')) / 0.01,
      decimals: 0,
      stated: (shown) => [
        shown('balanced')('fitMean').toFixed(4),
        `${Math.round(1e4 * shown('balanced')('fitMean'))} %`,
      ],
    },
    bubble: { answer: () => 1 / 0.8 / (1 / 2), decimals: 1 },
    smoother: {
      stated: (shown) => [
        `curvature ${shown('smoother')('meanCurvature').toFixed(1)} against ${shown('cow')('meanCurvature').toFixed(1)}`,
        `distance ${shown('smoother')('fitMean').toFixed(4)} against ${shown('cow')('fitMean').toFixed(4)}`,
      ],
    },
    outliers: {
      stated: (shown) => [
        `${shown('outliers')('surfaceConstraints') - shown('cow')('surfaceConstraints')} more points`,
        shown('cow')('meanCurvature').toFixed(3),
        shown('outliers')('meanCurvature').toFixed(3),
      ],
    },
  },
  heart: {
    truth: {
      answer: stroke,
      decimals: 1,
      stated: (shown) => {
        const [most, least] = ['largest', 'smallest'].map((measure) => shown('truth')(measure).toFixed(1));
        return [`${most} − ${least} = ${stroke(shown).toFixed(1)} ml`];
      },
    },
    noise: {
      stated: (shown) => [
        `(${shown('noise')('ejection').toFixed(1)} against ${shown('truth')('ejection').toFixed(1)} %)`,
      ],
    },
    pig: {
      answer: (shown) => shown('pig')('ejection'),
      decimals: 0,
      stated: (shown) => [`About ${shown('pig')('ejection').toFixed(0)} %`],
    },
    digits: {
      stated: (shown) => ['digits', 'pig'].map((step) => `${shown(step)('ejection').toFixed(1)} % as with 25`),
    },
  },
  detail: {
    map: {
      answer: (shown) => shown('map')('angleHigh'),
      decimals: 2,
      stated: (shown) => [shown('map')('angleHigh').toFixed(2)],
    },
    'too-far': {
      stated: (shown) => [
        `from ${shown('map')('angleHigh').toFixed(1)} to above ${10 * Math.floor(shown('too-far')('angleHigh') / 10)}`,
      ],
    },
    // Heights are copied.
    bust: { answer: () => 5 },
  },
};
