/** Code of the Reconstruct lab's runs. */
import type { ImplicitChoice } from 'vesicle';
import { VesicleError } from 'vesicle/channel';
import { bytesOf, callsOf, chosen, type Program } from '../../engine/code';
import { literal } from '../../engine/literal';
import { text } from '../../texts';
import { toPointEdits } from './model';
import type { CameraView, Edits, PointArray, Setup } from './protocol';

/** Input of the model, and its choices if any of its parameters is automatic. */
interface Data {
  file: string | undefined;
  cameras: readonly CameraView[];
  choice: ImplicitChoice | undefined;
}

/** Returns how code makes the model of a set-up, with points from `file` or, if they were computed, from one that is saved. */
export function programOf(
  { params, edits, maxPoints, keepComponents }: Setup,
  { file, cameras, choice }: Data,
  stem: string,
): Program {
  const options = {
    ...(cameras.length > 0 && { cameras: cameras.map(({ image: _, ...camera }) => camera) }),
    ...(maxPoints !== undefined && { maxPoints }),
    ...(keepComponents !== undefined && { keepComponents }),
    params: chosen('implicit', params),
  };
  const setEdits = (edits: Edits) => `model.setEdits(${literal(toPointEdits(edits))});`;
  return {
    ...(file === undefined ? bytesOf([`${stem}.xyz`], ['bytes'], 'saved') : bytesOf([file], ['bytes'])),
    names: ['ImplicitSurface', 'parsePoints'],
    begin: [
      `const model = new ImplicitSurface({ ...parsePoints(bytes), ${literal(options).slice(2)});`,
      ...(Object.values(edits).some(({ length }) => length > 0) ? [setEdits(edits)] : []),
    ],
    calls: { ...callsOf('step', 'setParams'), setEdits },
    remark: choice && remarkOn(choice),
    note: cameras.some(({ image }) => image) ? text('sessions.noPictures') : undefined,
  };
}

/** Returns what the model chose from the points, in a sentence for people who read the code. */
function remarkOn({ noise, delta, lambdaSurface, lambdaExterior, sides }: ImplicitChoice): string {
  const numbers = Object.entries({ noise, delta, lambdaSurface, lambdaExterior });
  const list = numbers.map(([name, value]) => `${name} ${Number(value.toPrecision(3))}`);
  if (sides) list.push(`sides ${sides}`);
  return text('reconstruct.chosenInCode', { list: list.join(', ') });
}

/** Returns computed points as text, three coordinates a line; refuses if they are of a file, which the code reads. */
export function pointsFile(file: string | undefined, points: PointArray): Uint8Array {
  if (file !== undefined) throw new VesicleError('invalid-argument', text('sessions.noDataNeeded'));
  const lines = Array.from({ length: points.length / 3 }, (_, i) => points.subarray(3 * i, 3 * i + 3).join(' '));
  return new TextEncoder().encode(`${lines.join('\n')}\n`);
}
