import { type ReadonlySignal, signal } from '@preact/signals';
import type { ExportRequest, Space, Vec3 } from '../engine/protocol';
import { text } from '../texts';
import { useId } from './ui/id';
import { Button, Select } from './ui/parts';

type MeshFormat = ExportRequest['format'];

const FORMATS: { format: MeshFormat; help: string; type: string }[] = [
  {
    format: 'ply',
    help: text('controls.exportPly'),
    type: 'application/octet-stream',
  },
  { format: 'stl', help: text('controls.exportStl'), type: 'model/stl' },
  { format: 'glb', help: text('controls.exportGlb'), type: 'model/gltf-binary' },
  { format: 'obj', help: text('controls.exportObj'), type: 'model/obj' },
  { format: 'vtp', help: text('controls.exportVtp'), type: 'application/xml' },
  { format: 'mz3', help: text('controls.exportMz3'), type: 'application/octet-stream' },
];

/** An offer to save a surface moved to the origin, since a format is too coarse for it where it is. */
export interface Recentring {
  format: string;
  /** The point that is moved to the origin. */
  origin: Vec3;
  save: () => void;
}

/** Message that a format is too coarse for the surface where it is, with a button that saves it moved to the origin. */
export function RecentreOffer({ offer }: { offer: ReadonlySignal<Recentring | undefined> }) {
  if (!offer.value) return <div role="status" hidden />;
  const { format, origin, save } = offer.value;
  const name = format.toUpperCase();
  return (
    <div role="status">
      <p class="help">{text('controls.tooFar', { format: name, origin: origin.join(', ') })}</p>
      <Button data-action="recentre" onClick={save}>
        {text('controls.saveRecentred', { format: name })}
      </Button>
    </div>
  );
}

/** Added to the names of files whose surface is moved to the origin. */
export const RECENTRED = '-recentred';

/** How the current surface can be saved. */
export class Exports {
  readonly isEnabled = signal(false);
  /** Directions of the axes of the surface, if these are known: the file may have others. */
  readonly space = signal<Space | undefined>(undefined);
  /** Directions of the axes of files. */
  readonly as = signal<Space | undefined>(undefined);
  readonly recentring = signal<Recentring | undefined>(undefined);
  readonly #onExport: (request: ExportRequest, type: string) => void;

  /** `onExport` is called again for a surface that is to be moved to the origin, after an {@link offer}. */
  constructor(onExport: (request: ExportRequest, type: string) => void) {
    this.#onExport = onExport;
  }

  save(format: MeshFormat, type: string, recentre = false): void {
    this.recentring.value = undefined;
    const [space, as] = [this.space.peek(), this.as.peek()];
    this.#onExport({ format, ...(recentre && { recentre }), ...(space && as && { as }) }, type);
  }

  /** Offers to save the surface relative to `origin`, since the format is too coarse for it where it is. */
  offer(format: MeshFormat, type: string, origin: Vec3): void {
    this.recentring.value = { format, origin, save: () => this.save(format, type, true) };
  }

  of(space: Space | undefined): void {
    this.space.value = space;
    this.as.value = space;
  }

  set enabled(isEnabled: boolean) {
    if (!isEnabled) this.recentring.value = undefined;
    this.isEnabled.value = isEnabled;
  }
}

/** Buttons that save the current surface, one for each mesh file format. */
export function ExportButtons({ exports }: { exports: Exports }) {
  const id = useId();
  const space = exports.space.value;
  const label = (one: Space) => (one === space ? text('controls.axesOfData', { space: one }) : one);
  const axes = space === 'LPS' ? { LPS: label('LPS'), RAS: label('RAS') } : { RAS: label('RAS'), LPS: label('LPS') };
  return (
    <div>
      <div class="buttons exports">
        {FORMATS.map(({ format, help, type }) => (
          <Button
            key={format}
            title={help}
            aria-label={text('controls.saveAs', { format: help })}
            data-export={format}
            disabled={!exports.isEnabled.value}
            onClick={() => exports.save(format, type)}
          >
            {format.toUpperCase()}
          </Button>
        ))}
      </div>
      <div class="row" hidden={!space} title={text('controls.axesHelp')}>
        <label for={id}>{text('controls.axes')}</label>
        <Select
          {...{ id, 'data-export-axes': '', choices: axes, value: exports.as.value ?? 'RAS' }}
          onChoose={(as) => {
            exports.as.value = as;
          }}
        />
      </div>
      <RecentreOffer offer={exports.recentring} />
    </div>
  );
}
