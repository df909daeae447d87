import type { LabelArray } from '../../engine/labels';
import { tooManyLabels } from '../../engine/small-files';
import { nameOf, reading } from '../../importers/files';
import { dataUrl, fetchBytes } from '../../lab/downloads';
import type { Handoff } from '../../lab/lab';
import { Opening, type Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { LabStates } from '../../lab/states';
import type { SegmentClient } from './client';
import { SEGMENT_EXAMPLES, type SegmentExample, segmentExampleById } from './examples';
import { fromHash, type LinkedSegment } from './link';
import type { SegmentParts } from './parts';
import type { ImageSource, NamedBytes, OpenedImage, ParamSpec } from './protocol';

export type SegmentSource = Source<SegmentExample, LinkedSegment, ImageSource>;

/** Interface to the lab, as opening a volume needs it. */
export interface OpeningLab {
  /** Displays what was opened; with `reopening`, with the labels as they were before. */
  adopt: (opened: OpenedImage, source: SegmentSource, reopening: boolean) => void;
  /** Returns a copy of the voxels of the present label map, to open again with its volume. */
  labels: () => LabelArray | undefined;
}

/** Opens volumes and their label maps in the Segment lab. */
export class SegmentOpening extends Opening<SegmentExample, LinkedSegment, ImageSource, OpenedImage> {
  protected readonly first = SEGMENT_EXAMPLES[0];
  readonly #client: SegmentClient;
  readonly #lab: OpeningLab;
  /** Default values of the parameters of the surfaces. */
  defaults: Record<string, unknown> = {};

  constructor(client: SegmentClient, ui: SegmentParts, states: LabStates, lab: OpeningLab) {
    super(client, ui, states);
    this.#client = client;
    this.#lab = lab;
  }

  /** Opens the present source again, with its own label map. */
  async again(): Promise<void> {
    if (this.source) await this.open(this.source);
  }

  /** Opens a label map that another lab passes on. */
  override passedOn({ name, bytes, warnings = [] }: Handoff): Promise<void> {
    return this.open({ name, load: async () => ({ files: [{ name, bytes }] }), isKept: true, warnings });
  }

  protected find(id: string): SegmentExample | undefined {
    return segmentExampleById(id);
  }

  protected linkedBy(hash: string): LinkedSegment | undefined {
    return fromHash(hash);
  }

  protected fromExample(example: SegmentExample): SegmentSource {
    return { name: example.name, load: () => imageOf(example), example };
  }

  protected fromFiles(files: File[]): SegmentSource {
    return { name: nameOf(files), ...reading(files) };
  }

  protected override voxelsOf({ volume }: OpenedImage): number {
    return volume.voxels.length;
  }

  override filesOf({ files }: ImageSource): NamedBytes[] {
    return files;
  }

  protected override onEngineReady(specs: ParamSpec[]): void {
    this.defaults = Object.fromEntries(specs.map(({ name, default: value }) => [name, value]));
  }

  protected async load(origin: SegmentSource, source: ImageSource, reopening: boolean): Promise<OpenedImage> {
    const { name, linked, session } = origin;
    if (session && !reopening) {
      const { params, voxels: labels, state, labels: list } = contentOf(session, 'segment');
      const isSmall = session.isSmall === true;
      const refusal = isSmall && tooManyLabels(list.length);
      if (refusal) throw new Error(refusal);
      return this.#client.request('open', { name, source, params, labels, state, isSmall });
    }
    const labels = reopening ? this.#lab.labels() : undefined;
    return this.#client.request('open', { name, source, params: { ...linked?.params }, labels });
  }

  protected async adopt(opened: OpenedImage, source: SegmentSource, reopening: boolean): Promise<void> {
    this.#lab.adopt(opened, source, reopening);
  }
}

async function imageOf({ file, labelling }: SegmentExample): Promise<ImageSource> {
  const files = [{ name: file, bytes: await fetchBytes(dataUrl(file)) }];
  return { files, ...(labelling && { labelling }) };
}
