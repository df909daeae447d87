import { text } from '../texts';
import { h } from './dom';

export interface Exercise {
  title: string;
  /** Id of the example or preset that the exercise starts from. */
  example: string;
  steps: string[];
  look: string;
  handIn: string;
}

/** Exercises for a course with the Extract lab. */
export const EXTRACT_EXERCISES: Exercise[] = [
  {
    title: text('exercises.rigidityTitle'),
    example: 'figure-23',
    steps: [text('exercises.rigidityStep1'), text('exercises.rigidityStep2'), text('exercises.rigidityStep3')],
    look: text('exercises.rigidityQuestions'),
    handIn: text('exercises.rigidityHandIn'),
  },
  {
    title: text('exercises.pyramidTitle'),
    example: 'figure-15-16',
    steps: [text('exercises.pyramidStep1'), text('exercises.pyramidStep2'), text('exercises.pyramidStep3')],
    look: text('exercises.pyramidQuestions'),
    handIn: text('exercises.pyramidHandIn'),
  },
];

/** Exercises for a course with the Reconstruct lab. */
export const RECONSTRUCT_EXERCISES: Exercise[] = [
  {
    title: text('exercises.smoothingTitle'),
    example: 'spot-stereo',
    steps: [
      text('exercises.smoothingStep1'),
      text('exercises.smoothingStep2'),
      text('exercises.smoothingStep3'),
      text('exercises.smoothingStep4'),
    ],
    look: text('exercises.smoothingQuestions'),
    handIn: text('exercises.smoothingHandIn'),
  },
];

/** Exercises for a course with the Sculpt lab. */
export const SCULPT_EXERCISES: Exercise[] = [
  {
    title: text('exercises.deformationTitle'),
    example: 'figure-10',
    steps: [
      text('exercises.deformationStep1'),
      text('exercises.deformationStep2'),
      text('exercises.deformationStep3'),
      text('exercises.deformationStep4'),
    ],
    look: text('exercises.deformationQuestions'),
    handIn: text('exercises.deformationHandIn'),
  },
];

/** Exercises for a course with the Track lab. */
export const TRACK_EXERCISES: Exercise[] = [
  {
    title: text('exercises.ejectionTitle'),
    example: 'thick-slices',
    steps: [
      text('exercises.ejectionStep1'),
      text('exercises.ejectionStep2'),
      text('exercises.ejectionStep3'),
      text('exercises.ejectionStep4'),
    ],
    look: text('exercises.ejectionQuestions'),
    handIn: text('exercises.ejectionHandIn'),
  },
];

/** Creates the list of exercises shown on a lab's page, each with a button that opens its example. */
export function exercises(list: Exercise[], onOpen: (example: string) => void): HTMLElement {
  return h('div', { class: 'exercises' }, ...list.map((exercise) => exerciseOf(exercise, onOpen)));
}

function exerciseOf({ title, example, steps, look, handIn }: Exercise, onOpen: (example: string) => void): HTMLElement {
  return h(
    'details',
    { 'data-exercise': example },
    h('summary', {}, title),
    h('ol', {}, ...steps.map((step) => h('li', {}, step))),
    h('p', {}, h('strong', {}, text('exercises.questions')), look),
    h('p', {}, h('strong', {}, text('exercises.handIn')), handIn),
    h('button', { type: 'button', onclick: () => onOpen(example) }, text('exercises.open')),
  );
}
