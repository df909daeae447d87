import { GUIDES } from '../kit/guides';
import { LAB_IDS, type LabId } from '../lab/address';
import type { LabKind } from '../lab/lab';
import { spawnExtract } from '../labs/extract/client';
import { spawnReconstruct } from '../labs/reconstruct/client';
import { spawnSculpt } from '../labs/sculpt/client';
import { spawnSegment } from '../labs/segment/client';
import { spawnTrack } from '../labs/track/client';
import { text } from '../texts';

const KINDS: { readonly [Id in LabId]: LabKind & { id: Id } } = {
  extract: {
    id: 'extract',
    name: text('shell.extract'),
    tagline: text('shell.extractTagline'),
    guide: GUIDES.extract,
    spawn: spawnExtract,
    load: async () => (await import('../labs/extract')).makeExtract,
  },
  reconstruct: {
    id: 'reconstruct',
    name: text('shell.reconstruct'),
    tagline: text('shell.reconstructTagline'),
    guide: GUIDES.reconstruct,
    spawn: spawnReconstruct,
    load: async () => (await import('../labs/reconstruct')).makeReconstruct,
  },
  track: {
    id: 'track',
    name: text('shell.track'),
    tagline: text('shell.trackTagline'),
    guide: GUIDES.track,
    spawn: spawnTrack,
    load: async () => (await import('../labs/track')).makeTrack,
  },
  sculpt: {
    id: 'sculpt',
    name: text('shell.sculpt'),
    tagline: text('shell.sculptTagline'),
    guide: GUIDES.sculpt,
    spawn: spawnSculpt,
    load: async () => (await import('../labs/sculpt')).makeSculpt,
  },
  segment: {
    id: 'segment',
    name: text('shell.segment'),
    tagline: text('shell.segmentTagline'),
    guide: GUIDES.segment,
    spawn: spawnSegment,
    load: async () => (await import('../labs/segment')).makeSegment,
  },
};

/**
 * The labs, in the order of the navigation. If none is open yet, an empty or unknown address opens the first one.
 */
export const LABS = LAB_IDS.map((id): LabKind => KINDS[id]);

/** Returns the lab with this id in addresses, by default the first one. */
export const labCalled = (id: string | undefined): LabKind => LABS.find((lab) => lab.id === id) ?? KINDS[LAB_IDS[0]];
