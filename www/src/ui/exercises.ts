import { h } from './dom';

export interface Exercise {
  title: string;
  /** The example or figure to start from. */
  example: string;
  steps: string[];
  look: string;
  handIn: string;
}

/** Exercises of the Extract lab. */
export const EXTRACT_EXERCISES: Exercise[] = [
  {
    title: '1. What does rigidity cost?',
    example: 'figure-23',
    steps: [
      'Open the figure and let it come to rest. Note rigidity αc, genus, components, area and volume.',
      'Set αc to 0, press Reset, then Play; note the same. Do it again with 0.1, 0.3 and 0.4.',
      'Colour the surface by speed while it settles: where does it still move, and which way?',
    ],
    look: 'How do genus, area and volume change with αc? Which parts go first, and why does a force that is proportional to bending remove just these? Where would you stop for a surgeon, where for a printer?',
    handIn:
      'A table of αc against genus, components, area and volume; the plot data (CSV) of two runs; three sentences.',
  },
  {
    title: '2. Direct against coarse to fine: what are you paying for?',
    example: 'figure-15-16',
    steps: [
      'Open the figure and press Compare under “Direct against coarse to fine”. Note both times and where they are spent.',
      'Do the same for figure 20 and for “Head, CT: bone” with 2 pyramid levels.',
      'Step through the levels in the row of small pictures: what is left of the object on the coarsest?',
    ],
    look: 'Which row of the table (T, N or F) shrinks most, and what does it grow with? On which image do both ways end with the same topology, on which not, and what do the coarse pictures have to do with it?',
    handIn:
      'The three tables; for each image a sentence on whether you would go coarse to fine, and with how many levels.',
  },
];

/** Exercises of the Reconstruct lab. */
export const RECONSTRUCT_EXERCISES: Exercise[] = [
  {
    title: 'How much may a surface smooth?',
    example: 'spot-stereo',
    steps: [
      'Open the example and let it end. Note λs, mean distance, mean curvature, components and genus.',
      'Set λs to 0, 0.0003, 0.003, 0.01 and 0.1; note the same each time.',
      'Put λs back to 0.001 and do it again for δ = 1, 5, 10, 25 and for “Clusters kept” empty.',
      'Colour the surface by its distance from the points: where did it have to be guessed?',
    ],
    look: 'Which of the two measures tells overfitting from oversmoothing? From which λs on does the surface give up detail that is real, such as the horns? What do stray points do when none are left out?',
    handIn: 'A plot of mean distance against mean curvature, one dot a run; the run you would choose, and why.',
  },
];

/** Exercises of the Sculpt lab. */
export const SCULPT_EXERCISES: Exercise[] = [
  {
    title: 'How far may one pull?',
    example: 'figure-10',
    steps: [
      'Open the globe, colour it by distortion of angles, and note area under T (5 and 95 %), stretch of T and folded.',
      'Choose ellipsoid 3, east, and move its centre along x to 1.2, 1.7 and 2.2; note the same each time. Add a keyframe at each.',
      'Reset, set D to 0, and play the film of your keyframes; then with 10. The paper says that D takes distortion away: where does it here, and where not?',
      'Do the same with the bust and its crown. Show all five meshes: which one shows first that something is wrong?',
    ],
    look: 'Which number grows first, area or stretch? Where on the surface is T worst, and why there? Does the way to a pose matter, or only the pose?',
    handIn: 'A table of the place of the ellipsoid and D against the four numbers; two pictures of T; three sentences.',
  },
];

/** Exercises of the Track lab. */
export const TRACK_EXERCISES: Exercise[] = [
  {
    title: 'How sure is an ejection fraction?',
    example: 'thick-slices',
    steps: [
      'Open the computed ventricle and let it end. Note largest and smallest volume, ejection fraction, the true ones, mean error and the folded triangles of the worst frame.',
      'Set τ to 15, 30, 50 and 70; note the same. At which τ does the warning about noise appear, and what do you see in the slices there?',
      'Under “With and without”, compare with no in-between slices and with linear ones. Where on the surface is the difference: in the wall, at the muscles, or at the apex?',
      'Do the same with the heart, where nobody knows the truth.',
    ],
    look: 'Which of the numbers is right although the surface is wrong? Why does the ejection fraction hardly change where both volumes are too small? Which frame is worst, and what do the muscles do then?',
    handIn:
      'A table of τ and in-between slices against volumes, ejection fraction and error; the CSV of two runs; three sentences on how many digits of the heart’s ejection fraction you would report.',
  },
];

/** Creates the list of exercises for a lab course, each with a button that opens its example. */
export function exercises(list: Exercise[], onOpen: (example: string) => void): HTMLElement {
  return h('div', { class: 'exercises' }, ...list.map((exercise) => exerciseOf(exercise, onOpen)));
}

function exerciseOf({ title, example, steps, look, handIn }: Exercise, onOpen: (example: string) => void): HTMLElement {
  return h(
    'details',
    { 'data-exercise': example },
    h('summary', {}, title),
    h('ol', {}, ...steps.map((step) => h('li', {}, step))),
    h('p', {}, h('strong', {}, 'Look for: '), look),
    h('p', {}, h('strong', {}, 'Hand in: '), handIn),
    h('button', { type: 'button', onclick: () => onOpen(example) }, 'Set it up'),
  );
}
