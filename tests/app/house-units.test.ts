// The house: files of a floor import from their own floor and those below it, and no lab from another.
import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join, relative, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import ts from 'typescript';
import { expect, test } from 'vitest';

const SRC = fileURLToPath(new URL('../../www/src', import.meta.url));

/** The folders of the app, floor by floor from the top; ARCHITECTURE.md says what is on each. */
const FLOORS = [
  ['app'],
  ['bench', 'lessons'],
  ['labs'],
  ['lab'],
  ['finish'],
  ['importers'],
  ['scene'],
  ['kit'],
  ['engine'],
  ['texts'],
];

const files = readdirSync(SRC, { recursive: true, encoding: 'utf8' }).filter((path) => /\.tsx?$/.test(path));

/** Returns the relative paths that a file names: imports, types, workers, and files beside it. */
function named(path: string): string[] {
  const found: string[] = [];
  const visit = (node: ts.Node) => {
    if (ts.isStringLiteralLike(node) && /^\.\.?\//.test(node.text)) found.push(node.text);
    ts.forEachChild(node, visit);
  };
  visit(ts.createSourceFile(path, readFileSync(join(SRC, path), 'utf8'), ts.ScriptTarget.Latest));
  return found.map((name) => relative(SRC, resolve(SRC, dirname(path), name)));
}

const floorOf = (path: string) => FLOORS.findIndex((floor) => floor.includes(path.split('/')[0] ?? ''));

/** Returns the room of a file: its lab, or else its folder at the top. */
function roomOf(path: string): string {
  const [top = '', lab] = path.split('/');
  return top === 'labs' ? `labs/${lab}` : top;
}

/** Whether a file may not import from another. */
function isAgainstOrder(from: string, to: string): boolean {
  if (roomOf(from) === roomOf(to)) return false;
  return floorOf(to) <= floorOf(from);
}

const arrows = files.flatMap((from) =>
  named(from)
    .filter((to) => floorOf(to) >= 0)
    .map((to) => [from, to] as const),
);

test('every file is on a floor', () => {
  expect(files.filter((path) => floorOf(path) < 0)).toEqual([]);
});

test('imports lead downwards', () => {
  const rooms = new Set(files.map(roomOf));
  const between = new Set(arrows.map(([from, to]) => `${roomOf(from)} → ${roomOf(to)}`));
  const against = arrows.filter(([from, to]) => isAgainstOrder(from, to)).map((arrow) => arrow.join(' → '));
  console.info(
    `${rooms.size} rooms on ${FLOORS.length} floors, ${between.size} arrows between them, ${against.length} against the order`,
  );
  expect(arrows.length).toBeGreaterThan(1000);
  expect(against).toEqual([]);
});

test('no class extends another of the app', () => {
  const found = files.flatMap((path) => {
    const classes: string[] = [];
    const visit = (node: ts.Node) => {
      const base =
        ts.isClassLike(node) && node.heritageClauses?.find((one) => one.token === ts.SyntaxKind.ExtendsKeyword);
      if (base) classes.push(`${path}: ${base.types[0]?.expression.getText()}`);
      ts.forEachChild(node, visit);
    };
    visit(ts.createSourceFile(path, readFileSync(join(SRC, path), 'utf8'), ts.ScriptTarget.Latest, true));
    return classes;
  });
  expect(found.filter((one) => !/: (Error|HTMLElement)$/.test(one))).toEqual([]);
  // Errors are found, so that others would be.
  expect(found.length).toBeGreaterThan(0);
});
