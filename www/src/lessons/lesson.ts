/** A lesson: `lesson.json` and its text in Markdown, as docs/lessons.md describes them to authors. */
import { labOf } from '../lab/address';
import { legible, text } from '../texts';
import { checkData, checkElements, checkFormulas, checkSteps, checkText } from './bounds';
import { type Check, checkProblem, type Operand, operandProblem } from './check';
import { partsOf } from './formulas';
import { unitNamed } from './units';

/** Headings within a step, in the order in which they are shown; `answer` is for teachers only. */
export const PARTS = ['goal', 'do', 'watch', 'check', 'question', 'hint', 'explanation', 'answer'] as const;
export type Part = (typeof PARTS)[number];

/** Question of a step: for a number, in a unit or without one, or else for a text. */
export type Question = { answer: Operand; within?: number; unit?: string } | 'text';

/** A step as `lesson.json` states it. */
interface StepData {
  id: string;
  /** Address of a lab with settings, as in its link, without the number sign. */
  open?: string;
  check?: Check;
  question?: Question;
}

export interface Step extends StepData {
  /** Language of its text. */
  language: string;
  title: string;
  /** Texts of the step, as Markdown. */
  parts: Partial<Record<Part, string>>;
}

export interface Lesson {
  id: string;
  /** Language of its text. */
  language: string;
  minutes: number;
  title: string;
  intro: string;
  steps: Step[];
}

/** Files of a lesson: their content by name, without folders. */
export type LessonFiles = Record<string, string>;

const DATA = 'lesson.json';
const textFile = (language: string) => `text.${language}.md`;

/**
 * Reads a lesson from its files, with the text in `language`, or else in the first language that the lesson lists.
 *
 * Throws an Error that says what is wrong and what is accepted.
 */
export function parseLesson(files: LessonFiles, language: string): Lesson {
  const data = parseData(files[DATA]);
  const used = chosenLanguage(data.languages, language);
  const given = files[textFile(used)];
  if (given === undefined) throw new Error(text('lessons.noText', { file: textFile(used) }));
  checkText(textFile(used), given);
  const source = legible(given);
  const { title, intro, steps } = parseText(source);
  const texts = [intro, ...steps.flatMap(({ parts }) => Object.values(parts))];
  const parts = texts.map(partsOf);
  checkFormulas(
    textFile(used),
    parts.flatMap(({ formulas }) => formulas),
  );
  checkElements(
    textFile(used),
    parts.reduce((sum, { elements }) => sum + elements, 0),
  );
  if (steps.length !== data.steps.length)
    throw new Error(
      text('lessons.stepsDiffer', { file: textFile(used), headings: steps.length, steps: data.steps.length }),
    );
  const { id, minutes } = data;
  return {
    id,
    minutes,
    language: used,
    title,
    intro,
    steps: data.steps.map((one, at) => ({ ...one, ...steps[at], language: used })) as Step[],
  };
}

/** Returns the names of the files that a lesson with this `lesson.json` needs in a language. */
export function filesOf(data: string, language: string): string[] {
  return [DATA, textFile(chosenLanguage(parseData(data).languages, language))];
}

function chosenLanguage(languages: string[], language: string): string {
  return languages.includes(language) ? language : (languages[0] ?? language);
}

interface LessonData {
  id: string;
  languages: string[];
  minutes: number;
  steps: StepData[];
}

function parseData(source: string | undefined): LessonData {
  if (source === undefined) throw new Error(text('lessons.noData', { file: DATA }));
  checkData(DATA, source);
  const { id, languages, minutes, steps } = parseJson(legible(source));
  const strings = Array.isArray(languages) && languages.length > 0 && languages.every((one) => typeof one === 'string');
  if (typeof id !== 'string' || !/^[\w-]+$/.test(id)) throw new Error(text('lessons.idInvalid', { file: DATA }));
  if (!strings) throw new Error(text('lessons.languagesInvalid', { file: DATA }));
  if (!Array.isArray(steps) || steps.length === 0) throw new Error(text('lessons.stepsInvalid', { file: DATA }));
  checkSteps(DATA, steps.length);
  const before: string[] = [];
  for (const step of steps) {
    const problem = stepProblem(step ?? {}, before);
    if (problem) throw new Error(text('lessons.stepInvalid', { step: before.length + 1, problem }));
    before.push(step.id);
  }
  return { id, languages, minutes: Number(minutes) || 0, steps };
}

function parseJson(source: string): Record<string, unknown> {
  try {
    return Object(JSON.parse(source));
  } catch (error) {
    throw new Error(text('lessons.jsonInvalid', { file: DATA, message: String(error) }));
  }
}

/** Returns what is wrong with a step, undefined if nothing; `before` are the ids of the steps before it. */
function stepProblem({ id, open, check, question }: Record<string, unknown>, before: string[]): string | undefined {
  if (typeof id !== 'string' || before.includes(id)) return text('lessons.stepId');
  if (open !== undefined && (typeof open !== 'string' || !labOf(`#${open}`))) return text('lessons.openInvalid');
  const problem = question === undefined ? undefined : questionProblem(question, [...before, id]);
  if (problem) return text('lessons.questionInvalid', { problem });
  return check === undefined ? undefined : checkProblem(check, before);
}

/** Returns what is wrong with a question, undefined if nothing. */
function questionProblem(question: unknown, steps: string[]): string | undefined {
  if (question === 'text') return undefined;
  const { answer, within = 0, unit }: Record<string, unknown> = Object(question);
  if (typeof answer === 'string' || typeof answer === 'boolean') return text('lessons.answerInvalid');
  if (typeof within !== 'number' || !(within >= 0)) return text('lessons.withinInvalid');
  if (unit !== undefined && !unitNamed(String(unit))) return text('lessons.unitUnknown');
  return operandProblem(answer, steps);
}

interface LessonText {
  title: string;
  intro: string;
  steps: Pick<Step, 'title' | 'parts'>[];
}

/** Splits a text at its headings: of the lesson, its steps, and their parts. */
function parseText(source: string): LessonText {
  const [head = '', ...steps] = source.split(/^## /m);
  const [title, intro] = split(head.replace(/^\s*# /, ''));
  return { title, intro, steps: steps.map(parseStep) };
}

function parseStep(source: string): Pick<Step, 'title' | 'parts'> {
  const [head = '', ...sections] = source.split(/^### /m);
  const [title, goal] = split(head);
  const parts: Partial<Record<Part, string>> = goal ? { goal } : {};
  for (const section of sections) {
    const [name, body] = split(section);
    if (!(PARTS as readonly string[]).includes(name))
      throw new Error(text('lessons.partUnknown', { name, step: title, accepted: PARTS.join() }));
    parts[name as Part] = body;
  }
  return { title, parts };
}

/** Returns the first line of a section, which is its heading, and the rest. */
function split(section: string): [heading: string, body: string] {
  const [heading = '', ...lines] = section.split('\n');
  return [heading.trim(), lines.join('\n').trim()];
}
