import type { LabelArray } from '../../engine/labels';
import { tooManyLabels } from '../../engine/small-files';
import { nameOf, reading } from '../../importers/files';
import { dataUrl, fetchBytes } from '../../lab/downloads';
import type { Handoff } from '../../lab/lab';
import type { LabData, Loading, Opening, Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { SegmentClient } from './client';
import { SEGMENT_EXAMPLES, type SegmentExample, segmentExampleById } from './examples';
import { fromHash, type LinkedSegment } from './link';
import type { ImageSource, NamedBytes, OpenedImage, ParamSpec } from './protocol';
import type { SegmentContent } from './schema';

export type SegmentSource = Source<SegmentExample, LinkedSegment, ImageSource>;
export type SegmentOpening = Opening<SegmentExample, LinkedSegment, ImageSource, OpenedImage>;

/** Interface to the lab, as opening a volume needs it. */
interface OpeningLab {
  /** Displays what was opened; with `reopening`, with the labels as they were before. */
  adopt: (opened: OpenedImage, source: SegmentSource, reopening: boolean) => void;
  /** Returns a copy of the voxels of the present label map, to open again with its volume. */
  labels: () => LabelArray | undefined;
}

/** Volumes of the Segment lab, and how they are opened with their label maps. */
export class SegmentData implements LabData<SegmentExample, LinkedSegment, ImageSource, OpenedImage> {
  readonly first = SEGMENT_EXAMPLES[0];
  readonly #client: SegmentClient;
  readonly #lab: OpeningLab;
  /** Default values of the parameters of the surfaces. */
  defaults: Record<string, unknown> = {};

  constructor(client: SegmentClient, lab: OpeningLab) {
    this.#client = client;
    this.#lab = lab;
  }

  find(id: string): SegmentExample | undefined {
    return segmentExampleById(id);
  }

  linkedBy(hash: string): LinkedSegment | undefined {
    return fromHash(hash);
  }

  fromExample(example: SegmentExample): SegmentSource {
    return { name: example.name, load: () => imageOf(example), example };
  }

  fromFiles(files: File[]): SegmentSource {
    return { name: nameOf(files), ...reading(files) };
  }

  fromHandoff({ name, bytes, warnings = [] }: Handoff): SegmentSource {
    return { name, load: async () => ({ files: [{ name, bytes }] }), isKept: true, warnings };
  }

  voxelsOf({ volume }: OpenedImage): number {
    return volume.voxels.length;
  }

  filesOf({ files }: ImageSource): NamedBytes[] {
    return files;
  }

  onEngineReady(specs: ParamSpec[]): void {
    this.defaults = Object.fromEntries(specs.map(({ name, default: value }) => [name, value]));
  }

  async load(
    origin: SegmentSource,
    source: ImageSource,
    { reopening }: Loading<SegmentExample, LinkedSegment, ImageSource>,
  ): Promise<OpenedImage> {
    const { name, linked, session } = origin;
    if (session && !reopening) {
      const { params, voxels: labels, state, labels: list } = contentOf<SegmentContent>(session, 'segment');
      const isSmall = session.isSmall === true;
      const refusal = isSmall && tooManyLabels(list.length);
      if (refusal) throw new Error(refusal);
      return this.#client.request('open', { name, source, params, labels, state, isSmall });
    }
    const labels = reopening ? this.#lab.labels() : undefined;
    return this.#client.request('open', { name, source, params: { ...linked?.params }, labels });
  }

  async adopt(opened: OpenedImage, source: SegmentSource, reopening: boolean): Promise<void> {
    this.#lab.adopt(opened, source, reopening);
  }
}

async function imageOf({ file, labelling }: SegmentExample): Promise<ImageSource> {
  const files = [{ name: file, bytes: await fetchBytes(dataUrl(file)) }];
  return { files, ...(labelling && { labelling }) };
}
