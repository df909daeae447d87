/** Bounds of a lesson, which may come from anywhere: one beyond them would keep the page busy. */
import { text } from '../texts';

/** Most characters of `lesson.json`, and of a text. */
const MOST_CHARACTERS = 200_000;
/** Most steps. */
const MOST_STEPS = 100;
/** How deep conditions may be nested, as brackets in `lesson.json`. */
const MOST_NESTED = 40;
/** Most formulas of a text, characters of one, and of all together. */
const MOST_FORMULAS = 600;
const MOST_OF_FORMULA = 1_000;
const MOST_OF_FORMULAS = 15_000;
/** How deep a formula may be nested, as braces, delimiters and environments: 40 of 140 roots within each other take seconds. */
const MOST_NESTED_IN_FORMULA = 20;
/** Signs that nest a formula; comments and quotations may contain the same, and are matched as a whole. */
const NESTING = /%[^\n]*|\\verb\*?(?![a-zA-Z*])(.).*?\1|\\[a-zA-Z]+|\\[\s\S]|[{}]/g;
const OPENING = ['{', '\\left', '\\begin', '\\begingroup', '\\bgroup'];
const CLOSING = ['}', '\\right', '\\end', '\\endgroup', '\\egroup'];
/** Most cells of formulas: typesetting 5,000 takes seconds, and a page of 40,000 two gigabytes. */
const MOST_FORMULA_CELLS = 500;
/** Ends of cells and rows in formulas. */
const CELL_END = /&|\\\\|\\(?:cr|newline|tabularnewline)\b/g;
/** Most cells of tables, as bars between them: laying out 46,000 takes ten seconds. */
const MOST_CELLS = 5_000;

/** Most opening brackets of a text: looking for the links that 190,000 could begin takes seconds. */
const MOST_BRACKETS = 5_000;

/** Most elements of all texts, such as paragraphs, links and entries of lists: laying out 47,000 takes three seconds. */
const MOST_ELEMENTS = 5_000;

/** Formulas that define commands: a line of them can stand for megabytes. */
const DEFINITION = /\\(?:[egx]?def|(?:future)?let|(?:re|provide)?newcommand|providecommand|renewcommand|global|long)\b/;

/** A formula between one or two dollar signs. */
export const FORMULA = /\$\$([^$]+)\$\$|\$((?:[^$\\\n]|\\.)+)\$/;

/** Throws an Error if the text of a file is too long, or its brackets are nested too deep. */
export function checkData(file: string, source: string): void {
  checkLength(file, source);
  if (nesting(source) > MOST_NESTED) throw tooMuch(file, text('lessons.nested'), MOST_NESTED);
}

/** Throws an Error if there are too many steps. */
export function checkSteps(file: string, steps: number): void {
  if (steps > MOST_STEPS) throw tooMuch(file, text('lessons.stepCount'), MOST_STEPS);
}

/** Throws an Error if a text is too long, or has too large tables or too many brackets. */
export function checkText(file: string, source: string): void {
  checkLength(file, source);
  if (source.split('|').length > MOST_CELLS) throw tooMuch(file, text('lessons.cells'), MOST_CELLS);
  if (source.split('[').length > MOST_BRACKETS) throw tooMuch(file, text('lessons.brackets'), MOST_BRACKETS);
}

/** Throws an Error if the formulas of a text are too many, too long, nested too deep, or have too many cells. */
export function checkFormulas(file: string, formulas: string[]): void {
  let [length, cells] = [0, 0];
  for (const formula of formulas) {
    length += formula.length;
    cells += formula.match(CELL_END)?.length ?? 0;
    if (formula.length > MOST_OF_FORMULA) throw tooMuch(file, text('lessons.formulaCharacters'), MOST_OF_FORMULA);
    if (nestingOfFormula(formula) > MOST_NESTED_IN_FORMULA)
      throw tooMuch(file, text('lessons.formulaNested'), MOST_NESTED_IN_FORMULA);
  }
  if (formulas.length > MOST_FORMULAS) throw tooMuch(file, text('lessons.formulas'), MOST_FORMULAS);
  if (length > MOST_OF_FORMULAS) throw tooMuch(file, text('lessons.formulasCharacters'), MOST_OF_FORMULAS);
  if (cells > MOST_FORMULA_CELLS) throw tooMuch(file, text('lessons.formulaCells'), MOST_FORMULA_CELLS);
}

/** Throws an Error if the texts have too many elements. */
export function checkElements(file: string, elements: number): void {
  if (elements > MOST_ELEMENTS) throw tooMuch(file, text('lessons.elements'), MOST_ELEMENTS);
}

/** Returns whether a formula is typeset; others are shown as their source. */
export const isTypeset = (formula: string): boolean => formula.length <= MOST_OF_FORMULA && !DEFINITION.test(formula);

function checkLength(file: string, source: string): void {
  if (source.length > MOST_CHARACTERS) throw tooMuch(file, text('lessons.characters'), MOST_CHARACTERS);
}

const tooMuch = (file: string, what: string, most: number) => new Error(text('lessons.tooMuch', { file, what, most }));

/** Returns how deep brackets are nested in JSON, or more. */
function nesting(json: string): number {
  let [depth, deepest] = [0, 0];
  for (const character of json) {
    if (character === '[' || character === '{') deepest = Math.max(deepest, ++depth);
    if (character === ']' || character === '}') depth -= 1;
  }
  return deepest;
}

/** Returns how deep a formula is nested. */
function nestingOfFormula(formula: string): number {
  let [depth, deepest] = [0, 0];
  for (const [sign] of formula.matchAll(NESTING)) {
    if (OPENING.includes(sign)) deepest = Math.max(deepest, ++depth);
    if (CLOSING.includes(sign)) depth -= 1;
  }
  return deepest;
}
