// Checks, merges and writes warnings.
import { checkProperties, denseCopy, integer, invalid, number, vec3 } from './check.js';
import type { Vec3 } from './data.js';
import type { StepReport } from './stepper.js';
import type { Warning, WarningCode } from './warning.js';

/** All kinds; compilation fails if one is missing. */
const CODES: Record<WarningCode, true> = {
  'ends-in-frame': true,
  'begins-in-frame': true,
  'uneven-brightness': true,
  'small-object': true,
  ...{ 'touches-box': true, handles: true, 'no-boundary': true, 'volume-jump': true },
  ...{ 'handle-stopped': true, 'self-intersecting': true },
  'thin-label': true,
  ...{ parts: true, 'thin-parts': true, 'inward-normals': true, outliers: true },
  ...{ precision: true, recentred: true, anisotropic: true, reader: true },
};

/** Most warnings that are accepted, and most characters of one, so that lists and files stay readable. */
const [MOST, LONGEST] = [1000, 2000];

/** Returns a copy of warnings that a caller gives; throws `invalid-argument` naming the one that is wrong. */
export function checkedWarnings(parameter: string, given: readonly Warning[] = []): Warning[] {
  const list = denseCopy(parameter, given);
  if (list.length > MOST) throw invalid(parameter, `must be at most ${MOST} warnings, got ${list.length}`);
  return list.map((warning, at) => checkedWarning(`${parameter}[${at}]`, warning));
}

function checkedWarning(parameter: string, given: Warning): Warning {
  const { code, text, where } = checkProperties(parameter, given, ['code', 'text', 'where']);
  if (typeof code !== 'string' || !Object.hasOwn(CODES, code))
    throw invalid(`${parameter}.code`, `must be one of ${Object.keys(CODES).join(', ')}; 'reader' for others`);
  if (typeof text !== 'string' || text.trim() === '' || text.length > LONGEST)
    throw invalid(`${parameter}.text`, `must be a text of 1 to ${LONGEST} characters`);
  return { code, text, ...(where !== undefined && { where: checkedPlace(`${parameter}.where`, where) }) };
}

function checkedPlace(parameter: string, given: NonNullable<Warning['where']>): NonNullable<Warning['where']> {
  type Places = { frame: number; label: number; point: [number, number, number] };
  const place: Partial<Places> = checkProperties(parameter, given as Partial<Places>, ['frame', 'label', 'point']);
  if (Object.keys(place).length !== 1) throw invalid(parameter, 'must have one of frame, label, point');
  if (place.frame !== undefined) return { frame: integer(`${parameter}.frame`, place.frame) };
  if (place.label !== undefined) return { label: number(`${parameter}.label`, place.label) };
  const [x = 0, y = 0, z = 0] = vec3(`${parameter}.point`, place.point);
  return { point: [x, y, z] };
}

/** Returns the place of a warning as its kind and its numbers, for the WebAssembly module. */
export function placeOf({ where }: Warning): [string, Float64Array] {
  const [kind = '', value = []] = Object.entries(where ?? {})[0] ?? [];
  return [kind, Float64Array.from([value].flat())];
}

/** Kinds of which there may be several that are not about the same. */
const SEVERAL: readonly WarningCode[] = ['reader', 'precision', 'parts'];

/** Returns the warnings of several lists, each once: of those with the same kind and place, the first. */
export function mergedWarnings(...lists: readonly (readonly Warning[])[]): Warning[] {
  const found = new Map<string, Warning>();
  for (const warning of lists.flat()) {
    const { code, text, where } = warning;
    const key = JSON.stringify([code, where, SEVERAL.includes(code) && text]);
    if (!found.has(key)) found.set(key, warning);
  }
  return [...found.values()];
}

/** Returns the warning about an iso value that no surface of a volume has. */
export function beyondRange({ range: [low, high] }: { range: [number, number] }, iso: number): Warning[] {
  if (iso >= low && iso <= high) return [];
  const text = `no surface has the iso value ${iso}: the intensities of the volume are from ${low} to ${high}`;
  return [{ code: 'no-boundary', text }];
}

/** Returns the warning about a surface in a file that was moved by -`origin`; none if that is 0. */
export function recentred(origin: Vec3): Warning[] {
  if (origin.every((coordinate) => coordinate === 0)) return [];
  const [x, y, z] = origin;
  const text = `The surface was moved by ${-x}, ${-y}, ${-z}. Add the point to all positions to move it back.`;
  return [{ code: 'recentred', text, where: { point: [x, y, z] } }];
}

/** Returns warnings as notes in files, lines `code: text` with the place in parentheses. */
export function notesOf(warnings: readonly Warning[]): string {
  const lines = warnings.map(({ code, text, where }) => {
    const place = Object.entries(where ?? {}).map(([kind, value]) => ` (${kind} ${[value].flat().join(' ')})`);
    return `${code}: ${text.replace(/\s+/g, ' ')}${place.join('')}`;
  });
  return lines.join('\n');
}

/** The warnings about the result of a model: those of its data and those of its last report. */
export class ModelWarnings {
  readonly #data: readonly Warning[];
  #report: readonly Warning[] = [];

  constructor(...data: readonly (readonly Warning[] | undefined)[]) {
    this.#data = data.flatMap((list) => list ?? []);
  }

  /** Adopts the warnings of a report, and returns it. */
  take(report: StepReport): StepReport {
    this.#report = report.warnings;
    return report;
  }

  /** Forgets the last report, as another state was restored. */
  forget(): void {
    this.#report = [];
  }

  /**
   * Returns the warnings of the data and of `report`, by default the last one, without those about another frame or label
   * than the given one.
   */
  of(place: { frame?: number; label?: number } = {}, report = this.#report): Warning[] {
    return mergedWarnings(this.#data, report).filter(({ where }) => {
      if (where && 'frame' in where && place.frame !== undefined) return where.frame === place.frame;
      return !(where && 'label' in where && place.label !== undefined) || where.label === place.label;
    });
  }
}
